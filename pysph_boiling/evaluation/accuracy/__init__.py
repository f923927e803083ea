"""The command ``pysph-boiling accuracy``, which measures how much computing time a given accuracy takes."""
