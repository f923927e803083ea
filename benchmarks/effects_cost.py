"""Cost of each effect: time per step and neighbour sweeps, when it is added alone and when the full model lacks it.

    python benchmarks/effects_cost.py [--quick] [--json FILE]

A pool of water with bubbles is settled once. Every set of effects starts from this state and takes the same number of
steps. The sets take turns in several rounds. Times are medians, and ratios are to the density constraint alone in the
same round. The first run compiles about a hundred modules, which takes half an hour on two cores.

The exit status is 1 unless (a) BoilingScheme without effects generates the source and the properties of PBFScheme, and
(b) the full model, in water too cold to boil, takes as many sweeps over fluid and walls per step as motion with heat.
It has one more sweep over the few sites, which attract cold water too. The times of both are printed.
"""
import argparse
import os
import sys
import time
import warnings

from pysph_boiling.threads import WAITING

os.environ.update(WAITING)

import machine
import numpy as np
from compyle.config import get_config
from pysph.sph.acceleration_eval import make_acceleration_evals
from pysph.sph.sph_compiler import SPHCompiler
from rich.console import Console
from rich.progress import track

from pysph_boiling.device import neighbour_search
from pysph_boiling.equations.lean import HostSum, PBFSweepsLean
from pysph_boiling.evaluation.stress.scenes import EVERYTHING
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import box_vessel, fluid_block, site_array, sites_on_base
from pysph_boiling.phases import Phase
from pysph_boiling.report.options import add_report_options
from pysph_boiling.report.terminal import show
from pysph_boiling.runs.ledger import write_json
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import BoxContainer, DynamicNucleation, Heater
from pysph_boiling.schemes.pbf import PBFScheme
from pysph_boiling.schemes.solver import edited

DX = 0.004
WITHOUT_BOILING = ("container", "viscosity", "heat", "heater", "loss", "source", "convection")  # acts in cold water
T_SAT = WATER_1ATM.T_sat


def full_model(upper):
    """Every effect at once, slot -> effect, in the order of the slots."""
    effects = EVERYTHING | dict(container=BoxContainer(upper=upper), heater=Heater(temperature=T_SAT + 20.0),
                                dynamic_nucleation=DynamicNucleation(superheat_limit=8.0))
    return {slot: effects[slot] for slot in BoilingScheme.slots if slot in effects}


def closure(slot, effects):
    """The effect of a slot and all effects that it requires, in the order of the slots."""
    wanted = {slot}
    while True:
        more = {needed for name in wanted for needed in effects[name].requires if needed != "density"} - wanted
        if not more:
            return {name: effect for name, effect in effects.items() if name in wanted}
        wanted |= more


def without(slot, effects):
    """The set without the effect of a slot and without those that require it."""
    gone = {slot}
    while True:
        more = {name for name, effect in effects.items() if gone & set(effect.requires)} - gone
        if not more:
            return {name: effect for name, effect in effects.items() if name not in gone}
        gone |= more


class Pool:
    """A scheme of one set of effects on the pool, stepped by hand from a state that can be restored."""

    def __init__(self, effects, width, fill, cls=BoilingScheme):
        self.upper = (width * DX, width * DX, 1.5 * fill * DX)
        sites = ["sites"] if "preset_nucleation" in effects else []
        density = dict(rho0=WATER_1ATM.rho_l) if cls is PBFScheme else {}
        self.scheme = cls(["fluid"], ["wall"], dim=3, spacing=DX, sites=sites, **effects, **density)
        common = dict(spacing=DX, dim=3, rho0=self.scheme.rho0)
        self.fluid = fluid_block((0.0, 0.0, 0.0), (*self.upper[:2], fill * DX), jitter=0.01, **common)
        self.arrays = [self.fluid, box_vessel((0.0,) * 3, self.upper, kernel=self.scheme.kernel, heated_fraction=0.7,
                                              **common)]
        if sites:
            points = sites_on_base(4, lower=(0.2 * width * DX,) * 2 + (0.0,), upper=(0.8 * width * DX,) * 3, dim=3)
            self.arrays.append(site_array(points, reach=2.4 * DX, spacing=DX))
        self.scheme.setup_properties(self.arrays)
        self.scheme.configure_solver(tf=1e9)
        self.equations = self.scheme.get_equations()

    def compile(self):
        """Compile the stages, so that steps can be taken."""
        self.solver = self.scheme.get_solver()
        nnps = neighbour_search(self.arrays, dim=3, radius_scale=self.scheme.kernel.radius_scale, fixed_h=True)
        self.solver.set_parallel_manager(None)
        self.solver.setup(self.arrays, self.equations, nnps)
        self.tools = self.scheme.tools()
        self.constants = {name: values.get_npy_array().copy() for name, values in self.fluid.constants.items()}
        self.constants["settled"][:] = 1.0  # the state is
        return self

    def sources(self):
        """Source of every stage, as it is compiled."""
        compiler = SPHCompiler(make_acceleration_evals(self.arrays, self.equations, self.scheme.kernel),
                               self.scheme.solver.integrator)
        return [edited(source) for source in (
            compiler._get_code(), *(helper.get_code() for helper in compiler.acceleration_eval_helpers[1:]))]

    def start(self, state, boiling):
        """Take positions and velocities from ``state``; with bubbles and superheat if ``boiling``."""
        pa, n = self.fluid, len(state["x"])
        if pa.get_number_of_particles() > n:
            pa.remove_particles(np.arange(n, pa.get_number_of_particles()))
        elif pa.get_number_of_particles() < n:
            pa.add_particles(x=np.zeros(n - pa.get_number_of_particles()))
        for name, array in pa.properties.items():
            array.get_npy_array()[:] = state.get(name, 0)
        for name in ("tag", "pid"):
            pa.get(name, only_real_particles=False)[:] = 0
        for name, values in self.constants.items():  # among them the number of sweeps with which a step begins
            pa.constants[name].get_npy_array()[:] = values
        if "swell" in pa.properties:
            pa.swell[:] = 1.0
        if "e" not in pa.properties:
            return
        T = np.full(n, T_SAT - 40.0)
        if boiling:
            T += 38.0 + 14.0 * np.exp(-state["z"] / (4.0 * DX))
        self.scheme.set_temperature(pa, T)
        if boiling and "phase" in pa.properties:
            vapour = bubbles(state, self.upper)
            pa.phase[vapour] = Phase.VAPOUR
            pa.e[vapour] = WATER_1ATM.L * np.where(np.arange(vapour.sum()) % 3, 1.0, 0.9)

    def steps(self, n):
        """Seconds per step of ``n`` steps."""
        begin = time.perf_counter()
        for _ in range(n):
            for tool in self.tools:
                tool.pre_step(self.solver)
            self.solver.integrator.step(self.solver.t, self.scheme.dt)
            for tool in self.tools:
                tool.post_step(self.solver)
        return (time.perf_counter() - begin) / n

    def sweeps(self, n=1):
        """Neighbour sweeps of the next ``n`` steps, per step: dict of (destination, source) -> sweeps.

        A lean sum counts as what it stands for: the density sweeps as two sums over neighbours each.
        """
        integrator = self.scheme.integrator

        def counted(name):
            return float(self.fluid.constants[name].get_npy_array()[-1]) if name in self.fluid.constants else 0.0

        count = {}
        for _ in range(n):
            before, rounds = dict(integrator.runs), counted("bubble_rounds")
            self.steps(1)
            repeats = {"density": counted("sweeps"), "bubbles": counted("bubble_rounds") - rounds}
            for name, groups in zip(integrator.stages, self.equations.groups):
                runs = integrator.runs[name] - before[name]
                for parent in groups:
                    times = repeats[name] if parent.iterate else runs
                    for group in parent.equations:
                        pairs = {(equation.dest, source) for equation in group.equations
                                 for source in equation.sources or () if hasattr(equation, "loop")
                                 or hasattr(equation, "loop_all") or isinstance(equation, HostSum)}
                        sums = 2 if any(isinstance(equation, PBFSweepsLean) for equation in group.equations) else 1
                        for pair in pairs:
                            count[pair] = count.get(pair, 0.0) + sums * times / n
        return count


def bubbles(state, upper):
    """Mask of the vapour at the start: four balls with a radius of 2.2 spacings."""
    inside = np.zeros(len(state["x"]), bool)
    for fx, fy, fz in ((0.3, 0.3, 0.12), (0.7, 0.3, 0.25), (0.3, 0.7, 0.35), (0.7, 0.7, 0.5)):
        inside |= ((state["x"] - fx * upper[0]) ** 2 + (state["y"] - fy * upper[1]) ** 2
                   + (state["z"] - fz * upper[2]) ** 2) < (2.2 * DX) ** 2
    return inside


def same_build(width, fill):
    """Claim (a): whether BoilingScheme without effects builds what PBFScheme builds."""
    boiling, pbf = Pool({}, width, fill), Pool({}, width, fill, PBFScheme)
    return boiling.sources() == pbf.sources() and set(boiling.fluid.properties) == set(pbf.fluid.properties)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    add_report_options(parser, quick="a smaller pool, fewer repeats", report=None)
    options = parser.parse_args()
    width, fill, steps, rounds, settle = (14, 12, 4, 3, 60) if options.quick else (28, 26, 5, 5, 200)
    get_config().use_openmp = True
    warnings.simplefilter("ignore")
    console = Console()
    console.print(machine.load())

    upper = (width * DX, width * DX, 1.5 * fill * DX)
    full = full_model(upper)
    sets = {"PBF": {}}
    sets.update((f"+ {slot}", closure(slot, full)) for slot in full)
    sets.update((f"without {slot}", without(slot, full)) for slot in full)
    sets["motion and heat"] = {slot: full[slot] for slot in WITHOUT_BOILING}
    sets["full"] = full
    pools = {name: Pool(effects, width, fill).compile() for name, effects in track(
        sets.items(), description="compiling", console=console)}
    rest = pools["PBF"]
    rest.steps(settle)
    state = {name: rest.fluid.get(name).copy() for name in ("x", "y", "z", "u", "v", "w", "m", "h", "rho", "uid")}

    runs = {name: (pool, True) for name, pool in pools.items()}
    runs.update((f"idle {name}", (pools[name], False)) for name in ("full", "without expansion", "motion and heat"))
    times, sweeps = {name: [] for name in runs}, {}
    for _ in track(range(rounds), description="measuring", console=console):
        for name, (pool, boiling) in runs.items():
            pool.start(state, boiling)
            sweeps[name] = pool.sweeps()
            times[name].append(pool.steps(steps))
    ms = {name: 1e3 * float(np.median(values)) for name, values in times.items()}
    ratio = {name: float(np.median(np.divide(values, times["PBF"]))) for name, values in times.items()}

    def swept(name, *sources):
        return sum(n for (_, source), n in sweeps[name].items() if not sources or source in sources)

    rows, cells = [], []
    for slot in full:
        base = {name for name in closure(slot, full)} - {slot}
        below = next((other for other, effects in sets.items() if set(effects) == base), None)
        own = ms[f"+ {slot}"] - ms[below] if below else None
        saves = ms["full"] - ms[f"without {slot}"]
        rows.append(dict(effect=slot, added=ms[f"+ {slot}"], own=own, without=ms[f"without {slot}"], saves=saves))
        cells.append((slot, f"{ms[f'+ {slot}']:.1f}", "" if own is None else f"{own:+.1f}",
                      f"{ms[f'without {slot}']:.1f}", f"{saves:+.1f}"))
    show(console, ("effect", "added alone [ms]", "of which its own", "full without it [ms]", "saves"), cells,
         title=f"{len(state['x'])} particles, {bubbles(state, upper).sum()} of them vapour; bare PBF "
               f"{ms['PBF']:.1f} ms a step, full model {ms['full']:.1f} ms")
    console.print(f"full model, boiling: {swept('full'):.0f} neighbour sweeps a step")

    claims = {
        "BoilingScheme without effects builds what PBFScheme builds": same_build(width, fill),
        "full model before anything boils: as many sweeps over fluid and walls as motion with heat":
            swept("idle full", "fluid", "wall") == swept("idle motion and heat", "fluid", "wall"),
    }
    idle = {name: float(np.median(np.divide(times[f"idle {name}"], times["idle motion and heat"])))
            for name in ("full", "without expansion")}
    console.print(f"before anything boils: motion with heat {ms['idle motion and heat']:.1f} ms and "
                  f"{swept('idle motion and heat'):.0f} sweeps a step")
    for name, what in (("full", "full model"), ("without expansion", "the same without expansion")):
        console.print(f"  {what}: {ms[f'idle {name}']:.1f} ms and {swept(f'idle {name}'):.0f} sweeps "
                      f"({swept(f'idle {name}', 'sites'):.0f} over sites): {idle[name] - 1.0:+.1%} of time")
    for claim, holds in claims.items():
        console.print(f"{'holds' if holds else 'FAILS'}: {claim}")
    if options.json:
        named = {name: {f"{dest}<-{source}": n for (dest, source), n in row.items()} for name, row in sweeps.items()}
        write_json(options.json, dict(particles=len(state["x"]), ms=ms, ratio=ratio, rows=rows, claims=claims,
                                      idle=idle, sweeps=named))
    return 0 if all(claims.values()) else 1


if __name__ == "__main__":
    sys.exit(main())
