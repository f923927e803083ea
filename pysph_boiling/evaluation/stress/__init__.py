"""Hard cases, and what they must not do: ``pysph-boiling stress``.

Bounds stand in ``bounds.json``, each with its reason; ``judge.py`` applies them; the modules named in ``cases.py`` hold
the cases.
"""
