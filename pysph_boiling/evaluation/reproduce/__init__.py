"""The paper, reproduced: the simulations behind each figure and table, drawn, measured and held against its statements.

One module per group of figures; each defines :class:`~pysph_boiling.evaluation.reproduce.figure.Figure` subclasses.
``runs`` keeps and continues the simulations.
"""
