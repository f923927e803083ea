"""Boiling with Position Based Fluids: equations, schemes and examples for PySPH.

Import from the modules below; this file stays light.
"""
__version__ = "0.1.0"
