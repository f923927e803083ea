"""Effects: a scene has what it calls for and nothing else, its options arrive, its groups suit every backend.

Nothing is compiled: generated sources are compared as text.
"""
import argparse
import dataclasses
import math
import warnings
from unittest.mock import Mock

import numpy as np
import pytest
import sets
from pysph.base.nnps import DomainManager, LinkedListNNPS
from pysph.sph.acceleration_eval import make_acceleration_evals
from pysph.sph.sph_compiler import SPHCompiler

from pysph_boiling.examples.dam_break import DamBreak
from pysph_boiling.names import option
from pysph_boiling.parallel.ghosts import GhostRefresh, Ghosts
from pysph_boiling.particles import BASE_PROPERTIES, PYSPH_PROPERTIES, box_vessel, fluid_block, site_array
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    EFFECTS,
    AmbientLoss,
    BoxContainer,
    Convection,
    CylinderContainer,
    Drag,
    DynamicNucleation,
    Expansion,
    HeatConduction,
    Heater,
    HeatSource,
    LatentPooling,
    MechanicalLedger,
    Oscillation,
    PhaseChange,
    Refill,
    SiteStorage,
    XSPHViscosity,
)
from pysph_boiling.schemes.options import add_options, apply_options, option_table
from pysph_boiling.schemes.pbf import PBFScheme
from pysph_boiling.schemes.solver import strip_unused_declarations, vector_tag
from pysph_boiling.schemes.stages import PLACES, STAGES, Term

DX = 0.01
FULL = {**sets.BOIL, "viscosity": XSPHViscosity(wall=1.0), "loss": AmbientLoss(), "source": HeatSource(density=1e6),
        "dynamic_nucleation": DynamicNucleation(superheat_limit=50.0), "pooling": LatentPooling(),
        "convection": Convection(form="gradient"), "expansion": Expansion(), "oscillation": Oscillation(),
        "refill": Refill()}  # all but storage in sites, whose liquid stores no latent heat of its own
CLASSES = [cls for slot in BoilingScheme.slots for cls in EFFECTS[slot]]

# What each effect of FULL adds, and nobody else: kernels, properties, constants, columns of the results.
OWNS = {
    "density": (
        "PBFStepBack PBFDensity PBFBoundaryDensity PBFLeftOver PBFLambda PBFPositionCorrection PBFBoundaryCorrection "
        "PBFMove PBFBodyForce",
        "au av aw sx sy sz lmbda compression left_over gcx gcy gcz gc2 dpx dpy dpz limited",
        "density_error sweeps unconverged settled substeps prior",
        "sweeps density_error_mean density_error_max n_unconverged substeps n_split n_limited"),
    "container": ("PBFBoxContainer", "contacts projected", "", "n_contacts n_projected"),
    "viscosity": ("PBFXSPHViscosity PBFWallFriction", "", "", ""),
    "heat": ("HeatConductionClearyMonaghan HeatUpdate", "e T k ae", "heat_dt",
             "T_mean T_max energy energy_in energy_out energy_model_leak energy_residual heat_subcycles"),
    "heater": ("HeatFixedTemperature", "q_heater", "heater_on heater_T", "energy_heater"),
    "loss": ("HeatAmbientLoss HeatAmbientWall", "gsx gsy gsz q_loss", "", "energy_loss"),
    "source": ("HeatUniformSource", "q_source", "", "energy_source"),
    "phases": (
        "PhaseTemperatureHold PhaseTemperatureAfterHold PhaseKineticReset PhaseVapourCondition PhaseEdgesHold",
        "phase kinetic vaporised interrupted e_lat", "",
        "n_liquid n_transition n_superheated n_vapour n_held energy_liquid energy_transition energy_superheated "
        "energy_vapour energy_held n_nucleated n_interrupted energy_hidden"),
    "preset_nucleation": ("NucleationSiteCondition NucleationSiteAttraction", "", "", ""),
    "dynamic_nucleation": (
        "NucleationHeld NucleationRegion NucleationClaim NucleationFire NucleationChoice NucleationShare "
        "NucleationRelease",
        "held region_heat fire_key pick_key claim fires cut e_chosen e_others member fired burst", "steps",
        "n_burst n_fired"),
    "bubbles": ("BubbleStart BubbleSnap BubbleHook BubbleShortcut BubbleCheck BubbleLabel",
                "parent grandparent unsettled bubble bubble_n", "bubble_rounds",
                "n_bubbles bubble_radius_mean n_single_bubbles"),
    "condensation": ("BubbleCondensation", "condensing deficit condensed", "steps relabel", "n_condensed"),
    "pooling": ("PoolingJoin PoolingShare", "joined pooled", "relabel", ""),
    "buoyancy": ("BubbleBuoyancy", "", "", ""),
    "cohesion": ("BubbleCohesion", "", "", ""),
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
LEDGER = {"mass", "mass_in", "mass_out", "mass_residual"}  # columns of every run


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
    """The generated source of every stage, without compiling it."""
    compiler = SPHCompiler(make_acceleration_evals(arrays, equations, scheme.kernel), scheme.solver.integrator)
    return [compiler._get_code(), *(helper.get_code() for helper in compiler.acceleration_eval_helpers[1:])]


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


def subgroups(equations):
    """(parent, sub-group) of all stages."""
    return [(parent, group) for stage in equations.groups for parent in stage for group in parent.equations]


# --- what a scene has -------------------------------------------------------------------------------------------------

@pytest.mark.parametrize("slot", [*BoilingScheme.slots, "nothing"])
def test_absent_effect_adds_nothing(slot):
    """Kernels, properties, constants, columns and groups are exactly those of the effects that are present."""
    scheme, arrays, equations = make(effects=without(slot))
    assert slot not in scheme.effects
    kernels, properties, constants, columns = (
        {name for present in scheme.effects for name in OWNS[present][kind].split()} for kind in range(4))
    if "heat" in scheme.effects and "phases" not in scheme.effects:
        kernels |= {"HeatTemperature", "HeatTemperatureAfter"}
    if "density" not in scheme.effects:
        kernels -= {"NucleationSiteAttraction"}
    if "expansion" in scheme.effects:
        kernels |= {"PBFDensitySwollen", "PBFPositionCorrectionSwollen"}
        kernels -= {"PBFDensity", "PBFPositionCorrection"}
    terms = scheme.terms()
    assert {type(term.equation).__name__ for term in terms} == kernels
    assert {term.owner for term in terms} == {slot for slot in scheme.effects if OWNS[slot][0]}
    assert set(arrays[0].properties) == properties | {row.name for row in BASE_PROPERTIES} | set(PYSPH_PROPERTIES)
    assert set(arrays[0].constants) == constants
    assert {column.name for column in Ledger(scheme).columns} == columns | LEDGER
    assert {group.name for _, group in subgroups(equations)} == {term.place.replace(".", "_") for term in terms}
    built = {type(e).__name__ for _, group in subgroups(equations) for e in group.equations}
    assert {name.removesuffix("Lean") for name in built} == kernels


def test_stages_that_an_effect_leaves_as_they_are_keep_their_modules():
    """PySPH alone would compile every stage anew, since each module declares what any effect brings along."""
    full, less = (sources(*make(effects=effects)) for effects in (FULL, without("dynamic_nucleation")))
    assert len(full) == len(less) + 1 and not set(full) & set(less)
    assert set(map(strip_unused_declarations, less)) <= set(map(strip_unused_declarations, full))


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
    before, after = make(effects=effects), make(effects={**effects, "mechanics": MechanicalLedger()})
    swells = "expansion" in effects
    owners = {"density", "viscosity", "preset_nucleation", "buoyancy", "cohesion", "adhesion", "drag", "venting"}
    parts = owners | {"gravity", "vented", "container"} | ({"expansion"} if swells else set())
    for what, own in (
        (lambda m: {type(term.equation).__name__ for term in m[0].terms()}, {"PBFPressure"} if swells else set()),
        (lambda m: set(m[1][0].properties), {f"a{axis}_by_{owner}" for owner in owners for axis in "uvw"} | (
            {"swell_before", "impulse", "pressure"} if swells else set())),
        (lambda m: set(m[1][0].constants), {f"work_{part}" for part in parts} | {"work_moved", "kinetic_start"}),
        (lambda m: {column.name for column in Ledger(m[0]).columns},
         {f"work_{part}" for part in parts} | {"kinetic_energy", "work_residual"}),
    ):
        assert what(after) - what(before) == own and what(before) <= what(after)
    names = [[group.name for _, group in subgroups(made[2])] for made in (before, after)]
    assert set(names[0]) - set(names[1]) == {"forces_sum", "forces_release", "density_contact", "density_move"}
    assert set(names[1]) - set(names[0]) == {f"forces_sum_{owner}" for owner in owners - {"venting"}} | {
        "forces_release_venting", "density_contact_container", "density_move_density", "density_move_container"} | (
            {"density_pressure"} if swells else set())


def test_every_slot_is_tested():
    assert set(OWNS) == set(BoilingScheme.slots) - {"storage", "mechanics"} == {"density", *FULL}


def test_stage_without_terms_is_not_built():
    scheme, _, equations = make(effects=sets.SETS["slab"])
    assert len(equations.groups) == 1 and list(scheme.integrator.stages) == ["heat"]


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
    scheme, _, _ = make(effects=FULL)
    lines = scheme.describe().splitlines()
    for term in scheme.terms():
        stage, group = term.place.split(".")
        assert any(line.startswith(f"stage {stage} (") for line in lines)
        assert any(line.strip("*- ").startswith(f"{group}: ") for line in lines)
        assert any(type(term.equation).__name__ in line and line.endswith(f"for {term.owner}") for line in lines)
    starred = {line.split()[1].rstrip(":") for line in lines if line.startswith("  * ")}
    assert starred == {"multiplier", "correction", "move", "snap", "hook", "shortcut", "check"}
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
    (lambda: make(effects=dict(container=Drag())), "must be BoxContainer or CylinderContainer or None"),
    (lambda: Drag().replaced(speed=1.0), "drag between phases has no parameter speed"),
    (lambda: Heater(temperature=400.0, flux=1e4), r"exactly one of temperature \[K\] and flux \[W/m\^2\]"),
    (lambda: Heater(), r"exactly one of temperature \[K\] and flux \[W/m\^2\]"),
    (lambda: BoxContainer(lower=(0.0, 0.0)), "must hold three lengths"),
])
def test_refused(build, message):
    with pytest.raises(ValueError, match=message):
        build()


BOUNDED = [(cls, spec, bound) for cls in CLASSES for spec in dataclasses.fields(cls)
           for bound in ("low", "high", "above") if spec.metadata[bound] is not None]


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


# --- the command line -------------------------------------------------------------------------------------------------

def parse(*arguments):
    parser = argparse.ArgumentParser(exit_on_error=False)
    add_options(parser, BoilingScheme.slots)
    return parser.parse_args(list(arguments))


def plain(cls):
    """An effect with its defaults; a heater and a source have none."""
    return cls(**{Heater: dict(temperature=400.0), HeatSource: dict(density=1e3)}.get(cls, {}))


def another(cls, spec):
    """A valid value of a parameter other than its default, as (text, value)."""
    if spec.metadata["choices"]:
        value = next(choice for choice in spec.metadata["choices"] if choice != spec.default)
        return value, value
    if isinstance(spec.default, bool):
        return ("no", False) if spec.default else ("yes", True)
    if isinstance(spec.default, tuple):
        value = tuple(v + 0.5 for v in spec.default)
        return ",".join(map(str, value)), value
    for value in (4.0, 3, 1.3, 0.3, 300.0):
        try:
            plain(cls).replaced(**{spec.name: value})
        except ValueError:
            continue
        if value != spec.default and not (spec.type is int and isinstance(value, float)):
            return str(value), value
    raise AssertionError(f"no value found for {cls.slot}.{spec.name}")


PARAMETERS = [(cls, spec) for cls in CLASSES for spec in dataclasses.fields(cls)]


@pytest.mark.parametrize(("cls", "spec"), PARAMETERS, ids=[f"{c.__name__}.{s.name}" for c, s in PARAMETERS])
def test_every_parameter_arrives(cls, spec):
    rows = [row for row in option_table(BoilingScheme.slots) if row[:2] == (cls.slot, spec.name)]
    assert len(rows) == 1, "one option a parameter"
    text, value = another(cls, spec)
    effects = {"phases": FULL["phases"], cls.slot: plain(cls)}
    result = apply_options(parse(f"{rows[0][2]}={text}"), effects, BoilingScheme.slots)
    assert type(result[cls.slot]) is cls and getattr(result[cls.slot], spec.name) == value
    changed = {s.name for s in dataclasses.fields(cls) if getattr(result[cls.slot], s.name) !=
               getattr(effects[cls.slot], s.name)}
    assert changed - {spec.name} <= ({"temperature"} if spec.name == "flux" else set())
    assert all(result[slot] == effects[slot] for slot in effects if slot != cls.slot)


def test_table_has_nothing_but_the_parameters():
    table = {(slot, name) for slot, name, *_ in option_table(BoilingScheme.slots)}
    assert table == {(cls.slot, spec.name) for cls, spec in PARAMETERS}


def test_no_option_changes_nothing():
    assert apply_options(parse(), FULL, BoilingScheme.slots) == FULL


@pytest.mark.parametrize("slot", [slot for slot in FULL if slot not in ("heater", "source")])
def test_switches(slot):
    off = apply_options(parse(option(f"no_{slot}")), FULL, BoilingScheme.slots)
    assert off == {name: effect for name, effect in FULL.items() if name != slot}
    on = apply_options(parse(option(slot)), off, BoilingScheme.slots)
    assert on[slot] == EFFECTS[slot][0]()


@pytest.mark.parametrize(("arguments", "effects", "message"), [
    (["--no-drag", "--drag.rate=3"], FULL, "--no-drag and --drag.rate contradict each other"),
    (["--heater"], {}, "heater: give exactly one"),
    (["--source"], {}, "source: give its power density"),
    (["--heater.flux=1", "--heater.temperature=400"], FULL, "heater: give exactly one"),
    (["--container.radius=1"], FULL, "box container has no parameter radius"),
    (["--container.radius=1", "--container.upper=1,1,1"], {}, "no form of 'container' takes all of radius, upper"),
    (["--drag.rate=-1"], FULL, r"drag.rate must be >= 0.0 1/s, got -1.0 1/s"),
    (["--density.min-sweeps=9"], {"density": EFFECTS["density"][0]()}, "min_sweeps = 9 is above density.max_sweeps"),
])
def test_contradictory_options(arguments, effects, message):
    with pytest.raises(ValueError, match=message):
        apply_options(parse(*arguments), effects, BoilingScheme.slots)


def test_parameter_switches_its_effect_on():
    result = apply_options(parse("--container.radius=0.2"), {}, BoilingScheme.slots)
    assert result == {"container": CylinderContainer(radius=0.2)}


def test_flux_takes_the_place_of_the_temperature():
    result = apply_options(parse("--heater.flux=2e4"), FULL, BoilingScheme.slots)
    assert result["heater"] == Heater(flux=2e4)
    assert FULL["heater"].replaced(temperature=400.0) == Heater(temperature=400.0)


def test_options_of_pysph_reach_the_scheme(tmp_path):
    """A kernel or a time step of one's own is that of the rest densities, walls and warnings too."""
    app = DamBreak()
    app.set_args(["--kernel", "WendlandQuintic", "--timestep", "0.002", "--frame", "0.02", "-d", str(tmp_path)])
    app._parse_command_line(force=True)
    app._prepare()
    assert type(app.scheme.kernel).__name__ == type(app.scheme.solver.kernel).__name__ == "WendlandQuintic"
    assert (app.scheme.dt, app.scheme.solver.pfreq) == (0.002, 10)


# --- groups that compile on every backend -----------------------------------------------------------------------------

@pytest.mark.parametrize("name", sets.SETS)
def test_groups_suit_every_backend(name):
    scheme, _, equations = make(effects=sets.SETS[name])
    parents = [parent for stage in equations.groups for parent in stage]
    for parent in parents:
        assert parent.has_subgroups and not parent.update_nnps
        assert parent.pre is None and parent.post is None and parent.condition is None
    for parent, group in subgroups(equations):
        assert not group.has_subgroups and not group.iterate
        assert not (parent.iterate and group.condition is not None)
    names = [group.name for group in parents] + [group.name for _, group in subgroups(equations)]
    assert len(set(names)) == len(names) and not any(name.startswith("Group") for name in names)
    assert {parent.name for parent in parents if parent.iterate} == \
           {f"{stage.name}{n}{vector_tag()}" for stage in STAGES for n, block in enumerate(stage.blocks)
            if block.iterate and stage.name in scheme.integrator.stages}


def test_sweeps_are_limited_as_asked():
    effects = {**sets.SETS["motion"], "density": EFFECTS["density"][0](min_sweeps=3, max_sweeps=5)}
    (parent,) = [parent for parent, group in subgroups(make(effects=effects)[2]) if group.name == "density_move"]
    assert (parent.iterate, parent.min_iterations, parent.max_iterations) == (True, 3, 50)


# --- ghosts -----------------------------------------------------------------------------------------------------------

def refreshed(equations):
    """Group name -> what its ghosts get once it has run."""
    return {group.name: hook.names for _, group in subgroups(equations) for hook in group.post or ()
            if isinstance(hook, GhostRefresh)}


def test_ghosts_are_refreshed_after_every_group_that_changes_what_neighbours_read():
    found = refreshed(make(effects=FULL)[2])
    assert found["density_multiplier"] == ("lmbda",) and found["density_move"] == ("x", "y", "z", "impulse")
    assert found["heat_temperature"] == ("T", "k") and found["heat_update"] == ("e", "T")
    assert found["phases_edges"] == ("phase", "T")
    assert found["bubbles_start"] == found["bubbles_snap"] == ("grandparent",) and found["bubbles_film"] == ("film",)


def test_groups_refresh_what_there_is():
    """A misspelt name would refresh nothing, in silence."""
    properties = {row.name for row in BASE_PROPERTIES}
    for effects in ({"mechanics": MechanicalLedger()},
                    {"phases": PhaseChange(kinetic="never"), "storage": SiteStorage()}):
        scene = BoilingScheme(["fluid"], ["wall"], dim=2, spacing=DX, **{**FULL, **effects}).scene()
        properties |= {row.name for effect in scene.effects.values() for row in effect.properties(scene)}
    named = {name for stage in STAGES for block in stage.blocks for spec in block.groups for name in spec.refresh}
    assert len(named) > 10 and named <= properties


@pytest.mark.parametrize(("method", "given", "message"), [
    ("terms", lambda: iter([Term("forces.summ", Mock())]),
     "no place for Mock of effect 'drag': 'forces.summ'; did you mean 'forces.sum'?"),
    ("terms", lambda: iter([Term("forces", Mock())]), "no place for Mock of effect 'drag': 'forces'"),
    ("hooks", lambda: {"heat.updat": print}, "no place for a hook of effect 'drag': 'heat.updat'; did you mean"),
    ("hooks", lambda: {"phases.emit": print}, "effect 'drag' hooks on 'phases.emit', which has no equations here"),
    ("conditions", lambda: {"bubles": print},
     "no stage for a condition of effect 'drag': 'bubles'; did you mean 'bubbles'"),
    ("conditions", lambda: {"dynamic_nucleation": print},
     "condition for the stage 'dynamic_nucleation', which has no equations here"),
])
def test_what_would_never_run_is_refused(monkeypatch, method, given, message):
    monkeypatch.setattr(Drag, method, lambda *_: given())
    with pytest.raises(ValueError, match=message):
        make(effects=sets.BOIL)


def test_places_are_those_of_the_stages():
    assert len(PLACES) == sum(len(block.groups) for stage in STAGES for block in stage.blocks)
    assert PLACES["forces.sum"] == "forces" and PLACES["bubbles.label"] == "bubbles"


def test_refresh_returns_at_once_without_ghosts(monkeypatch):
    scheme, arrays, equations = make(effects=FULL)
    monkeypatch.setattr(Ghosts, "refresh", lambda *_: pytest.fail("refreshed without ghosts"))
    scheme.ghosts.arrays = arrays[:1]
    scheme.ghosts.search_done()
    hooks = [hook for _, group in subgroups(equations) for hook in group.post or () if isinstance(hook, GhostRefresh)]
    assert hooks and all(hook.ghosts is scheme.ghosts for hook in hooks)
    for hook in hooks:
        hook()


def test_refresh_copies_to_the_images_and_keeps_their_shift():
    fluid = fluid_block((0.0, 0.0, 0.0), (6 * DX, 6 * DX, 0.0), spacing=DX, dim=2, rho0=1000.0)
    n = fluid.get_number_of_particles()
    domain = DomainManager(xmin=0.0, xmax=6 * DX, ymin=0.0, ymax=6 * DX, periodic_in_x=True, periodic_in_y=True)
    nnps = LinkedListNNPS(dim=2, particles=[fluid], radius_scale=2.0, domain=domain)
    nnps.update()
    ghosts = Ghosts()
    ghosts.arrays = [fluid]
    ghosts.search_done()
    assert fluid.get_number_of_particles() > 2 * n
    values = {name: fluid.get(name, only_real_particles=False) for name in ("x", "y", "u", "v", "uid")}
    uid = values["uid"]
    before = values["x"].copy()
    values["x"][:n] += 0.001 * np.arange(n)
    values["u"][:n] = np.arange(n)
    values["v"][:n] = np.arange(n)
    GhostRefresh(ghosts, ("x", "y", "z", "u"))()
    np.testing.assert_array_equal(values["u"][n:], uid[n:])
    np.testing.assert_allclose(values["x"][n:] - before[n:], 0.001 * uid[n:], atol=1e-15)
    assert not np.any(values["v"][n:]), "only what was named"


# --- warnings ---------------------------------------------------------------------------------------------------------

@pytest.mark.parametrize(("effects", "kwargs", "message"), [
    (sets.BOIL, dict(dt=3e-3), r"cohesion.strength g dt\^2/spacing = 0.044 is above 0.025: bubbles stir the "
     "liquid; use a shorter step or less cohesion"),
    (sets.BOIL, dict(gravity=(0.0, 0.0, 0.0)), "buoyancy: without gravity it does nothing"),
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
