"""Every effect at once, and schemes that are ready to compile, which tests of the whole step share."""
import sets
from pysph.sph.acceleration_eval import make_acceleration_evals
from pysph.sph.sph_compiler import SPHCompiler

from pysph_boiling.particles import box_vessel, fluid_block, site_array
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    EFFECTS,
    AmbientLoss,
    Convection,
    DynamicNucleation,
    Expansion,
    HeatSource,
    LatentPooling,
    Oscillation,
    Refill,
    WallMultipliers,
    XSPHViscosity,
)
from pysph_boiling.schemes.solver import strip_unused_declarations

__all__ = ["CLASSES", "DX", "FULL", "make", "sources", "subgroups"]

DX = 0.01
FULL = {**sets.BOIL, "viscosity": XSPHViscosity(wall=1.0), "loss": AmbientLoss(), "source": HeatSource(density=1e6),
        "dynamic_nucleation": DynamicNucleation(superheat_limit=50.0), "pooling": LatentPooling(),
        "convection": Convection(form="gradient"), "expansion": Expansion(), "oscillation": Oscillation(),
        "refill": Refill(), "wall_multipliers": WallMultipliers()}
# all but storage in sites, whose liquid stores no latent heat of its own
CLASSES = [cls for slot in BoilingScheme.slots for cls in EFFECTS[slot]]


def make(cls=BoilingScheme, effects=None, dt=1e-3, wide=False, **kwargs):
    """A scheme, its arrays and its equations, ready to compile; ``wide`` lets sites reach further."""
    if cls is BoilingScheme:
        kwargs.setdefault("sites", ["sites"] if "preset_nucleation" in (effects or {}) else [])
    scheme = cls(["fluid"], ["wall"], dim=2, spacing=DX, **(effects or {}), **kwargs)
    common = dict(spacing=DX, dim=2, rho0=scheme.rho0)
    corners = (0.0, 0.0, 0.0), (6 * DX, 6 * DX, 0.0)
    arrays = [fluid_block(*corners, **common),
              box_vessel(*corners, kernel=scheme.kernel, heated_fraction=0.5, **common)]
    if scheme.sites:
        arrays.append(site_array([(3 * DX, 0.0, 0.0)], reach=(6.0 if wide else 2.4) * DX, spacing=DX))
    scheme.setup_properties(arrays)
    scheme.configure_solver(dt=dt)
    return scheme, arrays, scheme.get_equations()


def sources(scheme, arrays, equations):
    """The generated source of every stage as it is compiled, without compiling it."""
    compiler = SPHCompiler(make_acceleration_evals(arrays, equations, scheme.kernel), scheme.solver.integrator)
    generated = [compiler._get_code(), *(helper.get_code() for helper in compiler.acceleration_eval_helpers[1:])]
    return [strip_unused_declarations(source) for source in generated]


def subgroups(equations):
    """(parent, sub-group) of all stages."""
    return [(parent, group) for stage in equations.groups for parent in stage for group in parent.equations]
