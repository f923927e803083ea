"""The sets of effects that compiled tests may use: at most sixteen, since each costs up to five modules to compile.

A test takes a set and changes sizes, dimension and parameters, which are run-time values and compile nothing. A test
that needs another set adds it here, or does without.
"""
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.rooms import Room, ball
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    AmbientLoss,
    ArtificialPressure,
    BoxContainer,
    BubbleLabels,
    Buoyancy,
    Cohesion,
    Condensation,
    Convection,
    CylinderContainer,
    DistanceContainer,
    Drag,
    Expansion,
    HeatConduction,
    Heater,
    HeatSource,
    LatentPooling,
    PhaseChange,
    PresetNucleation,
    Refill,
    SiteAdhesion,
    Venting,
    WallMultipliers,
    XSPHViscosity,
)

BOIL = dict(
    container=BoxContainer(), viscosity=XSPHViscosity(), artificial_pressure=ArtificialPressure(),
    heat=HeatConduction(), heater=Heater(temperature=433.15), phases=PhaseChange(),
    preset_nucleation=PresetNucleation(), bubbles=BubbleLabels(), condensation=Condensation(), pooling=LatentPooling(),
    buoyancy=Buoyancy(), cohesion=Cohesion(), adhesion=SiteAdhesion(), drag=Drag(), venting=Venting(),
)  # what examples/steady_boiling.py uses, so that both share their compiled modules

WARM = dict(container=BoxContainer(), viscosity=XSPHViscosity(wall=1.0), heat=HeatConduction(),
            heater=Heater(temperature=353.15), convection=Convection())

SETS = {
    "motion": dict(container=BoxContainer(), viscosity=XSPHViscosity(wall=1.0)),  # and examples/dam_break.py
    "pressed": dict(container=BoxContainer(), viscosity=XSPHViscosity(), artificial_pressure=ArtificialPressure(),
                    wall_multipliers=WallMultipliers()),
    "cylinder": dict(container=CylinderContainer()),
    "room": dict(container=DistanceContainer(room=Room.of(ball((0.5, 0.5), 0.62, dim=2), spacing=0.1))),
    "slab": dict(density=None, heat=HeatConduction(), heater=Heater(temperature=353.15)),  # examples/heated_slab.py
    "exchange": dict(density=None, heat=HeatConduction(laplacian="paper"), heater=Heater(flux=1e4),
                     loss=AmbientLoss(), source=HeatSource(density=1e6)),
    "boil": BOIL,
    "open": {**BOIL, "venting": Venting(mode="remove"), "refill": Refill()},
    "states": dict(density=None, heat=HeatConduction(), phases=PhaseChange(interrupt="convert"),
                   preset_nucleation=PresetNucleation(attraction=0.0)),
    "states_hold": dict(density=None, heat=HeatConduction(), phases=PhaseChange(), preset_nucleation=PresetNucleation(
        attraction=0.0)),
    "paper": {**{slot: effect for slot, effect in BOIL.items() if slot != "pooling"},
              "phases": PhaseChange(interrupt="convert", vapour_as_site=False), "buoyancy": Buoyancy(form="paper"),
              "heat": HeatConduction(laplacian="paper"), "heater": Heater(flux=4e4), "venting": Venting(mode="remove")},
    "boussinesq": WARM,
    "gradient": {**WARM, "convection": Convection(form="gradient")},
    "expand": {**BOIL, "expansion": Expansion()},
    "ihmsen": {**BOIL, "buoyancy": Buoyancy(form="ihmsen"), "loss": AmbientLoss()},
}
assert len(SETS) <= 16


def scheme(name, *, dim, spacing, changes=None, **kwargs):
    """The scheme of a set; ``changes`` maps a slot to another effect of the same class (a new class compiles anew)."""
    effects = dict(SETS[name])
    for slot, effect in (changes or {}).items():
        assert slot in effects and type(effect) is type(effects[slot]), f"'{slot}' is not part of the set '{name}'"
        effects[slot] = effect
    sites = ["sites"] if "preset_nucleation" in effects else []
    return BoilingScheme(["fluid"], ["wall"], dim=dim, spacing=spacing, material=WATER_1ATM, sites=sites, **effects,
                         **kwargs)
