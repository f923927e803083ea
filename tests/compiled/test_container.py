"""Containers against a reference: who is outside is projected back and counted."""
import numpy as np
import pytest
from harness import vectors
from motion import CYLINDER, DEPTH, INSET, N_FLUID, ROUND_OFF, close, inside_box, room_of


def inside_cylinder(x, dim):
    x, c = x.copy(), np.array(CYLINDER["centre"])[:dim - 1]
    r = np.linalg.norm(x[:, :dim - 1] - c, axis=1)
    x[:, :dim - 1] = c + (x[:, :dim - 1] - c) * np.minimum(1.0, CYLINDER["radius"] / r)[:, None]
    x[:, dim - 1] = np.clip(x[:, dim - 1], CYLINDER["bottom"], CYLINDER["top"])
    return x


def inside_room(x, dim):
    """Newton's method, four steps, on the distance as :class:`Room` interpolates it."""
    room, x = room_of(dim), x.copy()
    for _ in range(4):
        slope = room.gradient(x)
        x += (np.maximum(INSET - room(x), 0.0) / np.maximum(np.sum(slope**2, axis=1), 0.25))[:, None] * slope
    return x


@pytest.mark.parametrize("container, inside", [
    ("box", inside_box), ("cylinder", inside_cylinder), ("room", inside_room)])
def test_container_projects_and_counts(kernels, container, inside):
    fluid = kernels.fluid
    x = vectors(fluid)
    projected = inside(x, kernels.dim)
    distance = np.linalg.norm(projected - x, axis=1)
    out, far = distance > ROUND_OFF, distance > DEPTH
    assert 5 < out.sum() < N_FLUID - 5 and 5 < far.sum() < out.sum() - 5
    kernels.run(container)
    close(vectors(fluid), projected)
    close(vectors(fluid, "sx", "sy", "sz"), projected - x)  # the velocity feels the wall
    np.testing.assert_array_equal(vectors(fluid)[~out], x[~out])
    np.testing.assert_array_equal(fluid.projected, far)
    np.testing.assert_array_equal(fluid.contacts, out & ~far)
