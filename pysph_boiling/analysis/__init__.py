"""What a run tells: ledger, bubble statistics, plots and pictures. Host side."""
