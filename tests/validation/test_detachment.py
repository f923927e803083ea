"""Detachment (the paper, 4.2.1): a bubble grown by heating at one site leaves larger, the stronger it adheres."""
import numpy as np

from pysph_boiling.problems.departure import Departure

# In units of gravity. Measured N (median of 3): 6, 7, 11, 17. Above 10 g it saturates at 16: adhesion holds what lies
# within its range, and the bubble pinches off above that.
ADHESION = (0.0, 2.5, 5.0, 10.0)


def test_bubble_at_departure_grows_with_adhesion():
    sizes = [Departure(adhesion=adhesion).run().facts["size"] for adhesion in ADHESION]
    assert np.all(np.diff(sizes) > 0.0), f"N at departure for adhesion {ADHESION} g: {sizes}"
