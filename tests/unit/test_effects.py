"""Effects: a scene has what it calls for and nothing else, and what cannot be is refused.

Nothing is compiled: generated sources are compared as text.
"""
import dataclasses
import math
import warnings

import pytest
import sets
from full import CLASSES, DX, FULL, make, sources, subgroups

from pysph_boiling.particles import BASE_PROPERTIES, PYSPH_PROPERTIES
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    EFFECTS,
    BoxContainer,
    Drag,
    HeatConduction,
    Heater,
    MechanicalLedger,
    PhaseChange,
    SiteStorage,
    XSPHViscosity,
)
from pysph_boiling.schemes.pbf import PBFScheme

# What each effect of FULL adds, and nobody else: kernels, properties, constants, columns of the results.
OWNS = {
    "density": (
        "PBFStepBack PBFDensity PBFBoundaryDensity PBFLeftOver PBFLambda PBFPositionCorrection PBFBoundaryCorrection "
        "PBFMove PBFBodyForce PBFWarmStart PBFBoundaryWarmStart",
        "au av aw sx sy sz lmbda impulse lmbda_last lmbda_start compression left_over gcx gcy gcz gc2 dpx dpy dpz "
        "limited",
        "density_error sweeps first_sweeps unconverged settled substeps prior warm_start",
        "sweeps density_error_mean density_error_max n_unconverged substeps n_split n_limited"),
    "wall_multipliers": ("PBFWallMultiplier PBFWallCorrection PBFWallStart PBFWallWarmStart", "", "", ""),
    "artificial_pressure": ("PBFArtificialPressure", "", "", ""),
    "container": ("PBFBoxContainer", "contacts projected", "", "n_contacts n_projected"),
    "viscosity": ("PBFXSPHViscosity PBFWallFriction", "", "", ""),
    "heat": ("HeatConductionClearyMonaghan HeatUpdate", "e T k ae", "heat_dt",
             "T_mean T_max energy energy_in energy_out energy_model_leak energy_residual heat_subcycles"),
    "heater": ("HeatFixedTemperature", "q_heater", "heater_on heater_T", "energy_heater"),
    "loss": ("HeatAmbientLoss HeatAmbientWall", "gsx gsy gsz q_loss", "", "energy_loss"),
    "source": ("HeatUniformSource", "q_source", "", "energy_source"),
    "phases": (
        "PhaseTemperature PhaseTemperatureAfter PhaseKineticReset PhaseVapourCondition PhaseEdges",
        "phase kinetic vapour_distance vaporised interrupted e_lat", "",
        "n_liquid n_transition n_superheated n_vapour n_held energy_liquid energy_transition energy_superheated "
        "energy_vapour energy_held n_nucleated n_interrupted energy_hidden"),
    "preset_nucleation": ("NucleationSiteCondition NucleationSiteAttraction", "departed", "", ""),
    "dynamic_nucleation": (
        "NucleationHeld NucleationRegion NucleationClaim NucleationFire NucleationChoice NucleationShare "
        "NucleationRelease",
        "held region_heat fire_key pick_key claim fires cut e_chosen e_others member fired burst", "steps",
        "n_burst n_fired"),
    "bubbles": ("BubbleStart BubbleSnap BubbleHook BubbleShortcut BubbleCheck BubbleLabel",
                "parent grandparent unsettled bubble bubble_n", "bubble_rounds",
                "n_bubbles bubble_radius_mean n_single_bubbles"),
    "condensation": ("BubbleCondensation", "condensing deficit condensed", "steps relabel", "n_condensed"),
    "pooling": ("PoolingInterface PoolingJoin PoolingShare", "joined pooled", "relabel", ""),
    "buoyancy": ("BubbleBuoyancy", "", "", ""),
    "cohesion": ("BubbleCohesion BubbleCohesionMove BubbleCohesionStart",
                 "pull_x pull_y pull_z pulled_x pulled_y pulled_z pull_start_x pull_start_y pull_start_z", "", ""),
    "adhesion": ("BubbleSiteAdhesion", "", "", ""),
    "drag": ("BubbleDrag", "", "", ""),
    "convection": ("ConvectionGradient", "gTx gTy gTz", "", ""),
    "expansion": ("BubbleSwell BubbleSwellBack", "swell swelling", "", "rest_volume"),
    "oscillation": ("BubbleOscillation", "bcx bcy bcz bdx bdy bdz push_multiplier",
                    "pushes oscillation_dt n_pushed work_oscillation",
                    "n_pushed work_oscillation bubble_distance_mean"),
    "venting": ("VentingFilm VentingFree VentingRelease", "film covered free",
                "energy_vented mass_vented n_vented n_bubbles_vented", "energy_lid n_vented n_bubbles_vented"),
    "refill": ("", "", "mass_refilled energy_refilled n_refilled refill_due refill_uid steps",
               "energy_refill n_refilled"),
}
LEDGER = {"t", "dt", "mass", "mass_in", "mass_out", "mass_residual"}  # columns of every run


def without(slot):
    """FULL without an effect and those that need it; the density constraint is there unless it is ``None``."""
    absent = {slot}
    while True:
        more = {name for name, effect in FULL.items() if absent & set(effect.requires)} - absent
        if not more:
            break
        absent |= more
    effects = {name: effect for name, effect in FULL.items() if name not in absent}
    return effects if slot != "density" else {**effects, "density": None}


# --- what a scene has -------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("slot", [*BoilingScheme.slots, "nothing"])
def test_absent_effect_adds_nothing(slot):
    """Kernels, properties, constants, columns and groups are exactly those of the effects that are present."""
    scheme, arrays, equations = make(effects=without(slot), lean=False)
    assert slot not in scheme.effects
    kernels, properties, constants, columns = (
        {name for present in scheme.effects for name in OWNS[present][kind].split()} for kind in range(4))
    if "heat" in scheme.effects and "phases" not in scheme.effects:
        kernels |= {"HeatTemperature", "HeatTemperatureAfter"}
    if "density" not in scheme.effects:
        kernels -= {"NucleationSiteAttraction"}
    if "bubbles" not in scheme.effects:
        properties -= {"departed"}
    if "expansion" in scheme.effects:
        kernels |= {"PBFDensitySwollen", "PBFPositionCorrectionSwollen", "PBFWarmStartSwollen"}
        kernels -= {"PBFDensity", "PBFPositionCorrection", "PBFWarmStart"}
    terms = scheme.terms()
    assert {type(term.equation).__name__ for term in terms} == kernels
    assert {term.owner for term in terms} == {slot for slot in scheme.effects if OWNS[slot][0]}
    assert set(arrays[0].properties) == properties | {row.name for row in BASE_PROPERTIES} | set(PYSPH_PROPERTIES)
    assert set(arrays[0].constants) == constants
    assert {column.name for column in Ledger(scheme).columns} == columns | LEDGER
    assert {group.name for _, group in subgroups(equations)} == {term.place.replace(".", "_") for term in terms}
    built = {type(e).__name__ for _, group in subgroups(equations) for e in group.equations}
    assert built == kernels


def test_stages_that_an_effect_leaves_as_they_are_keep_their_modules():
    """PySPH alone would compile every stage anew, since each module declares what any effect brings along."""
    full, less = (sources(*make(effects=effects)) for effects in (FULL, without("dynamic_nucleation")))
    assert len(full) == len(less) + 1
    assert set(less) <= set(full)


def test_storage_in_sites_adds_what_it_owns():
    """It cannot be in FULL, since its liquid stores no latent heat of its own."""
    kernels, properties, constants, columns = (set(part.split()) for part in (
        "StorageNearest StorageOccupied StorageChoice StorageAbsorption StorageEmission StorageVapour",
        "site site_r2 paid q_sites emitted", "", "n_emitted energy_sites"))
    effects = {**sets.BOIL, "phases": PhaseChange(kinetic="never", vapour_as_site=False)}
    before, after = make(effects=effects, wide=True), make(effects={**effects, "storage": SiteStorage()}, wide=True)
    for what, own in ((lambda m: {type(term.equation).__name__ for term in m[0].terms()}, kernels),
                      (lambda m: set(m[1][0].properties), properties), (lambda m: set(m[1][0].constants), constants),
                      (lambda m: {column.name for column in Ledger(m[0]).columns}, columns)):
        assert what(after) - what(before) == own and what(before) <= what(after)


@pytest.mark.parametrize("effects", [sets.BOIL, sets.SETS["expand"]], ids=["boil", "expand"])
def test_mechanical_ledger_adds_what_it_owns(effects):
    """It cannot be in FULL, since it sets the forces of each effect apart."""
    before = make(effects=effects, lean=False)
    after = make(effects={**effects, "mechanics": MechanicalLedger()})
    swells = "expansion" in effects
    owners = {"density", "viscosity", "artificial_pressure", "preset_nucleation", "buoyancy", "cohesion", "adhesion",
              "drag", "venting"}
    parts = owners | {"gravity", "vented", "container"} | ({"expansion"} if swells else set())
    for what, own in (
        (lambda m: {type(term.equation).__name__ for term in m[0].terms()}, {"PBFPressure"} if swells else set()),
        (lambda m: set(m[1][0].properties), {f"a{axis}_by_{owner}" for owner in owners for axis in "uvw"} | (
            {"swell_before", "pressure"} if swells else set())),
        (lambda m: set(m[1][0].constants), {f"work_{part}" for part in parts} | {"work_moved", "kinetic_start"}),
        (lambda m: {column.name for column in Ledger(m[0]).columns},
         {f"work_{part}" for part in parts} | {"kinetic_energy", "work_residual"}),
    ):
        assert what(after) - what(before) == own and what(before) <= what(after)
    names = [[group.name for _, group in subgroups(made[2])] for made in (before, after)]
    assert set(names[0]) - set(names[1]) == {"forces_sum", "forces_release", "density_contact", "density_pull",
                                             "density_move"}
    assert set(names[1]) - set(names[0]) == {f"forces_sum_{owner}" for owner in owners - {"venting"}} | {
        "forces_release_venting", "density_contact_container", "density_pull_cohesion", "density_move_density",
        "density_move_container"} | (
            {"forces_pressure"} if swells else set())


def test_every_slot_is_tested():
    assert set(OWNS) == set(BoilingScheme.slots) - {"storage", "mechanics"} == {"density", *FULL}


def test_boiling_scheme_without_effects_is_the_pbf_scheme():
    effects = sets.SETS["motion"]
    pbf, boiling = make(PBFScheme, effects, rho0=958.0), make(BoilingScheme, effects)
    assert [(t.place, t.owner, type(t.equation)) for t in pbf[0].terms()] == \
           [(t.place, t.owner, type(t.equation)) for t in boiling[0].terms()]
    assert set(pbf[1][0].properties) == set(boiling[1][0].properties)
    assert sources(*pbf) == sources(*boiling)


@pytest.mark.parametrize("name", sets.SETS)
def test_source_is_the_same_when_built_again(name):
    """The source is the key of PySPH's cache: nothing in it may depend on what was built before."""
    assert sources(*make(effects=sets.SETS[name])) == sources(*make(effects=sets.SETS[name]))


def test_describe_names_stages_groups_and_owners():
    scheme, _, _ = make(effects=FULL, lean=False)
    lines = scheme.describe().splitlines()
    for term in scheme.terms():
        stage, group = term.place.split(".")
        assert any(line.startswith(f"stage {stage} (") for line in lines)
        assert any(line.strip("*- ").startswith(f"{group}: ") for line in lines)
        assert any(type(term.equation).__name__ in line and line.endswith(f"for {term.owner}") for line in lines)
    starred = {line.split()[1].rstrip(":") for line in lines if line.startswith("  * ")}
    assert starred == {"multiplier", "walls", "correction", "pull", "move", "snap", "hook", "shortcut", "check"}
    assert "stage bubbles" not in make(effects=sets.SETS["motion"])[0].describe()


# --- what is refused --------------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("slot", "needed"), [(cls.slot, needed) for cls in CLASSES for needed in cls.requires])
def test_missing_effect_is_named(slot, needed):
    scheme = BoilingScheme(["fluid"], ["wall"], dim=2, spacing=DX, **without(needed),
                           **{slot: FULL[slot] if slot in FULL else EFFECTS[slot][0]()})
    with pytest.raises(ValueError, match=f"'{slot}'.* needs the effect '{needed}': pass {needed}="):
        scheme.terms()


@pytest.mark.parametrize(("build", "message"), [
    (lambda: make(effects=dict(drags=Drag())), "no effect in BoilingScheme: 'drags'; did you mean 'drag'"),
    (lambda: make(PBFScheme, dict(heat=HeatConduction())),
     "no effect in PBFScheme: 'heat'; there are: density, container"),
    (lambda: make(effects=dict(heat=Drag())), "effect 'heat' must be HeatConduction or None, got Drag"),
    (lambda: make(effects=dict(container=Drag())), "or CylinderContainer or DistanceContainer or None"),
    (lambda: Drag().replaced(speed=1.0), "drag between phases has no parameter speed"),
    (lambda: Heater(temperature=400.0, flux=1e4), r"exactly one of temperature \[K\] and flux \[W/m\^2\]"),
    (lambda: Heater(), r"exactly one of temperature \[K\] and flux \[W/m\^2\]"),
    (lambda: BoxContainer(lower=(0.0, 0.0)), "must each be three lengths"),
])
def test_refused(build, message):
    with pytest.raises(ValueError, match=message):
        build()


BOUNDED = [(cls, spec, bound) for cls in CLASSES for spec in dataclasses.fields(cls)
           for bound in ("low", "high", "above") if spec.metadata.get(bound) is not None]


@pytest.mark.parametrize(("cls", "spec", "bound"), BOUNDED, ids=[f"{c.slot}.{s.name}-{b}" for c, s, b in BOUNDED])
def test_value_beyond_its_bound_is_refused(cls, spec, bound):
    limit = spec.metadata[bound]
    beyond = limit if bound == "above" else limit + (1 if bound == "high" else -1)
    unit = "" if spec.metadata["unit"] == "-" else f" {spec.metadata['unit']}"
    for value, what in ((beyond, ">" if bound == "above" else ">=" if bound == "low" else "<="), (math.nan, "finite")):
        with pytest.raises(ValueError) as error:
            cls(**{spec.name: value})
        assert str(error.value).startswith(f"{cls.slot}.{spec.name} must be {what}")
        assert str(error.value).endswith(f"{unit}, got {float(value)}{unit}" if what != "finite" else f"got nan{unit}")


# --- warnings ---------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("effects", "kwargs", "message"), [
    (sets.BOIL, dict(gravity=(0.0, 0.0, 0.0)), "buoyancy has no effect without gravity"),
])
def test_warnings(effects, kwargs, message):
    with pytest.warns(UserWarning, match=message):
        make(effects=effects, **kwargs)


@pytest.mark.parametrize(("effects", "parts"), [
    (dict(viscosity=XSPHViscosity(rate=800.0)), 1),
    (dict(viscosity=XSPHViscosity(rate=1800.0)), 2),
    (dict(viscosity=XSPHViscosity(rate=600.0, wall=3.0)), 2),
    ({**sets.BOIL, "drag": Drag(rate=1e4), "viscosity": XSPHViscosity(rate=1e4)}, 23),
])
def test_a_step_is_split_where_viscosity_and_drag_would_overshoot(effects, parts):
    """At steps of 1 ms; below .9 of a velocity difference in each part."""
    scheme, arrays, _ = make(effects=effects)
    for pa in arrays:
        pa.set_device_helper(None)
    assert scheme.effects["density"].limits(scheme.scene(), 1e-3).substeps(arrays[:1], 1e-3) == parts


@pytest.mark.parametrize("name", sets.SETS)
def test_no_warning_at_the_suggested_time_step(name):
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        make(effects=sets.SETS[name], dt=None)
