"""Labels of bubbles in another scheme: an array of PySPH's own with nothing but a phase."""
import numpy as np
import pytest
from harness import Evaluator, host_only
from pysph.base.nnps import DomainManager
from pysph.base.utils import get_particle_array

from pysph_boiling.phases import Phase
from pysph_boiling.schemes.guest import label_groups

LINK = 1.4  # link radius, spacings
ROWS = np.array([(0.5 + column, 4.0 * row, 0.0) for row in range(2) for column in range(9)])  # two bubbles of nine


@host_only
@pytest.mark.parametrize("shift", [0.0, 16.0], ids=["inside", "across the border"])
@pytest.mark.parametrize("uid", [None, 0], ids=["no uid", "one uid for all"])
def test_labels_in_another_scheme(shift, uid):
    """An array of PySPH's own with nothing but a phase, in a periodic domain."""
    x, y = (ROWS[:, 0] + shift) % 20.0, ROWS[:, 1]
    pa = get_particle_array(name="fluid", x=x, y=y, m=1.0, h=1.2)
    pa.add_property("phase", type="int", data=np.full(len(x), int(Phase.VAPOUR)))
    if uid is not None:
        pa.add_property("uid", type="unsigned int")  # PySPH fills it with 0
    bubbles = Evaluator([pa], label_groups(pa, radius=LINK), dim=2, domain=DomainManager(
        xmin=0.0, xmax=20.0, periodic_in_x=True))
    for _ in range(2):
        bubbles.run()
        np.testing.assert_array_equal(pa.get("bubble", only_real_particles=True), np.repeat([0, 9], 9))


def test_labels_in_another_scheme_need_phase_and_radius():
    pa = get_particle_array(name="water", x=ROWS[:, 0])
    with pytest.raises(ValueError, match="'water' needs the property 'phase'"):
        label_groups(pa, radius=LINK)
    pa.add_property("phase", type="int")
    with pytest.raises(ValueError, match="link radius must be > 0 m, got -1.0"):
        label_groups(pa, radius=-1.0)
