"""For all tests."""
import logging

# PySPH's applications leave handlers behind, on streams that pytest closes at the end of a test. What logging says of
# them on stderr would be taken for what a later test says.
logging.raiseExceptions = False
