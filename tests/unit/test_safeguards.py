"""What safeguards did, in words."""
from pysph_boiling.runs.safeguards import COUNTS, sentences, summary

TABLE = {"n_limited": [0.0, 3.0], "n_projected": [0.0, 0.0], "heat_subcycles": [1.0, 40.0, 2.0]}


def test_only_those_that_acted_are_reported():
    assert summary(TABLE) == "limited corrections 3, heat substeps 40"
    assert sentences(TABLE, 2) == ["3 position corrections were shortened to the largest one allowed",
                                   "a step took up to 40 heat substeps"]
    assert sentences({}, 0) == [] and summary({name: [] for name in COUNTS}) == ""
