"""Effects, from which scenes are composed. Each is one frozen dataclass, and adding one changes nothing else.

An effect defines its parameters (with unit, bounds and meaning), the effects it requires, and the properties,
constants, energy flows and result columns that it adds, and it yields its equations as :class:`Term`. A scene without
an effect has none of these. A class registers itself by its ``slot``; several classes may share a slot, such as the
containers. The order of the imports below is the order of the slots, in which terms are sorted within a group and
tools act after a step. Effects of other packages (``example_plugin/``) come last.
"""
# ruff: noqa: I001 - the order of these imports is the order of the slots
from pysph_boiling.schemes.effects.base import (
    EFFECTS, Column, Effect, Flow, Rule, SchemeContext, Snapshot, check_parameters, check_temperatures, cumulative,
    joined, param, sum_over, totals,
)
from pysph_boiling.schemes.effects.motion import (
    BoxContainer, CylinderContainer, DensityConstraint, DistanceContainer, XSPHViscosity,
)
from pysph_boiling.schemes.effects.wall_multipliers import WallMultipliers
from pysph_boiling.schemes.effects.artificial_pressure import ArtificialPressure
from pysph_boiling.schemes.effects.heat import AmbientLoss, HeatConduction, Heater, HeatSource, heat_step_limit
from pysph_boiling.schemes.effects.phases import PhaseChange
from pysph_boiling.schemes.effects.preset_nucleation import PresetNucleation
from pysph_boiling.schemes.effects.site_storage import SiteStorage
from pysph_boiling.schemes.effects.dynamic_nucleation import DynamicNucleation
from pysph_boiling.schemes.effects.bubbles import BubbleLabels, Buoyancy, Cohesion, Drag, SiteAdhesion
from pysph_boiling.schemes.effects.condensation import Condensation
from pysph_boiling.schemes.effects.pooling import LatentPooling
from pysph_boiling.schemes.effects.convection import Convection
from pysph_boiling.schemes.effects.expansion import Expansion
from pysph_boiling.schemes.effects.oscillation import Oscillation
from pysph_boiling.schemes.effects.venting import Venting
from pysph_boiling.schemes.effects.refill import Refill
from pysph_boiling.schemes.effects.mechanics import MechanicalLedger
from pysph_boiling.schemes.effects.installed import load_installed

__all__ = [
    "AmbientLoss", "ArtificialPressure", "BoxContainer", "BubbleLabels", "Buoyancy", "Cohesion", "Column",
    "Condensation", "Convection", "CylinderContainer", "DensityConstraint", "DistanceContainer", "Drag",
    "DynamicNucleation", "EFFECTS", "Effect", "Expansion", "Flow", "HeatConduction", "HeatSource", "Heater",
    "LatentPooling", "MechanicalLedger", "Oscillation", "PhaseChange", "PresetNucleation", "Refill", "Rule",
    "SchemeContext", "SiteAdhesion", "SiteStorage", "Snapshot", "Venting", "WallMultipliers", "XSPHViscosity",
    "check_parameters", "check_temperatures", "cumulative", "heat_step_limit", "joined", "param", "sum_over",
    "totals",
]

load_installed()
