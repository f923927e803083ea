"""Problems with known answers, by which ``pysph-boiling accuracy`` and ``pysph-boiling validate`` measure the model.

There is one module per problem. Each problem is a frozen dataclass of its physical and numerical parameters; its
``run()`` returns an :class:`~pysph_boiling.evaluation.problems.problem.Outcome`.
"""
