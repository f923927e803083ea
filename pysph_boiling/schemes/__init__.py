"""Schemes that order the equations, and the effects they are composed of."""
