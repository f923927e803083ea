"""Whether two runs came to the same, to the bit."""
import numpy as np

from pysph_boiling.files import output_files, read_output
from pysph_boiling.results import load_results

__all__ = ["assert_same_end", "assert_same_results"]


def assert_same_results(ours, theirs):
    """Both tables, or those of two folders, have the same columns with the same numbers."""
    ours, theirs = (one if isinstance(one, dict) else load_results(one) for one in (ours, theirs))
    assert ours.keys() == theirs.keys()
    for name in theirs:
        np.testing.assert_array_equal(ours[name], theirs[name], err_msg=name)


def assert_same_end(ours, theirs):
    """The last particle files in both folders hold the same particles."""
    ended, expected = (read_output(output_files(folder)[-1])[0] for folder in (ours, theirs))
    for name, pa in expected.items():
        for prop in pa.output_property_arrays:
            np.testing.assert_array_equal(ended[name].get(prop), pa.get(prop), err_msg=f"{name}.{prop}")
