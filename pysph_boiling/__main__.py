"""``python -m pysph_boiling`` is ``pysph-boiling``."""
import sys

from pysph_boiling.cli import main

if __name__ == "__main__":
    sys.exit(main())
