"""Analysis of finished runs: shapes of bubbles, plots, pictures, rendered surfaces and movies."""
