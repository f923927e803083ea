"""The input and output of a run of any code: a file with the job, and a file with positions and times.

A worker is called as ``python worker.py JOB OUT``. This module serves all codes, and only needs NumPy.
"""
import json
import sys
from time import perf_counter, process_time

import numpy as np


class Job:
    """Scene and settings of one run, and the record of its steps.

    Attributes: ``fluid``, ``wall`` (n, 3) [m]; ``volume`` (m,) [m^3] of the boundary particles; ``spacing``, ``h`` [m];
    ``size`` (3,) [m]; ``dt``, ``duration`` [s]; ``threads``; ``settings`` of the code, a dictionary; ``cpu_time``:
    count the seconds of the processor, not those on the wall.
    """

    def __init__(self, path):
        with np.load(path) as data:
            for name in ("fluid", "wall", "volume", "size"):
                setattr(self, name, data[name])
            self.__dict__.update(json.loads(str(data["job"])))
        self.steps = round(self.duration / self.dt)
        self.every = max(1, self.steps // self.snapshots)
        self.done, self.seconds, self.sweeps = 0, [], []
        self.times, self.positions, self.neighbours = [], [], []
        self.clock = process_time if self.cpu_time else perf_counter

    def begin_now(self):
        """The next step begins now."""
        self.begin = self.clock()

    def step_done(self, sweeps, positions, neighbours):
        """To be called after each step; ``positions()`` and ``neighbours()`` are called where a snapshot is due.

        Neither they nor this function count as time of the step. Neighbours are asked for after the first step, within
        the support then, and after the last.
        """
        self.seconds.append(self.clock() - self.begin)
        self.sweeps.append(float(sweeps))
        self.done += 1
        if self.done == 1 or self.done == self.steps:
            self.neighbours.append(float(neighbours()))
        if self.done % self.every == 0 or self.done == self.steps:
            self.times.append(self.done * self.dt)
            self.positions.append(np.array(positions(), dtype=float)[:, :3])
        self.begin_now()

    def write(self, path, **facts):
        np.savez(path, seconds=self.seconds, sweeps=self.sweeps, times=self.times, positions=self.positions,
                 neighbours=self.neighbours, facts=json.dumps(facts))


def arguments():
    """The job of this process, and where its record goes."""
    return Job(sys.argv[1]), sys.argv[2]
