"""The layers at walls, on points whose layers are known."""
import numpy as np
import pytest

from pysph_boiling.analysis.layering import density_profile, first_layer, pool_layers, radial_distribution

SIZE = {2: (24.0, 20.0), 3: (14.0, 13.0, 12.0)}


def lattice(size, first=0.5):
    """A cubic lattice whose first layers are ``first`` from the corner 0."""
    axes = [np.arange(first, s, 1.0) for s in size]
    return np.stack(np.meshgrid(*axes, indexing="ij"), -1).reshape(-1, len(size))


def at_random(size, many):
    """``many`` times as many points as fill the box, at random."""
    number = int(np.prod(size)) * many
    return np.random.default_rng(1).uniform(0.0, size, (number, len(size)))


@pytest.mark.parametrize("dim", [2, 3])
def test_planes_of_a_lattice_are_found_at_all_walls(dim):
    found = pool_layers(lattice(SIZE[dim], first=0.55), SIZE[dim])
    planes = np.zeros(24)
    planes[[4, 12, 20]] = 8.0  # .55, 1.55 and 2.55
    assert found["base"] == pytest.approx(planes, rel=0.2)  # whole planes, but a lattice off the middle of the box
    assert np.flatnonzero(found["side"]).tolist() == [3, 4, 11, 12, 19, 20]  # .45 from the far sides
    assert found["side"].sum() == pytest.approx(24.0, rel=0.2)
    assert first_layer(planes) == (8.0, 0.0)


@pytest.mark.parametrize("dim", [2, 3])
def test_points_at_random_have_no_layers(dim):
    size, many = SIZE[dim], {2: 400, 3: 60}[dim]
    found = pool_layers(at_random(size, many), size)
    for name in ("base", "side"):
        assert found[name] / many == pytest.approx(np.ones(24), abs=0.12)  # 4 sigma of 1000 points or more
        peak, gap = first_layer(found[name] / many)
        assert 1.0 <= peak < 1.12 and 0.88 < gap <= 1.0
    if dim == 3:
        assert found["planes"] == pytest.approx(np.ones(2), abs=0.1)


def test_a_layer_in_two_bins_has_its_peak_and_the_gap_behind_it():
    profile = density_profile(np.array([0.3, 0.3, 0.3, 0.45, 0.95, 1.1, 1.4, 1.4, 1.4, 1.4, 1.4]), area=2.0)
    assert profile[[2, 3, 7, 8, 11]].tolist() == [12.0, 4.0, 4.0, 4.0, 20.0] and profile.sum() == 44.0
    assert first_layer(profile) == (12.0, 0.0)  # the fuller layer at 1.4 is not the first one
    filled = profile + np.where(np.arange(24) < 12, 3.0, 0.0)
    assert first_layer(filled) == (15.0, 3.0)


@pytest.mark.parametrize("d, nearest, many", [(1, 2, 1000), (2, 4, 40), (3, 6, 12)])
def test_radial_distribution_of_a_lattice_and_of_points_at_random(d, nearest, many):
    size = np.full(d, float(many))
    found = radial_distribution(1.05 * lattice(size), np.zeros(d), 1.05 * size)
    shell = (2.0 * 0.125, np.pi * (1.125**2 - 1.0), 4.0 / 3.0 * np.pi * (1.125**3 - 1.0))[d - 1]
    assert found[8] == pytest.approx(nearest / shell * 1.05**d)  # all nearest neighbours between 1 and 1.125
    assert np.all(found[:8] == 0.0)
    size = np.full(d, 9.0)
    points = np.random.default_rng(2).uniform(0.0, size, (3000, d))
    assert radial_distribution(points, np.zeros(d), size)[4:] == pytest.approx(np.ones(12), abs=0.12)


def test_planes_of_a_square_lattice_are_ordered():
    planes = pool_layers(lattice(SIZE[3]), SIZE[3])["planes"]
    assert planes == pytest.approx(4.0 / (np.pi * (1.0 - 0.875**2)))  # all nearest neighbours at 1, the end of a bin


def test_a_box_without_a_middle_is_refused():
    with pytest.raises(ValueError, match="wider than 5 and higher than 6 spacings"):
        pool_layers(np.ones((3, 2)), (5.0, 9.0))
