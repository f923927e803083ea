"""Figures 3, 4 and 15: steady boiling, what happens once the heater is off, and the mean bubble radius."""
