"""Sets of effects that several scenes share."""
from pysph_boiling.schemes.effects import (
    ArtificialPressure,
    BubbleLabels,
    Buoyancy,
    Cohesion,
    Condensation,
    DensityConstraint,
    Drag,
    HeatConduction,
    LatentPooling,
    PhaseChange,
    PresetNucleation,
    SiteAdhesion,
    Venting,
    WallMultipliers,
    XSPHViscosity,
)

__all__ = ["ADHESION", "K_BUBBLE", "boiling_effects"]

# Adhesion of sites with cavities of their own, in units of gravity. It is less than the cohesion of 5 g, so that a
# bubble leaves whole, while it is small, and the departures of a site depend on its neighbours.
ADHESION = {2: 4.0, 3: 3.0}
# Of their buoyancy. With 1.5, the default, bubbles in 3-D are twice as large; with 2.5 the median one of the demo of
# steady_boiling has seven particles at departure instead of ten.
K_BUBBLE = {2: None, 3: 2.0}


def boiling_effects(*, time_scaling, own_cavities, embryo, seed, adhesion, k_bubble, T_feed, lid=True):
    """The effects of a boil at preset sites as a dict slot -> effect, without container and heater.

    ``time_scaling`` is A, the factor by which heat is faster. With ``own_cavities`` sites wake at a superheat of their
    own, and their embryo is at least ``embryo`` radii of the cavity, drawn from ``seed``; ``adhesion`` and ``k_bubble``
    are then those of their bubbles. ``T_feed`` [K] is the temperature at which a ``lid`` returns vapour as liquid;
    without one it leaves.
    """
    return dict(
        density=DensityConstraint(max_sweeps=4, tolerance=5e-3),
        viscosity=XSPHViscosity(),
        wall_multipliers=WallMultipliers(),
        artificial_pressure=ArtificialPressure(),
        heat=HeatConduction(time_scaling=time_scaling),
        phases=PhaseChange(),
        preset_nucleation=PresetNucleation(activation=own_cavities, embryo=embryo, seed=seed),
        bubbles=BubbleLabels(),
        condensation=Condensation(),
        pooling=LatentPooling(),
        buoyancy=Buoyancy(k_bubble=k_bubble if own_cavities else None),
        cohesion=Cohesion(),
        adhesion=SiteAdhesion(strength=adhesion if own_cavities else None),
        drag=Drag(),
        venting=Venting(mode="lid" if lid else "remove", T_feed=T_feed))
