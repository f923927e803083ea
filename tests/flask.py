"""Vessels as meshes that tests make: an Erlenmeyer flask, and flasks with faults."""
import numpy as np
import trimesh

__all__ = ["FLASK", "PROFILE", "VOLUME", "flask", "volume", "write"]

PROFILE = np.array([  # radius and height [m] of the inside, whose walls touch the axis at both ends
    [0.0, 0.0], [0.045, 0.0], [0.0475, 0.004], [0.0475, 0.01], [0.018, 0.075], [0.018, 0.1], [0.0, 0.1]])
SECTIONS = 48


def flask(scale=1.0):
    """An Erlenmeyer flask of 0.33 litres, 10 cm high, as a closed mesh."""
    return trimesh.creation.revolve(scale * PROFILE, sections=SECTIONS)


def volume(level=np.inf):
    """The volume [m^3] of the flask below a height [m], as a solid of revolution."""
    z = np.append(np.linspace(0.0, min(level, 0.1), 400), PROFILE[1:-1, 1])
    z = np.sort(z[z <= level])
    r = np.interp(z, PROFILE[1:-1, 1], PROFILE[1:-1, 0])
    r0, r1, z0, z1 = r[:-1], r[1:], z[:-1], z[1:]
    return float(np.sum(np.pi / 3.0 * (r0**2 + r0 * r1 + r1**2) * (z1 - z0)))


FLASK, VOLUME = flask(), volume()


def write(mesh, path):
    """Write a mesh to a file; returns its path as text."""
    mesh.export(path)
    return str(path)
