"""Bad input ends a run at once: a sentence on stderr that names what, where, range and unit; status 2; no file."""
import os
import warnings
from types import SimpleNamespace

import numpy as np
import pytest
import sets
from pysph.base.kernels import CubicSpline, WendlandQuintic

from pysph_boiling import cli
from pysph_boiling.examples.dam_break import DamBreakParameters
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.particles import box_vessel, fluid_array, fluid_block, lattice_density, site_array
from pysph_boiling.runs.application import SceneParameters
from pysph_boiling.runs.ledger import Ledger
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import BoxContainer, Buoyancy, Expansion, Oscillation, SiteStorage, Venting
from pysph_boiling.schemes.integrator import HeatClock
from pysph_boiling.schemes.modes import effects_in_mode

DX = 0.01
COMMANDS = [
    ("", "usage: pysph-boiling COMMAND"),
    ("frobnicate", "no command 'frobnicate'"),
    ("run", "name a scene, one of: bubble_"),
    ("run nowhere", "no scene 'nowhere'; there are: bubble_"),
    ("render nowhere", "nowhere"),
    # a scene's own parameters
    ("run dam_break --spacing -1", "--spacing must be > 0.0 m, got -1.0 m"),
    ("run dam_break --spacing nan", "--spacing must be finite, got nan m"),
    ("run dam_break --spacing x", "argument --spacing: invalid float value: 'x'"),
    ("run dam_break --dim 4", "argument --dim: invalid choice: 4"),
    ("run dam_break --frame 0", "--frame must be > 0.0 s, got 0.0 s"),
    ("run dam_break --tf -1", "--duration must be > 0.0 s, got -1.0 s"),
    ("run dam_break --substeps 0", "--substeps must be >= 1, got 0"),
    ("run dam_break --substeps 3.5", "argument --substeps: invalid int value: '3.5'"),
    ("run superheat_sites --mode li_xiao --storage.n-emit 7.5", "argument --storage.n-emit: invalid int value: '7.5'"),
    ("list scenes", "unrecognized arguments: scenes"),
    ("run dam_brek", "no scene 'dam_brek'; did you mean 'dam_break'? There are: bubble_"),
    ("rnu dam_break", "no command 'rnu'; did you mean 'run'?"),
    # the nearest name
    ("run steady_boiling --heater.temprature 413", "unrecognized arguments: --heater.temprature 413; did you mean "
     "'--heater.temperature'? --help heater lists the parameters of this effect"),
    ("run steady_boiling --no-darg", "unrecognized arguments: --no-darg; did you mean '--no-drag'?"),
    ("run steady_boiling --suprheat=5", "did you mean '--superheat'?"),
    ("run steady_boiling --pattern reglar", "argument --pattern: invalid choice: 'reglar' (choose from 'regular', "
     "'random'); did you mean 'regular'?"),
    ("run steady_boiling --mode dinamic", "did you mean 'dynamic'?"),
    ("run steady_boiling --forms papr", "did you mean 'paper'?"),
    ("run steady_boiling --nnps sortd", "did you mean 'sorted'?"),
    ("run steady_boiling --help heatr", "no topic of the help 'heatr'; did you mean 'heater'? "
     "There are: scene, pysph, all, effects, density"),
    ("run heat_wave --directry x", "did you mean '--directory'?"),
    ("run heat_wave --help heat", "no topic of the help 'heat'; there are: scene, pysph, all"),
    ("run dam_break --heat.enhancement 3", "the scheme of this scene has no effect 'heat'"),
    ("render . --view surfce", "did you mean 'surface'?"),
    ("render . --moive mp4", "did you mean '--movie'?"),
    ("reproduce fgi14", "no figure 'fgi14'; did you mean 'fig14'?"),
    ("reproduce --quik", "did you mean '--quick'?"),
    ("validate growht", "no case 'growht'; did you mean 'growth'?"),
    ("validate --lst", "did you mean '--list'?"),
    ("stress dam-dt5-2", "no case 'dam-dt5-2'; did you mean 'dam-dt5-2d'?"),
    ("stress --qick", "did you mean '--quick'?"),
    ("accuracy dam_brek", "did you mean '"),
    ("accuracy --repeat-s 3", "did you mean '--repeats'?"),
    ("bubbles . --hlep", "did you mean '--help'?"),
    ("list --hlep", "did you mean '--help'?"),
    ("validate --jobs 0", f"--jobs must be 1 to {os.cpu_count()}, got 0"),
    ("run dam_break --width 0.001", "particle array 'fluid' is empty: it needs at least one particle"),
    ("run steady_boiling --seed -1", "--seed must be >= 0, got -1"),
    ("run steady_boiling --superheat 300", "--superheat must be <= 250.0 K, got 300.0 K"),
    ("run steady_boiling --subcooling 400", "--subcooling must be <= 80.0 K, got 400.0 K"),
    ("run heated_slab --T-1 700", "--heater.temperature must be below the critical point of water at 1 atm, 647.1 K"),
    ("run heated_slab --T-0 700", "temperature of liquid water at 1 atm must lie in (0, 647.1) K, got 700.0 K"),
    # effects
    ("run dam_break --heat", "unrecognized arguments: --heat"),
    ("run dam_break --viscosity.thickness 3", "unrecognized arguments: --viscosity.thickness"),
    ("run dam_break --viscosity.rate -1", "--viscosity.rate must be >= 0.0 1/s, got -1.0 1/s"),
    ("run dam_break --container.lower 1,2", "--container.lower and --container.upper must each be three lengths [m]"),
    ("run dam_break --container.lower 9,0,0", "container: lower x must be below upper x, got 9.0 and 3.75 m"),
    ("run dam_break --no-density", "effect 'container' (BoxContainer) needs the effect 'density': add --density, or "
     "leave 'container' out with --no-container"),
    ("run steady_boiling --no-heat", "effect 'heater' (Heater) needs the effect 'heat': add --heat, or leave "
     "'heater' out with --no-heater"),
    ("run steady_boiling --cohesion.radius 5", "--cohesion.radius must be <= 2.4 spacings (the support of the kernel)"),
    ("run steady_boiling --adhesion.radius 5", "sites 'sites' reach 2.4 spacings, but the effects need 5"),
    ("run superheat_sites --flat --expansion.v-exp 4",
     "--expansion.v-exp must be below 3.166 for a particle of 0.003832 kg and a smoothing length of 0.0024 m, got 4"),
    ("run geyser --flat --v-exp 3.5", "--expansion.v-exp must be below 3.166"),
    ("run explosive_boiling --expansion.v-exp 4 --oscillation.form rayleigh_plesset",
     "--expansion.v-exp times the cube of --oscillation.upper must be below 5.433"),
    ("run dam_break --source", "unrecognized arguments: --source"),
    ("run steady_boiling --source", "source: the power density --source.density [W/m^3] must be given"),
    ("run steady_boiling --venting.T-feed 380", "--venting.T-feed must be <= T_sat = 373.15 K, got 380.0 K"),
    ("run dam_break --viscosity.rate 1e9", "the effect 'viscosity' has a rate of 1e+09 1/s: lower its rate"),
    ("run steady_boiling --viscosity.wall 1e7", "the effect 'viscosity' has a rate of"),
    ("run steady_boiling --drag.rate 1e9", "the effect 'drag' has a rate of 1e+09 1/s: lower its rate"),
    ("run dam_break --density.longest-step 1e-5", "more than 1000; --density.longest-step = 1e-05 t* allows no more"),
    ("run steady_boiling --source --source.density -2e9 --seed -1", "--seed must be >= 0, got -1.0"),
    ("run dam_break --container.lower -1e-2,0,0 --seed -1", "--seed must be >= 0, got -1.0"),
    ("run steady_boiling --preset-nucleation.radius 5", "need 5: --preset-nucleation.radius, "
     "--preset-nucleation.attraction-radius and --adhesion.radius must be at most 2.4"),
    ("run steady_boiling --expansion --expansion.ramp 1", "--expansion.ramp must be >= 2.0, got 1.0"),
    ("run dam_break --frame 1e-300", "s in steps of 1e-300 s are"),
    ("run steady_boiling --timestep 1e-15", "more than 2147483648: use longer steps or frames, a shorter --duration"),
    # contradictions
    ("run dam_break --no-container --container.margin 0.3", "--no-container and --container.margin contradict"),
    ("run dam_break --container.radius 1", "box container has no parameter radius"),
    ("run steady_boiling --demo --flat", "argument --flat: not allowed with argument --demo"),
    ("run steady_boiling --heater.flux 1 --heater.temperature 400", "exactly one of temperature [K] and flux [W/m^2]"),
    ("run dam_break --timestep 1e-3 --substeps 2", "--timestep and --substeps contradict each other"),
    # PySPH's own options
    ("run dam_break --nnps sfc", "argument --nnps: 'sfc' gives wrong neighbours when they are cached"),
    ("run dam_break --nnps x", "argument --nnps: 'x' is not one of sorted, ll, box"),
    ("run dam_break --results-every 0", "--results-every must be >= 1 step, got 0"),
    ("run dam_break --pfreq 0", "--pfreq must be >= 1 step, got 0"),
    ("run dam_break --timestep 0", "--timestep must be > 0 s, got 0.0 s"),
    ("run dam_break --timestep nan", "--timestep must be > 0 s, got nan s"),
    ("run dam_break --loglevel x", "--loglevel must be one of debug, info, warning, error, critical, none; got 'x'"),
    ("run dam_break --restart-file nowhere.hdf5", "--restart-file: there is no file nowhere.hdf5"),
    ("run explosive_boiling --preset-nucleation", "preset_nucleation: preset sites need a particle array of sites: "
     "this scene has none, so leave 'preset_nucleation' out with --no-preset-nucleation"),
    ("run steady_boiling --storage", "liquid must not store any: give --phases.kinetic never, as --mode li_xiao does"),
    ("run bubble_rise --no-expansion --oscillation.form rayleigh_plesset", "--oscillation.form = 'rayleigh_plesset' "
     "needs the effect 'expansion': add --expansion, or choose another form"),
]


@pytest.mark.parametrize(("command", "message"), COMMANDS, ids=[command or "nothing" for command, _ in COMMANDS])
def test_command_is_refused(command, message, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    try:
        status = cli.main(command.split())
    except SystemExit as error:  # argparse
        status = error.code
    out, err = capsys.readouterr()
    assert (status, list(tmp_path.iterdir())) == ((0 if command == "" else 2), [])
    assert message in " ".join((err if command else out).split())
    assert "Traceback" not in err


def test_describe_writes_and_compiles_nothing(tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("pysph.sph.sph_compiler.SPHCompiler.compile", lambda _: pytest.fail("compiled"))
    assert cli.main(["run", "steady_boiling", "--describe", "--no-drag"]) == 0
    out = capsys.readouterr().out
    assert "stage density (always;" in out and "for cohesion" in out and "for drag" not in out
    assert not list(tmp_path.iterdir())


def test_folder_that_is_a_file(tmp_path, capsys):
    taken = tmp_path / "taken"
    taken.touch()
    assert cli.main(["run", "dam_break", "-d", str(taken)]) == 2
    assert f"the output folder '{taken}' cannot be written to: File exists" in capsys.readouterr().err


# --- the same from Python ---------------------------------------------------------------------------------------------

def scene(name="boil", **changes):
    """A scheme and its arrays; ``changes`` replaces arrays, ``None`` leaves one out."""
    scheme = sets.scheme(name, dim=2, spacing=DX)
    common = dict(spacing=DX, dim=2, rho0=scheme.rho0)
    arrays = {
        "fluid": fluid_block((0.0, 0.0, 0.0), (4 * DX, 4 * DX, 0.0), **common),
        "wall": box_vessel((0.0, 0.0), (4 * DX, 4 * DX), kernel=CubicSpline(dim=2), heated_fraction=0.5, **common),
        "sites": site_array([(2 * DX, 0.0, 0.0)], reach=2.4 * DX, spacing=DX), **changes}
    return scheme, [pa for pa in arrays.values() if pa is not None]


def broken(prop, value):
    """A fluid whose first particle has a bad value."""
    fluid = scene()[1][0]
    fluid.get(prop)[0] = value
    return fluid


@pytest.mark.parametrize(("changes", "message"), [
    (dict(sites=None), r"names the particle array 'sites', but the scene has \['fluid', 'wall'\]"),
    (dict(wall=None), "names the particle array 'wall'"),
    (dict(sites=site_array([(0.0, 0.0, 0.0)], reach=DX, spacing=DX)), "sites 'sites' reach 1 spacings, .* need 2.4"),
    (dict(fluid=broken("x", np.nan)), "property 'x' of 'fluid' holds NaN or Inf"),
    (dict(fluid=broken("v", np.inf)), "property 'v' of 'fluid' holds NaN or Inf"),
    (dict(fluid=broken("m", 0.0)), r"masses \[kg\] and smoothing lengths \[m\] of 'fluid' must be > 0"),
    (dict(fluid=broken("m", 5.0 * 958.0 * DX**2)), "the mass of particle 0 of 'fluid' must be below .* kg at its"),
    (dict(fluid=broken("h", -1.0)), r"masses \[kg\] and smoothing lengths \[m\] of 'fluid' must be > 0"),
    (dict(wall=box_vessel((0.0, 0.0), (4 * DX, 4 * DX), spacing=DX, dim=2, rho0=958.0, kernel=CubicSpline(dim=2))),
     "heater: no wall particle is heated"),
])
def test_arrays_are_refused(changes, message):
    scheme, arrays = scene(**changes)
    with pytest.raises(ValueError, match=message):
        scheme.setup_properties(arrays)


# --- sites that crowd each other --------------------------------------------------------------------------------------

@pytest.mark.parametrize(("dim", "least"), [(2, 3.0), (3, 2.8)])
def test_sites_from_which_no_bubble_departs_are_told(dim, least):
    def sites(apart, period=0.0):
        effects = {**sets.BOIL, "heater": None}
        scheme = BoilingScheme(["fluid"], [], dim=dim, spacing=DX, sites=["sites"], **effects)
        fluid = fluid_block((0.0,) * dim, (4 * DX,) * dim, spacing=DX, dim=dim, rho0=scheme.rho0)
        places = DX * np.array([(0.0, 0.0, 0.0), (apart, 0.0, 0.0), (20.0, 0.0, 0.0)])
        scheme.period[0] = DX * period
        scheme.setup_properties([fluid, site_array(places, reach=2.4 * DX, spacing=DX)])

    with warnings.catch_warnings():
        warnings.simplefilter("error")
        sites(least)
    with pytest.warns(UserWarning, match=f"2 of 3 nucleation sites are closer than {least:g} spacings to another, the "
                      "closest 2.5: .* no bubble departs; use fewer sites"):
        sites(2.5)
    with pytest.warns(UserWarning, match="2 of 3 nucleation sites .* the closest 1.5"):
        sites(5.0, period=21.5)


def test_crowded_base_of_a_scene_is_told():
    p = SteadyBoiling.Parameters(**{**SteadyBoiling.variants["flat"], "width": 30, "sites": 9, "pattern": "regular"})
    scene = SteadyBoiling()
    scheme = scene.make_scheme(p)
    with pytest.warns(UserWarning, match="9 of 9 nucleation sites .* the closest 2.33: their vapour may merge"):
        scheme.setup_properties(scene.make_particles(p, scheme))


# --- vapour that swells -----------------------------------------------------------------------------------------------

def swelling(dim, v_exp, *, kernel=None, hdx=1.2, mass=1.0, length=1.0, upper=None):
    """Arrays of a scheme with expansion, set up; one particle has another mass and smoothing length."""
    ring = {} if upper is None else dict(oscillation=Oscillation(form="rayleigh_plesset", upper=upper))
    effects = {**sets.BOIL, "heater": None, "preset_nucleation": None, "adhesion": None, "cohesion": None,
               "expansion": Expansion(v_exp=v_exp)}
    scheme = BoilingScheme(["fluid"], [], dim=dim, spacing=DX, kernel=kernel, hdx=hdx, **{**effects, **ring})
    fluid = fluid_block((0.0,) * dim, (4 * DX,) * dim, spacing=DX, dim=dim, rho0=scheme.rho0, hdx=hdx)
    fluid.m[3] *= mass
    fluid.h[3] *= length
    scheme.setup_properties([fluid])
    return scheme, fluid


@pytest.mark.parametrize(("dim", "kernel", "hdx"), [
    (2, CubicSpline, 1.2), (2, CubicSpline, 1.0), (2, WendlandQuintic, 1.2), (2, WendlandQuintic, 1.4),
    (3, CubicSpline, 1.0), (3, WendlandQuintic, 1.1)])
def test_expansion_is_refused_from_where_vapour_alone_is_denser_than_at_rest(dim, kernel, hdx):
    kernel = kernel(dim=dim)
    limit = lattice_density(kernel, dim=dim, hdx=hdx)[0] * hdx**dim / kernel.kernel([0.0] * 3, 0.0, 1.0)
    assert 2.0 < limit < 4.0
    swelling(dim, 0.999 * limit, kernel=kernel, hdx=hdx)
    with pytest.raises(ValueError, match=f"expansion.v_exp must be below {limit:.4g} for a particle of"):
        swelling(dim, 1.001 * limit, kernel=kernel, hdx=hdx)


def test_expansion_in_3d_is_allowed_to_its_largest_value():
    swelling(3, 4.0)


@pytest.mark.parametrize("change", [dict(mass=1.7), dict(length=0.8)])
def test_expansion_is_refused_for_the_particle_that_allows_least(change):
    swelling(2, 1.85, **change)
    with pytest.raises(ValueError, match="expansion.v_exp must be below (1.862|2.026) for a particle of .* got 2.05"):
        swelling(2, 2.05, **change)


def test_volume_of_a_ringing_bubble_is_bounded_alike():
    swelling(3, 1.5, upper=1.5)
    with pytest.raises(ValueError, match="v_exp times the cube of oscillation.upper must be below 5.* got 6.144"):
        swelling(3, 1.5, upper=1.6)


def test_vapour_that_has_filled_its_container_swells_no_further():
    scheme, fluid = swelling(2, 3.0)
    scheme.set_effects(container=BoxContainer(upper=(4 * DX, 5 * DX, 0.0)))
    scheme.arrays[:] = [fluid]
    (room,) = scheme.effects["expansion"].tools(scheme)
    solver = SimpleNamespace(count=20, t=0.5, dt=1e-3)
    fluid.swell[:2] = 3.0  # 16 + 2 * 2 of 20 places
    room.post_step(solver)
    assert list(fluid.swell[:3]) == [3.0, 3.0, 1.0]
    fluid.swell[2] = 2.0
    with pytest.warns(UserWarning, match=r"t = 0.501 s vapour has filled its container of 0.002 m\^2, so its expa"):
        room.post_step(solver)
    np.testing.assert_allclose(fluid.swell[:3], [2.6, 2.6, 1.8], rtol=1e-12)  # four of the five places gained
    assert np.sum(fluid.m * fluid.swell) == pytest.approx(scheme.rho0 * 20 * DX**2, rel=1e-12)
    assert np.all(fluid.swell[3:] == 1.0)


def test_empty_fluid_is_refused():
    scheme, arrays = scene()
    arrays[0].remove_particles(np.arange(16))
    with pytest.raises(ValueError, match="particle array 'fluid' is empty"):
        scheme.setup_properties(arrays)


def test_sites_without_the_name_of_an_array():
    scheme, arrays = scene()
    scheme.sites = []
    with pytest.raises(ValueError, match=r"pass sites=\['sites'\] to the scheme and create that array"):
        scheme.setup_properties(arrays)


@pytest.mark.parametrize(("more", "message"), [
    ("fluids", "bubbles: all liquid and vapour must be in one fluid array"),
    ("sites", "preset_nucleation: all preset sites must be in one array"),
])
def test_what_must_be_one_array(more, message):
    """Labels and the nearest site are looked for within an array; two would be wrong without a word."""
    scheme, arrays = scene()
    getattr(scheme, more).append("second")
    twin = scene()[1][0 if more == "fluids" else 2]
    twin.set_name("second")
    with pytest.raises(ValueError, match=message):
        scheme.setup_properties([*arrays, twin])


def test_enthalpy_that_diverges_ends_the_run_instead_of_hanging():
    scheme, arrays = scene()
    scheme.setup_properties(arrays)
    scheme.configure_solver(dt=1e-3)
    scheme.get_equations()
    integrator = scheme.integrator
    integrator.arrays[:] = arrays[:1]
    assert integrator.count_subcycles(1e-3) == 1
    for rate in (1e30, np.nan):
        arrays[0].ae[0] = rate
        with pytest.raises(ValueError, match="heat steps, more than 100000"):
            integrator.count_subcycles(1e-3)


@pytest.mark.parametrize("T", [0.0, -1.0, 647.1, 700.0, np.nan])
def test_temperature_is_refused(T):
    scheme, (fluid, *_) = scene()
    with pytest.raises(ValueError, match=r"must lie in \(0, 647.1\) K, got"):
        scheme.set_temperature(fluid, T)


@pytest.mark.parametrize(("build", "message"), [
    (lambda: fluid_array(np.zeros((0, 3)), spacing=DX, dim=2, rho0=1e3), "particle array 'fluid' is empty"),
    (lambda: fluid_array([(np.nan, 0.0, 0.0)], spacing=DX, dim=2, rho0=1e3), "positions of 'fluid' hold NaN or Inf"),
    (lambda: fluid_array([(0.0, 0.0)], spacing=DX, dim=2, rho0=1e3), r"must have shape \(n, 3\), got \(1, 2\)"),
    (lambda: fluid_array([(0.0,) * 3], spacing=-DX, dim=2, rho0=1e3), r"spacing must be > 0 m, got -0.01 m"),
    (lambda: fluid_array([(0.0,) * 3], spacing=DX, dim=2, rho0=0.0), r"rho0 must be > 0 kg/m\^3, got 0.0"),
    (lambda: BoilingScheme(["fluid"], [], dim=1, spacing=DX), "dim must be 2 or 3, got 1"),
    (lambda: BoilingScheme(["fluid"], [], dim=2, spacing=-1.0), "spacing must be > 0 m, got -1.0 m"),
    (lambda: BoilingScheme(["fluid"], [], dim=2, spacing=np.nan), "spacing must be > 0 m, got nan m"),
    (lambda: BoilingScheme([], [], dim=2, spacing=DX), "needs the name of at least one fluid array"),
    (lambda: BoilingScheme(["a", "a"], [], dim=2, spacing=DX), "the particle array 'a' must not be named twice"),
    (lambda: BoilingScheme(["a"], ["b"], dim=2, spacing=DX, sites=["b"]), "array 'b' must not be named twice"),
    (lambda: BoilingScheme("fluid", [], dim=2, spacing=DX), "fluids must be a list of names of .*, got 'fluid'"),
    (lambda: BoilingScheme(["fluid"], [1], dim=2, spacing=DX), r"solids must be a list of names of .*, got \[1\]"),
    (lambda: BoilingScheme(["fluid"], [], dim=2, spacing=DX, gravity=(0, 1)), "gravity must be three finite"),
    (lambda: BoilingScheme(["fluid"], [], dim=2, spacing=DX, hdx=0.5), r"must lie in \[1, 2\], got 0.5"),
    (lambda: sets.WATER_1ATM.with_(L=0.0), "L of water at 1 atm must be > 0 J/kg, got 0.0"),
    (lambda: sets.WATER_1ATM.with_(T_crit=300.0), "T_sat must be below T_crit = 300.0 K, got 373.15 K"),
    (lambda: scene()[0].configure_solver(dt=0.0), "time step must be > 0 s, got 0.0 s"),
    (lambda: scene()[0].configure_solver(frame=0.1, substeps=0), "substeps must be a whole number >= 1, got 0"),
    (lambda: scene()[0].configure_solver(frame=0.1, substeps=3.5), "substeps must be a whole number >= 1, got 3.5"),
    (lambda: scene()[0].configure_solver(frame=-0.1), "frame must be > 0 s, got -0.1 s"),
    (lambda: SceneParameters(substeps=3.5), "scene.substeps must be a whole number, got 3.5"),
    (lambda: SiteStorage(n_emit=7.5), "storage.n_emit must be a whole number, got 7.5"),
    (lambda: HeatClock([], evaluations=1.5), "evaluations must be a whole number >= 1, got 1.5"),
    (lambda: Ledger(scene()[0], every=2.5), "every must be a whole number >= 1 step, got 2.5"),
    (lambda: BoilingScheme(["fluid"], [], dim=2.0, spacing=DX), "dim must be 2 or 3, got 2.0"),
    (lambda: BoilingScheme(["fluid"], [], dim=2, spacing=DX, quality="standart"),
     "no quality 'standart'; did you mean 'standard'"),
    (lambda: BoilingScheme(["fluid"], [], dim=2, spacing=DX, viscos=None),
     "no effect in BoilingScheme: 'viscos'; did you mean 'viscosity'"),
    (lambda: BoilingScheme(["fluid"], [], dim=2, spacing=DX, kernel=CubicSpline(dim=3)),
     "the kernel must have 2 dimensions like the scheme, got 3"),
    (lambda: DamBreakParameters(dim=2.0), "scene.dim must be one of 2, 3; got 2.0"),
    (lambda: Buoyancy(form="papper"), "buoyancy.form must be one of .*; got 'papper'; did you mean 'paper'"),
    (lambda: Venting().replaced(mod="lid"), "has no parameter mod; did you mean 'mode'"),
    (lambda: effects_in_mode("dinamic", {}), "no mode 'dinamic'; did you mean 'dynamic'"),
], ids=lambda value: value if isinstance(value, str) else "")
def test_argument_is_refused(build, message):
    with pytest.raises(ValueError, match=message):
        build()
