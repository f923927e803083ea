"""What happens to a bubble at the surface: it leaves the simulation, or a lid returns it as liquid."""
import numpy as np
from pysph.solver.tools import Tool

from pysph_boiling.particles import NO_BUBBLE
from pysph_boiling.phases import Phase, enthalpy, temperature
from pysph_boiling.schemes.effects import gather

__all__ = ["VentingTool"]


class VentingTool(Tool):
    """Vents whole bubbles after the step, and books their mass and enthalpy.

    A bubble leaves once ``share`` of its particles have been free for ``steps`` steps. Mode ``"lid"`` returns its
    particles, where they are and at rest, as liquid at ``T_feed``; the difference of enthalpy has left through the
    lid. Mode ``"remove"`` takes them out; what they had summed up (heater energy, counts) is carried on as a constant.
    """

    def __init__(self, effect, scheme):
        self.effect, self.scheme = effect, scheme
        self.material = scheme.material
        feed = self.material.T_sat if effect.T_feed is None else effect.T_feed
        self.e_feed = float(enthalpy(feed, self.material))
        self.departures = []  # (time [s], particles in the bubble)

    def post_step(self, solver):
        arrays = self.scheme.arrays
        if not any(bool(np.any(pa.get("free", only_real_particles=True) >= self.effect.steps)) for pa in arrays):
            return
        label, free = gather(arrays, "bubble"), gather(arrays, "free")
        bubble = (label != NO_BUBBLE) & (gather(arrays, "phase") == Phase.VAPOUR)
        names, index, size = np.unique(label[bubble], return_inverse=True, return_counts=True)
        released = np.bincount(index, weights=free[bubble] >= self.effect.steps, minlength=len(names))
        leaving = (released > 0) & (released >= self.effect.share * size)
        if not leaving.any():
            return
        gone = np.zeros(len(label), bool)
        gone[bubble] = leaving[index]
        sizes = size[leaving]
        self.departures += [(solver.t + solver.dt, int(n)) for n in sizes]
        first = 0
        for number, pa in enumerate(arrays):
            n = pa.get_number_of_particles(True)
            self._vent(pa, np.flatnonzero(gone[first:first + n]))
            if number == 0:
                pa.n_bubbles_vented[0] += len(sizes)
            first += n

    def _vent(self, pa, who):
        if len(who) == 0:
            return
        m, e = pa.m[who], pa.e[who]
        pa.n_vented[0] += len(who)
        if self.effect.mode == "lid":
            pa.energy_vented[0] += float(np.sum(m * (e - self.e_feed)))
            pa.e[who] = self.e_feed
            pa.phase[who] = Phase.SUPERHEATED if self.e_feed >= 0.0 else Phase.LIQUID
            pa.T[who] = temperature(pa.e[who], pa.phase[who], self.material)
            for name in ("u", "v", "w", "free", "bubble_n"):
                if name in pa.properties:
                    pa.get(name)[who] = 0
            pa.bubble[who] = NO_BUBBLE
            if "e_lat" in pa.properties:
                pa.e_lat[who] = 0.0
            return
        pa.energy_vented[0] += float(np.sum(m * e))
        pa.mass_vented[0] += float(np.sum(m))
        for constant, values in pa.constants.items():
            if constant.startswith("carried_"):
                values.get_npy_array()[0] += float(np.sum(pa.get(constant.removeprefix("carried_"))[who], dtype=float))
        pa.remove_particles(who)

