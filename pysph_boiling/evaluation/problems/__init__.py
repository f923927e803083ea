"""Problems with known answers: what ``pysph-boiling accuracy`` and ``pysph-boiling validate`` measure the model by.

One module a problem. Each is a frozen dataclass of its parameters, physical and numerical; ``run()`` returns an
:class:`~pysph_boiling.evaluation.problems.problem.Outcome`.
"""
