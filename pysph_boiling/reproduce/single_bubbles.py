"""Figures 7 to 12: one bubble rising, two merging, one splitting, and the ablations of each."""
