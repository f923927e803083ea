"""Table 4: particles and time per frame of the six scenes."""
