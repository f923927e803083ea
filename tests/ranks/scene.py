"""A small scene with everything that ranks could get wrong, and a log of what lay across them.

    mpirun -n 4 python tests/ranks/scene.py --case wide -d DIR
"""
import json
import os
import resource
import signal
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling import cli
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.parallel import ranks
from pysph_boiling.particles import fluid_block, site_array, wall_array
from pysph_boiling.phases import Phase
from pysph_boiling.runs.application import SceneApplication, SceneParameters
from pysph_boiling.schemes.boiling import BoilingScheme
from pysph_boiling.schemes.effects import (
    AmbientLoss,
    BoxContainer,
    BubbleLabels,
    Buoyancy,
    Cohesion,
    Condensation,
    Convection,
    DensityConstraint,
    Drag,
    DynamicNucleation,
    Expansion,
    HeatConduction,
    Heater,
    LatentPooling,
    Oscillation,
    PhaseChange,
    PresetNucleation,
    Refill,
    SiteAdhesion,
    Venting,
    XSPHViscosity,
    param,
)

DX = 0.002
SIZES = {"wide": (96, 12), "left": (96, 12), "chain": (1000, 5), "tiny": (2, 2)}  # of the water, in spacings
DEADLY = 6  # step in which a rank dies
LATE = 0.5  # s


@dataclass(frozen=True, kw_only=True)
class RankParameters(SceneParameters):
    """Which arrangement, and what goes wrong."""

    duration: float = param(1.0, "s", "simulated time", above=0.0)
    frame: float = param(0.005, "s", "time between two outputs", above=0.0)
    substeps: int = param(5, "-", "steps in a frame", low=1)
    case: str = param("wide", "-", "arrangement", choices=tuple(SIZES))
    dies: str = param("no", "-", "how the last rank dies", choices=("no", "killed", "error", "nan", "full"))


class Log(Tool):
    """What lay across ranks, step by step; written by the first rank."""

    def __init__(self, application):
        self.application, self.rows = application, []
        self.owner, self.fired = {}, {}  # by uid, one step before

    def post_step(self, solver):
        (pa,) = self.application.scheme.arrays
        columns = {name: pa.get(name) for name in ("uid", "x", "phase", "bubble", "member", "fired")}
        columns["rank"] = np.full(len(columns["uid"]), ranks.rank())
        columns = {name: ranks.gather(values)[0] for name, values in columns.items()}
        owner, fired = (dict(zip(columns["uid"].tolist(), columns[name].tolist())) for name in ("rank", "fired"))
        vapour = columns["phase"] == Phase.VAPOUR
        spans = [len(set(columns["rank"][vapour & (columns["bubble"] == label)])) for label in
                 np.unique(columns["bubble"][vapour])]
        members = np.flatnonzero(columns["member"] > 0)
        new = [number > self.fired.get(uid, 0) for uid, number in fired.items()]
        centres = columns["x"][new]
        across = sum(len(set(columns["rank"][members[np.abs(columns["x"][members] - x) < 3.0 * DX]])) > 1
                     for x in centres)
        self.rows.append({
            "migrated": sum(owner[uid] != rank for uid, rank in self.owner.items() if uid in owner),
            "bubble_ranks": max(spans, default=0), "bursts_across": int(across),
            "particles": np.bincount(columns["rank"], minlength=ranks.size()).tolist(),
            "vapour": np.bincount(columns["rank"][vapour], minlength=ranks.size()).tolist(),
            "search": type(solver.nnps).__name__, "sums": type(self.application.scheme.reductions).__name__})
        self.owner, self.fired = owner, fired
        if ranks.rank() == 0:
            Path(self.application.output_dir, "ranks.json").write_text(json.dumps(self.rows))
        self.die(solver, pa)

    def die(self, solver, pa):
        """The last rank dies, or computes nonsense."""
        dies = self.application.parameters.dies
        if solver.count + 1 == DEADLY and ranks.rank() == ranks.size() - 1:
            if dies == "killed":
                os.kill(os.getpid(), signal.SIGKILL)
            if dies == "error":
                raise ValueError("the last rank alone has failed")
            if dies == "nan":
                pa.u[0] = np.nan
            if dies == "full":  # its disk, from now on
                resource.setrlimit(resource.RLIMIT_FSIZE, (4096, resource.RLIM_INFINITY))


class RankScene(SceneApplication):
    """See the module."""

    Parameters = RankParameters
    title = "ranks"

    def size(self, p):
        return np.array(SIZES[p.case]) * DX

    def make_scheme(self, p):
        width, height = self.size(p)
        return BoilingScheme(
            ["fluid"], ["wall"], dim=2, spacing=DX, material=WATER_1ATM, sites=["sites"],
            density=DensityConstraint(settle=3),
            container=BoxContainer(upper=(width + 4 * DX, 2.0 * height + 4 * DX, 0.0)), viscosity=XSPHViscosity(),
            heat=HeatConduction(time_scaling=800.0), heater=Heater(flux=2e4),
            loss=AmbientLoss(), phases=PhaseChange(), preset_nucleation=PresetNucleation(),
            dynamic_nucleation=DynamicNucleation(superheat_limit=100.0, radius=2.4), bubbles=BubbleLabels(),
            condensation=Condensation(), pooling=LatentPooling(), buoyancy=Buoyancy(), cohesion=Cohesion(),
            adhesion=SiteAdhesion(), drag=Drag(), convection=Convection(), expansion=Expansion(),
            oscillation=Oscillation(form="hysteresis", min_particles=5),
            venting=Venting(mode="remove", free_fraction=0.6, free_steps=1), refill=Refill(rate=0.5))

    def make_particles(self, p, scheme):
        width, height = self.size(p)
        common = dict(spacing=DX, dim=2, rho0=scheme.rho0)
        fluid = fluid_block((0.0, 0.0), (width, height), jitter=0.05, **common)
        fluid.uid[:] = np.random.default_rng(1).permutation(len(fluid.uid))  # labels are the smallest uid, anywhere
        floor = np.zeros((max(2, int(width / DX)), 3))
        floor[:, 0], floor[:, 1] = (np.arange(len(floor)) + 0.5) * DX, -0.5 * DX
        sites = np.array([[0.3 * width, 0.0, 0.0], [0.7 * width, 0.0, 0.0]])
        return [fluid, wall_array(floor, kernel=scheme.kernel, heated=np.ones(len(floor)), **common),
                site_array(sites, reach=4.8 * DX, spacing=DX)]

    def start(self, arrays, p, scheme):
        (width, height), fluid, material = self.size(p), arrays["fluid"], scheme.material
        x, y = fluid.x / DX, fluid.y / DX
        columns, rows = width / DX, height / DX
        middle = np.abs(x - 0.5 * columns)
        T = np.full(len(x), material.T_sat + 2.0)
        if p.case == "wide":
            T[(middle < 4.0) & (y > 6.0)] += 150.0  # bursts on the border between two ranks, with 2 and with 4
        scheme.set_temperature(fluid, T)
        vapour = {"wide": (np.abs(y - 3.0) < 1.0) & (x > 2.0) & (x < columns - 2.0),
                  "left": (x < 0.2 * columns) & (y < rows - 4.0),
                  "chain": np.abs(y - 1.5) < 0.5, "tiny": np.zeros(len(x), bool)}[p.case]
        cold = (p.case == "wide") & (np.abs(x - 0.25 * columns) < 3.0) & (np.abs(y - 7.0) < 2.0)
        top = (p.case == "wide") & (np.abs(x - 0.75 * columns) < 3.0) & (y > rows - 2.0)
        fluid.e[vapour | top] = material.L
        fluid.e[cold] = 0.6 * material.L  # lacks heat: part of it condenses
        fluid.phase[vapour | top | cold] = int(Phase.VAPOUR)
        if p.case != "tiny":
            fluid.u[:] = 0.2 * np.sin(np.pi * x / columns)  # so that particles move from rank to rank

    def check_folder(self):
        names = super().check_folder()
        if self.parameters.case == "tiny":  # the first rank is late to say which files are the run's
            claim = self.manifest.claim
            self.manifest.claim = lambda *claimed: (time.sleep(LATE), claim(*claimed))
        return names

    def create_tools(self):
        return [Log(self), *super().create_tools()]

    def check_final(self):
        self.check_ledger()


if __name__ == "__main__":
    application = RankScene(fname="ranks")
    try:
        application.run(sys.argv[1:])
    except Exception as error:
        sys.exit(cli.report(error))
