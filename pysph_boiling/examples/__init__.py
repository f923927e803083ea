"""One application a scene, each runnable by name."""
