"""Reproduction of the paper: simulations for each figure and table, drawn, measured and compared with its statements.

There is one module per group of figures, which defines subclasses of
:class:`~pysph_boiling.evaluation.reproduce.figure.Figure`. The module ``runs`` stores and continues the simulations.
"""
