"""Drops: pieces of liquid by hand."""
import numpy as np
import pytest
from standin import cloud

from pysph_boiling.analysis.drops import drops, pieces
from pysph_boiling.phases import Phase

DX = 0.01


def block(*shape, low=(0, 0, 0)):
    return DX * (np.stack(np.meshgrid(*map(np.arange, shape), indexing="ij"), -1).reshape(-1, 3) + low)


def test_pieces_by_hand():
    points = DX * np.array([[0, 0, 0], [1.4, 0, 0], [5, 0, 0], [2.8, 0, 0], [5, 1.6, 0]], dtype=float)
    piece, sizes = pieces(points, 1.5 * DX)
    assert piece.tolist() == [0, 0, 1, 0, 2] and sizes.tolist() == [3, 1, 1]
    assert pieces(points, 3.0 * DX)[1].tolist() == [5]
    assert pieces(points[:1], DX)[1].tolist() == [1]


def test_drops_are_what_left_the_pool():
    pool = block(6, 6, 4)
    drop, single, steam = block(2, 1, 1, low=(2, 2, 7)), block(1, 1, 1, low=(5, 0, 9)), block(2, 2, 1, low=(0, 0, 8))
    points = np.concatenate([drop, pool, single, steam])
    phase = np.where(np.arange(len(points)) >= len(points) - len(steam), Phase.VAPOUR, Phase.LIQUID)
    phase[len(drop)] = Phase.VAPOUR  # a bubble in the pool
    sizes, places = drops(cloud(points, phase=phase), DX)
    assert sizes.tolist() == [2, 1]  # neither the pool nor steam
    assert places == pytest.approx(DX * np.array([[2.5, 2, 7], [5, 0, 9]]))
    assert drops(cloud(pool, phase=0), DX)[0].tolist() == []
    assert drops(cloud(np.empty((0, 3)), phase=0), DX)[1].shape == (0, 3)
