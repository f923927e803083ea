"""A vessel of your own: water boils in the closed mesh of a file, or in a round flask if none is given.

The mesh (STL, PLY, OBJ) is the surface of the inside, in metres after ``--mesh-scale``. It is filled to ``--fill`` of
its volume, and heated below ``--heated-below``.

Equations   those of ``steady_boiling``; the container is the signed distance of the mesh, on a grid.
Source      none; this scene is not in the paper.
Run time    about 30 s on two cores (3-D, 4,909 particles, 1,440 steps for 2 s); less with ``--demo``. The first run
            also compiles.
Command     pysph-boiling run vessel --mesh flask.stl --fill .6 --heated-below .01
"""
from dataclasses import dataclass

from pysph_boiling.runs.described import DescribedParameters, DescribedScene
from pysph_boiling.runs.scene_file import Description, Fluid, HeatedPart, Sites, Vessel
from pysph_boiling.schemes.effects import param


@dataclass(frozen=True, kw_only=True)
class VesselParameters(DescribedParameters):
    """A closed vessel that is heated from below."""

    seed: int = param(1, "-", "seed of the start positions and of random sites", low=0)
    mesh: str = param(None, "-", "file of a closed mesh, the inside of the vessel; a round flask if not given")
    mesh_scale: float = param(1.0, "-", "metres per unit of length of the mesh, 0.001 for millimetres", above=0.0)
    radius: float = param(0.05, "m", "radius of the round flask, if no mesh is given", above=0.0)
    fill: float = param(0.6, "-", "share of the inner volume that water fills", above=0.0, high=1.0)
    heated_below: float = param(0.01, "m", "height over the lowest point inside, below which the wall is heated",
                                above=0.0)
    sites: int = param(12, "-", "preset nucleation sites on the heated wall", low=1)
    smallest_cavity: float = param(4e-6, "m", "smallest radius of the sites' cavities; 0 makes all sites alike, active "
                                   "at saturation", low=0.0, law="sigma T_sat c_l/(rho_v L^2)")
    largest_cavity: float = param(6e-6, "m", "largest radius of the sites' cavities; 0 for none", low=0.0,
                                  law="sigma T_sat c_l/(rho_v L^2)")
    subcooling: float = param(2.0, "K", "start and feed temperature below saturation", low=0.0, high=80.0, law="L/c_l")
    superheat: float = param(60.0, "K", "temperature of the heated wall above saturation", above=0.0, high=250.0,
                             may_change=True, sets="heater.temperature", law="L/c_l")


class VesselScene(DescribedScene):
    """The scene of this module."""

    Parameters = VesselParameters
    title = "vessel"
    variants = {"demo": dict(radius=0.035, sites=6, duration=1.5)}

    def described(self, p):
        T_sat = self.material.T_sat
        return Description(
            vessel=Vessel(mesh=p.mesh, scale=p.mesh_scale) if p.mesh else Vessel(sphere=p.radius),
            fluids=(Fluid(fill=p.fill, temperature=T_sat - p.subcooling),),
            heaters=(HeatedPart(below=p.heated_below, temperature=T_sat + p.superheat),),
            sites=Sites(number=p.sites, pattern="regular", smallest_cavity=p.smallest_cavity,
                        largest_cavity=p.largest_cavity))


if __name__ == "__main__":
    VesselScene().run()
