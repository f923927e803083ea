"""Reads of particle arrays: what the host's path of :mod:`pysph_boiling.device` gives, and names a device can hold."""
import numpy as np
import pytest
from pysph.base.utils import get_particle_array

from pysph_boiling.device import Subset, counted, largest, largest_size, smallest, summed, values
from pysph_boiling.examples.explosive_boiling import ExplosiveBoiling
from pysph_boiling.particles import BASE_PROPERTIES, WALL_PROPERTIES


@pytest.fixture
def pa():
    array = get_particle_array(name="fluid", x=np.arange(6.0), m=np.array([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
    array.add_property("phase", type="int", data=np.array([0, 3, 0, 3, 3, 1]))
    array.tag[5] = 1  # a ghost
    array.align_particles()
    return array


def test_reductions_take_the_real_particles_that_are_chosen(pa):
    m, vapour = values(pa, "m"), values(pa, "phase") == 3
    assert (counted(vapour), summed(m), summed(m, vapour), largest(m), largest(m, ~vapour)) == (3, 15.0, 11.0, 5.0, 3.0)
    assert (smallest(m), largest_size(m - 2.0), largest_size(m - 5.0)) == (1.0, 3.0, 4.0)


def test_reductions_of_nothing(pa):
    m, nobody = values(pa, "m"), values(pa, "phase") == 7
    assert (counted(nobody), summed(m, nobody), largest(m, nobody)) == (0, 0.0, 0.0)
    assert largest(m, nobody, -np.inf) == -np.inf
    assert largest(-m) == 0.0 and largest_size(m[:0]) == 0.0


def test_nan_and_infinity_are_told(pa):
    pa.m[2] = np.nan
    for reduce in (summed, largest, smallest, largest_size):
        assert np.isnan(reduce(values(pa, "m")))
    pa.m[2] = -np.inf
    assert smallest(values(pa, "m")) == -np.inf and largest_size(values(pa, "m")) == np.inf
    pa.m[2] = np.inf
    assert largest(values(pa, "m")) == np.inf


def test_subset_reads_writes_narrows_and_removes(pa):
    vapour = Subset(pa, values(pa, "phase") == 3)
    np.testing.assert_array_equal(vapour.get("x"), [1.0, 3.0, 4.0])
    vapour.put("m", [10.0, 20.0, 30.0])
    np.testing.assert_array_equal(pa.get("m"), [1.0, 10.0, 3.0, 20.0, 30.0])
    some = vapour.only([True, False, True])
    some.put("phase", 0)
    np.testing.assert_array_equal(pa.get("phase"), [0, 0, 0, 3, 0])
    some.remove()
    np.testing.assert_array_equal(np.sort(pa.get("x")), [0.0, 2.0, 3.0])
    assert len(Subset(pa, values(pa, "phase") == 7)) == 0


def test_no_property_hides_a_part_of_a_device_array():
    """PySPH keeps properties and constants as attributes of its device helper, beside its methods."""
    from pysph.base.device_helper import DeviceHelper  # it can be imported after particle arrays alone
    from sets import SETS, scheme

    taken = set(dir(DeviceHelper)) | {"backend", "use_double", "properties", "constants", "num_real_particles"}
    names = {row.name for row in (*BASE_PROPERTIES, *WALL_PROPERTIES)}
    schemes = [scheme(name, dim=2, spacing=0.01) for name in SETS]
    schemes.append(ExplosiveBoiling().make_scheme(ExplosiveBoiling.Parameters()))
    for made in schemes:
        names |= {row.name for what in ("properties", "site_properties", "wall_properties")
                  for row in made.effect_rows(what)}
        names |= {name for effect in made.effects.values() for name in effect.constants(made.scene())}
    assert "push" in taken and len(names) > 60
    assert not names & taken
