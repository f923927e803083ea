"""Figures 5 and 6: explosive boiling, and the same without the oscillation constraint."""
