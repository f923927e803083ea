"""Difficult cases that must stay stable: the command ``pysph-boiling stress``.

``bounds.json`` has the bounds, each with its reason, and ``judge.py`` applies them. ``cases.py`` lists the modules with
the cases.
"""
