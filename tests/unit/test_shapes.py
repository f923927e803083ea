"""Free bubbles of lattices from which layers are cut out, whose voids are known. Lengths are in spacings."""
import numpy as np
import pytest
from standin import cloud

from pysph_boiling.analysis.shapes import free_bubbles
from pysph_boiling.particles import NO_BUBBLE
from pysph_boiling.phases import Phase

SIDE, EDGE = 16, 4  # of the pool, of the bubble
LOW = 6  # of the bubble


def pool(dim, *, without=(), vapour=None):
    """A pool of SIDE^dim particles, nudged by 1e-6, without the rows of places ``without``; walls below it.

    ``vapour`` maps a mask to a label; by default a block of EDGE^dim.
    """
    grid = np.indices((SIDE,) * dim).reshape(dim, -1).T
    block = np.all((grid >= LOW) & (grid < LOW + EDGE), axis=1)
    vapour = {7: block} if vapour is None else vapour
    label = np.full(len(grid), NO_BUBBLE)
    for number, inside in vapour.items():
        label[inside] = number
    keep = ~np.any([np.all(grid == place, axis=1) for place in without], axis=0) if len(without) else np.full(
        len(grid), True)
    points = np.zeros((len(grid), 3))
    points[:, :dim] = grid + np.random.default_rng(1).uniform(-1e-6, 1e-6, grid.shape)
    fluid = cloud(points[keep], m=1.0, bubble=label[keep],
                  phase=np.where(label[keep] == NO_BUBBLE, Phase.LIQUID, Phase.VAPOUR))
    floor = np.unique(grid[:, :-1], axis=0)
    wall = np.zeros((len(floor), 3))
    wall[:, :dim - 1], wall[:, dim - 1] = floor, -1.0
    return fluid, [cloud(wall)]


def free(dim, floor=2.4, **changes):
    fluid, walls = pool(dim, **changes)
    return free_bubbles(fluid, walls, dim=dim, spacing=1.0, floor=floor)


def block(dim, lower, upper):
    grid = np.indices((SIDE,) * dim).reshape(dim, -1).T
    return np.all((grid >= lower) & (grid < upper), axis=1)


@pytest.mark.parametrize("dim", [2, 3])
def test_a_block_in_a_lattice_is_whole_and_has_no_void(dim):
    (bubble,) = free(dim)
    assert bubble.shape.n == EDGE**dim and bubble.whole == 1.0
    assert bubble.shape.aspect == pytest.approx(1.0, abs=1e-5)
    assert bubble.void == pytest.approx(0.0, abs=1e-4)


@pytest.mark.parametrize(("dim", "void"), [(2, 2.0 * np.sqrt(25 / 18 - 1 / 4) - 1.0),
                                           (3, 2.0 * np.sqrt(27 / 16 - 1 / 2) - 1.0)])
def test_a_layer_cut_out_round_a_bubble_is_a_void(dim, void):
    """A gap of one spacing, and more at the corners: the ball through the corner (0, 0) of the vapour and (1, 2), (2,
    1) of the liquid has a squared radius of 25/18, in 3-D that through (1, 1, 2) and its like 27/16."""
    grid = np.indices((SIDE,) * dim).reshape(dim, -1).T
    ring = grid[block(dim, LOW - 1, LOW + EDGE + 1) & ~block(dim, LOW, LOW + EDGE)]
    (bubble,) = free(dim, without=ring)
    assert bubble.void == pytest.approx(void, abs=1e-4) and bubble.whole == 1.0


@pytest.mark.parametrize("dim", [2, 3])
def test_a_vacancy_beside_a_bubble_and_not_one_far_from_it(dim):
    beside, far = (LOW - 1, *[LOW + 1] * (dim - 1)), (1, *[LOW + 1] * (dim - 1))
    (bubble,) = free(dim, without=[beside])
    assert bubble.void == pytest.approx(2.0 * np.sqrt(1.0 - (dim - 1) / 4.0) - 1.0, abs=1e-4)
    (bubble,) = free(dim, without=[far])
    assert bubble.void == pytest.approx(0.0, abs=1e-4)


def test_pieces_close_together_are_one_bubble():
    """Two blocks with other labels side by side, and one far away; a block twice as wide as high."""
    large, small = block(2, [2, 6], [10, 10]), block(2, [10, 6], [12, 10])
    away = block(2, [14, 6], [16, 10])
    one, other = free(2, vapour={5: large, 9: small, 11: away})
    assert (one.shape.n, one.whole) == (32, 0.8)
    assert one.shape.aspect == pytest.approx(np.sqrt(63.0 / 15.0), rel=1e-3)  # variance of n points in a row: n^2 - 1
    assert (other.shape.n, other.whole) == (8, 1.0)


def test_bubbles_at_the_base_or_the_surface_and_splashes_are_left_out():
    assert free(2, floor=LOW - 0.5) and not free(2, floor=LOW + 0.5)
    assert len(free(2, vapour={5: block(2, 6, [10, SIDE - 3])})) == 1
    assert not free(2, vapour={5: block(2, 6, [10, SIDE - 2])})
    assert not free(2, vapour={5: block(2, 6, [9, 7])}) and not free(2, vapour={})
