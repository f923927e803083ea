"""Example scenes as problems: their schemes and particles, stepped by hand and without files."""
import math

from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.runs.stepper import Stepper

__all__ = ["from_scene"]


def from_scene(scene_class, *, periodic=False, ledger=False, effects=None, **parameters):
    """A scene that is ready to step: (scene, stepper).

    ``parameters`` are those of the scene. ``periodic`` uses its periodic domain, and ``ledger`` adds ``scene.ledger``,
    which balances mass and energy at every step. ``effects`` (slot -> effect or ``None``) replace those of the scene.
    """
    scene = scene_class()
    p = scene.parameters = scene_class.Parameters(**parameters)
    scheme = scene.scheme = scene.make_scheme(p)
    scheme.set_effects(**(effects or {}))
    arrays = scene.make_particles(p, scheme)
    scheme.setup_properties(arrays)
    scene.start({pa.name: pa for pa in arrays}, p, scheme)
    dt = p.frame / (p.substeps or math.ceil(p.frame / scheme.time_step()))
    stepper = Stepper(scheme, arrays, dt=dt, domain=scene.create_domain() if periodic else None)
    scene.solver, scene.tools = stepper.solver, stepper.tools
    if ledger:
        scene.ledger = Ledger(scheme)
        scene.ledger.begin(scheme.arrays)
        stepper.tools.append(scene.ledger)
    return scene, stepper
