"""What accuracy costs in time: the command ``pysph-boiling accuracy``."""
