"""A run: the application of a scene, its files, its ledger, how it goes on."""
