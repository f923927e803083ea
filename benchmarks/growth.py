"""Growth of one bubble in superheated liquid, against the similarity solution R = 2 b sqrt(alpha t).

A disc or a sphere of vapour in liquid that is superheated far away, on particles that stand still, at equal density.
The start is the exact profile at a radius of a few spacings; then the bubble grows until its radius is ``growth`` times
as large. What it has gained by then says how the model's interface behaves: whether latent heat is pooled, how far
the vapour reaches as a site, and what becomes of stored heat when the bubble departs in the end.

    python benchmarks/growth.py [--quick] [--json FILE] [--markdown FILE]

Exits with 1 where a claim that the documentation makes does not hold.
"""
import argparse
import itertools
import json
import math
import sys
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from time import perf_counter

import numpy as np
from compyle.config import get_config
from pysph.base.nnps import LinkedListNNPS
from rich.console import Console
from rich.markup import escape
from rich.table import Table
from scipy.optimize import brentq
from scipy.spatial import cKDTree
from scipy.special import erfc, erfcx, exp1

from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.particles import fluid_block
from pysph_boiling.phases import Phase, temperature
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import BubbleLabels, HeatConduction, LatentPooling, PhaseChange

DX, SUPERHEAT = 1e-3, 20.0  # spacing [m], superheat far away [K]
OFFSET = np.array([0.13, 0.29, 0.37])  # of the centre from a lattice corner, in spacings: no accidental symmetry


def growth_constant(dim, stefan):
    """b of R = 2 b sqrt(alpha t) for a disc (2) or a sphere (3) at equal density; ``stefan`` = c dT/L."""
    left = {2: lambda b: b * b * math.exp(b * b) * exp1(b * b),
            3: lambda b: 2.0 * b * b * (1.0 - math.sqrt(math.pi) * b * erfcx(b))}[dim]
    return brentq(lambda b: left(b) - stefan, 1e-6, 10.0)


def profile(r, R, b, dim):
    """(T - T_sat)/(T_far - T_sat) at distance ``r`` from the centre when the bubble has radius ``R``; 0 inside."""
    s = np.maximum(b * np.asarray(r) / R, b)
    shape = {2: lambda s: exp1(s * s),
             3: lambda s: np.exp(-s * s) / s - math.sqrt(math.pi) * erfc(s)}[dim]
    return 1.0 - shape(s) / shape(b)


def ball(radius, dim):
    """Area of a disc or volume of a sphere."""
    return math.pi * radius**2 if dim == 2 else 4.0 / 3.0 * math.pi * radius**3


@dataclass(frozen=True)
class Growth:
    """One run. Lengths in spacings."""

    dim: int = 2
    stefan: float = 0.3
    radius: float = 4.0  # at the start
    growth: float = 2.5  # final radius over that
    jitter: float = 0.0  # of the particles, in spacings
    pooled: bool = True
    interrupt: str = "hold"
    vapour_as_site: bool = True
    kinetic_radius: float = 1.4

    def scheme(self):
        water = WATER_1ATM
        material = water.with_(name="test fluid", L=water.c_l * SUPERHEAT / self.stefan, c_v=water.c_l,
                               k_v=1e-6 * water.k_l)  # vapour takes no heat, as in the formula
        pooled = dict(bubbles=BubbleLabels(), pooling=LatentPooling()) if self.pooled else {}
        return BoilingScheme(
            ["fluid"], [], dim=self.dim, spacing=DX, material=material, density=None, heat=HeatConduction(),
            phases=PhaseChange(interrupt=self.interrupt, vapour_as_site=self.vapour_as_site,
                               kinetic_radius=self.kinetic_radius), **pooled)

    def start(self, scheme, b):
        """Particles with the exact profile: vapour in the nearest of them, what is left over stored next to it."""
        last = self.growth * self.radius
        reach = DX * math.ceil(last * {2: 2.0, 3: 1.7}[self.dim] / b)  # (T_far - T)/(T_far - T_sat) < 0.5 %
        centre = DX * OFFSET * (np.arange(3) < self.dim)
        fluid = fluid_block((-reach,) * 3, (reach,) * 3, spacing=DX, dim=self.dim, rho0=scheme.rho0,
                            jitter=self.jitter, inside=lambda p: np.linalg.norm(p - centre, axis=1) < reach)
        scheme.setup_properties([fluid])
        r = np.linalg.norm(self.points(fluid) - centre, axis=1)
        L, volume = scheme.material.L, ball(self.radius, self.dim)
        vapour = np.argsort(r)[:int(volume)]
        fluid.e[:] = scheme.material.c_l * SUPERHEAT * profile(r, self.radius * DX, b, self.dim)
        fluid.phase[:] = Phase.SUPERHEATED
        fluid.e[vapour], fluid.phase[vapour] = L, Phase.VAPOUR
        near = np.argsort(r)[int(volume):][:int(2.0 * self.dim * self.radius)]
        fluid.e[near] += (volume - int(volume)) * L / len(near)
        fluid.T[:] = temperature(fluid.e, fluid.phase, scheme.material)
        return fluid

    @staticmethod
    def points(fluid):
        return np.stack([fluid.x, fluid.y, fluid.z], -1)

    def run(self):
        """A dict of what was measured."""
        begun = perf_counter()
        get_config().use_openmp = True
        scheme, b = self.scheme(), growth_constant(self.dim, self.stefan)
        fluid, material = self.start(scheme, b), scheme.material
        alpha = material.k_l / (material.rho_l * material.c_l)
        times = (DX * self.radius * np.array([1.0, self.growth]) / (2.0 * b)) ** 2 / alpha
        steps = math.ceil(np.ptp(times) / scheme.effects["heat"].step_limit(scheme.scene()))
        scheme.configure_solver(dt=np.ptp(times) / steps, tf=1.0)
        equations, solver = scheme.get_equations(), scheme.get_solver()
        nnps = LinkedListNNPS(dim=self.dim, particles=[fluid], radius_scale=scheme.kernel.radius_scale, cache=True,
                              fixed_h=True)
        solver.set_parallel_manager(None)
        solver.setup([fluid], equations, nnps)
        energy, hottest = np.sum(fluid.m * fluid.e), 0.0

        def step():
            solver.integrator.step(0.0, scheme.dt)
            return (np.max(fluid.T) - material.T_sat) / SUPERHEAT - 1.0

        for _ in range(steps):
            hottest = max(hottest, step())
        vapour, stored = fluid.phase == Phase.VAPOUR, fluid.phase == Phase.TRANSITION
        place = self.points(fluid)
        place -= place[vapour].mean(0)
        exact, found = ball(self.growth * self.radius, self.dim), float(vapour.sum())
        latent = found + fluid.e[stored].sum() / material.L
        result = dict(
            asdict(self), particles=len(fluid.e), steps=steps, vaporised=int(fluid.vaporised.sum()),
            error=found / exact - 1.0, ahead=self.growth * self.radius * ((found / exact) ** (1.0 / self.dim) - 1.0),
            latent_error=latent / exact - 1.0, roundness=roundness(place, vapour),
            stored=(latent - found) / exact, hottest=hottest, interrupted=int(fluid.interrupted.sum()))
        before = np.sum(fluid.m * fluid.e)
        fluid.e[vapour], fluid.phase[vapour] = 0.0, Phase.SUPERHEATED  # the bubble departs, liquid takes its place
        energy += np.sum(fluid.m * fluid.e) - before
        step()  # the interruption
        hidden = np.minimum(fluid.e, fluid.e_lat).sum() if self.interrupt == "hold" else 0.0
        result.update(departure=max(step() for _ in range(20)), hidden=hidden / (exact * material.L))
        result["energy"] = float(abs(np.sum(fluid.m * fluid.e) / energy - 1.0))
        result["seconds"] = perf_counter() - begun
        return {name: value.item() if isinstance(value, np.generic) else value for name, value in result.items()}


def roundness(place, vapour):
    """Standard deviation of the radius of the outermost vapour, over its mean: 0 for a circle or a sphere."""
    inner = place[vapour]
    distance, _ = cKDTree(place[~vapour]).query(inner)
    r = np.linalg.norm(inner[distance < 1.3 * DX], axis=1)
    return float(np.std(r) / np.mean(r))


# --- the table --------------------------------------------------------------------------------------------------------

BASE = Growth()
SPHERE = replace(BASE, dim=3, growth=2.0)


def quick_cases():
    """Two resolutions in 2-D, pooled and not; held and converted heat."""
    for radius, pooled in itertools.product((2.0, 4.0), (True, False)):
        yield replace(BASE, radius=radius, pooled=pooled)
    for pooled in (True, False):
        yield replace(BASE, radius=2.0, pooled=pooled, interrupt="convert")


def all_cases():
    """The grid that the defaults were chosen from."""
    yield from quick_cases()
    yield replace(BASE, radius=2.0, vapour_as_site=False)
    for pooled, reach, jitter, radius in itertools.product((True, False), (1.0, 1.2, 1.4, 1.5), (0.0, 0.2), (2.0, 4.0)):
        yield replace(BASE, pooled=pooled, kinetic_radius=reach, jitter=jitter, radius=radius)
    for pooled, reach, radius in itertools.product((True, False), (1.4, 1.5), (2.0, 4.0)):
        yield replace(SPHERE, pooled=pooled, kinetic_radius=reach, radius=radius)
    for reach, radius in itertools.product((1.2, 1.4, 1.5), (2.0, 4.0)):
        yield replace(SPHERE, kinetic_radius=reach, radius=radius, jitter=0.2)
    for pooled in (True, False):
        yield replace(BASE, radius=2.0, stefan=0.1, pooled=pooled)
    for pooled in (True, False):
        yield replace(BASE, radius=8.0, pooled=pooled)


COLUMNS = (  # heading, what a row shows
    ("dim", lambda row: f"{row['dim']}"),
    ("St", lambda row: f"{row['stefan']:g}"),
    ("R [dx]", lambda row: f"{row['radius']:g} to {row['radius'] * row['growth']:g}"),
    ("jitter", lambda row: f"{row['jitter']:g}"),
    ("pooled", lambda row: "yes" if row["pooled"] else "no"),
    ("interrupted", lambda row: row["interrupt"]),
    ("reach [dx]", lambda row: f"{row['kinetic_radius']:g}" if row["vapour_as_site"] else "off"),
    ("vapour", lambda row: f"{row['error']:+.1%}"),
    ("ahead [dx]", lambda row: f"{row['ahead']:+.2f}"),
    ("with stored", lambda row: f"{row['latent_error']:+.1%}"),
    ("out of round", lambda row: f"{row['roundness']:.1%}"),
    ("T_max", lambda row: f"{max(row['hottest'], row['departure'], 0.0):.2f}"),
    ("held", lambda row: f"{row['hidden']:.1%}" if row["interrupt"] == "hold" else ""),
)
LEGEND = (
    "vapour: error of its volume; ahead: of its radius; with stored: error of the volume with stored latent heat "
    "counted; out of round: standard deviation of the radius of the outermost vapour; T_max: how far anything gets "
    "hotter than the liquid far away, over its superheat, also after the bubble has departed; held: stored heat that "
    "no temperature shows after the departure, over the latent heat of the exact volume; reach 1: on a lattice, the "
    "last digit decides who is within reach")


def claims(rows):
    """(claim, whether it holds) for every claim that the rows can decide."""
    def find(**wanted):
        return [row for row in rows if all(row[name] == value for name, value in wanted.items())]

    grown = [row for row in rows if row["vapour_as_site"] and row["kinetic_radius"] > 1.0]
    yield "energy is conserved to round-off", all(row["energy"] < 1e-12 for row in rows)
    yield "nothing gets hotter than the liquid far away", all(row["hottest"] < 1e-9 for row in rows)
    yield "pooled bubbles stay round", all(row["roundness"] < 0.08 for row in grown if row["pooled"])
    yield "others grow dendrites", all(row["roundness"] > 0.2 for row in grown if not row["pooled"])
    for dim, jitter, reach in itertools.product((2, 3), (0.0, 0.2), (1.2, 1.4, 1.5)):
        same = dict(dim=dim, jitter=jitter, kinetic_radius=reach, stefan=0.3, interrupt="hold", vapour_as_site=True)
        where = f"{dim}-D, jitter {jitter:g}, reach {reach:g}"
        for pooled in (True, False):
            finer = sorted(find(**same, pooled=pooled), key=lambda row: row["radius"])
            for a, b in itertools.pairwise(row["latent_error"] for row in finer):
                if pooled:
                    yield f"{where}: pooled growth converges", 0.0 < b < 0.65 * a
                else:
                    yield f"{where}: growth without pooling diverges", b > 1.5 * a > 0.0
    for row in find(vapour_as_site=False):
        yield "without vapour as a site nothing grows", row["vaporised"] == 0
    for row in grown:
        if row["interrupt"] == "hold":
            yield "held heat makes nothing hotter", row["departure"] < 1e-9
        elif not row["pooled"]:
            yield "converted heat makes liquid hotter than the liquid far away", row["departure"] > 0.1


def markdown(rows):
    """The table for the documentation."""
    lines = ["| " + " | ".join(heading for heading, _ in COLUMNS) + " |", "|---" * len(COLUMNS) + "|"]
    lines += ["| " + " | ".join(show(row) for _, show in COLUMNS) + " |" for row in rows]
    return "\n".join([*lines, "", LEGEND + ".", ""])


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--quick", action="store_true", help="six runs instead of the whole grid")
    parser.add_argument("--json", metavar="FILE", help="write the rows there")
    parser.add_argument("--markdown", metavar="FILE", help="write the table there")
    options = parser.parse_args(argv)

    cases, rows, console = list(dict.fromkeys(quick_cases() if options.quick else all_cases())), [], Console(width=160)
    for number, case in enumerate(cases, 1):
        rows.append(case.run())
        console.print(f"{number}/{len(cases)} {rows[-1]['seconds']:.0f} s", highlight=False)
    rows.sort(key=lambda row: (row["dim"], -row["stefan"], not row["vapour_as_site"], row["kinetic_radius"],
                               row["interrupt"] != "hold", not row["pooled"], row["jitter"], row["radius"]))
    table = Table(*(escape(heading) for heading, _ in COLUMNS), title="Growth of a bubble in superheated liquid")
    for row in rows:
        table.add_row(*(show(row) for _, show in COLUMNS))
    console.print(table)
    console.print(LEGEND)
    if options.json:
        Path(options.json).write_text(json.dumps(rows, indent=1) + "\n")
    if options.markdown:
        Path(options.markdown).write_text(markdown(rows))
    broken = [claim for claim, holds in claims(rows) if not holds]
    for claim in broken:
        console.print(f"[red]does not hold: {claim}")
    return 1 if broken else 0


if __name__ == "__main__":
    sys.exit(main())
