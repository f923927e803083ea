"""Running a scene: the application, its options, its files, its ledger, and resuming an interrupted run."""
