"""Presets: what they set, what they leave alone, and what is refused. Their errors are measured in tests/accuracy."""
import pytest

from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.schemes.effects import DensityConstraint
from pysph_boiling.schemes.pbf import PBFScheme
from pysph_boiling.schemes.quality import QUALITIES


def scheme(**given):
    return PBFScheme(["fluid"], [], dim=2, spacing=0.01, **given)


@pytest.mark.parametrize("name", QUALITIES)
def test_quality_sets_time_step_and_sweeps(name):
    made, quality = scheme(quality=name), QUALITIES[name]
    assert made.effects["density"] == quality.density
    assert made.time_step() == pytest.approx(quality.dt_factor * (0.01 / 9.81) ** 0.5)


def test_qualities_are_ordered():
    draft, standard, reference = (QUALITIES[name] for name in ("draft", "standard", "reference"))
    errors = [quality.stated["hydrostatic_2d", "density_mean"] for quality in (draft, standard, reference)]
    assert errors == sorted(errors, reverse=True) and len(set(errors)) == 3 and standard.cost == 1.0
    assert draft.cost < standard.cost < reference.cost


def test_sweeps_that_are_given_are_kept():
    given = DensityConstraint(max_sweeps=9)
    assert scheme(quality="draft", density=given).effects["density"] is given
    assert "density" not in scheme(density=None).effects


@pytest.mark.parametrize(("dim", "hdx", "stiffest", "least"), [
    (2, 1.2, 2.61, 0.7), (3, 1.2, 3.98, 0.45),  # eigenvalues of the sweep on the places of settled water
    (3, 1.5, 6.8, 0.2),  # of the lattice
])
def test_pairs_of_sweeps_are_stable_unless_the_relaxation_is_given(dim, hdx, stiffest, least):
    made = PBFScheme(["fluid"], [], dim=dim, spacing=0.01, hdx=hdx)
    omega = made.effects["density"].omega_in(made.scene())
    assert least <= omega <= 0.7 and omega * stiffest < 2.0
    assert DensityConstraint(omega=0.9).omega_in(made.scene()) == 0.9


def test_unknown_quality_is_refused():
    with pytest.raises(ValueError, match="no quality 'best'; there are: draft, standard, reference"):
        scheme(quality="best")


def test_scene_takes_a_quality_and_options_refine_it():
    own, asked = (SteadyBoiling().resolve(["--flat", *more]) for more in (
        (), ("--quality", "reference", "--density.omega", "0.6")))
    wanted = QUALITIES["reference"].density.replaced(omega=0.6)
    assert repr(wanted) in asked and repr(wanted) not in own
