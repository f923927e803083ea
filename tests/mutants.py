"""Breaks the equations on purpose, one at a time, and sees whether the tests notice: ``make mutants``.

Each :class:`Mutant` is one edit of one kernel: a sign, a factor of 2, a dropped term. It is made in a copy of the
repository, in a temporary folder with a home of its own, where the tests named with it run until one fails. A mutant
that none of them notices has survived, and the command exits with 1. A mutated module compiles anew, so each takes
20 to 60 s, all of them half an hour.
"""
import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import NamedTuple

from pysph_boiling.report.options import add_report_options
from pysph_boiling.runs.jobs import Job, run_job
from pysph_boiling.runs.ledger import write_json

ROOT = Path(__file__).resolve().parents[1]
EQUATIONS, NATIVE = Path("pysph_boiling/equations"), Path("pysph_boiling/native")
LEFT_OUT = shutil.ignore_patterns(".*", "__pycache__", "*_output", "*.egg-info", "docs", "build", "dist")
TIMEOUT = 900  # s; a mutant that hangs is noticed


class Mutant(NamedTuple):
    """An edit of ``equations/<module>.py``, or of a header ``native/<module>``, that one of ``tests`` must notice."""

    module: str
    what: str
    old: str
    new: str
    tests: tuple[str, ...]

    @property
    def path(self):
        """The file, from the root of the repository."""
        return NATIVE / self.module if self.module.endswith(".h") else EQUATIONS / f"{self.module}.py"


def mutants(module, *tests):
    """A function that makes mutants of one module."""
    def mutant(what, old, new):
        return Mutant(module, what, old, new, tests)
    return mutant


pressure = mutants("artificial_pressure", "compiled/test_artificial_pressure.py")
groups = mutants("bubble_groups", "compiled/test_bubble_groups.py")
buoyancy = mutants("buoyancy", "compiled/test_buoyancy.py")
cohesion = mutants("cohesion", "compiled/test_cohesion.py")
pair = mutants("helpers", "compiled/test_cohesion.py")
container = mutants("container", "compiled/test_container.py", "compiled/test_density_constraint.py")
condensation = mutants("condensation", "compiled/test_condensation.py")
convection = mutants("convection", "compiled/test_convection.py")
density = mutants("density_constraint", "compiled/test_density_constraint.py", "compiled/test_warm_start.py")
burst = mutants("dynamic_nucleation", "compiled/test_dynamic_nucleation.py")
expansion = mutants("expansion", "compiled/test_expansion.py")
heat = mutants("heat", "compiled/test_heat.py")
helpers = mutants("helpers", "unit/test_phases.py", "unit/test_helpers.py", "compiled/test_density_constraint.py")
lean = mutants("lean", "compiled/test_lean.py")
labels = mutants("bubble_labels.h", "compiled/test_bubble_groups.py")
exchange = mutants("exchange.h", "compiled/test_lean.py")
pairs = mutants("pair_sums.h", "compiled/test_lean.py")
sweeps = mutants("density_sweeps.h", "compiled/test_lean.py")
start = mutants("warm_start", "compiled/test_warm_start.py")
sums = mutants("particle_sums.h", "compiled/test_reductions.py")
oscillation = mutants("oscillation", "compiled/test_oscillation.py")
phase = mutants("phase_change", "compiled/test_phase_change.py", "compiled/test_site_storage.py",
                "compiled/test_modes.py")
pooling = mutants("pooling", "compiled/test_pooling.py")
nucleation = mutants("preset_nucleation", "compiled/test_phase_change.py",
                     "compiled/test_preset_nucleation.py", "compiled/test_site_activation.py")
storage = mutants("site_storage", "compiled/test_site_storage.py")
venting = mutants("venting", "compiled/test_venting.py")
viscosity = mutants("viscosity", "compiled/test_viscosity.py")
walls = mutants("wall_multipliers", "compiled/test_wall_multipliers.py")

MUTANTS = (  # --quick takes the first of each module
    pressure("artificial pressure attracts", "d_av[d_idx] -= f * ay", "d_av[d_idx] += f * ay"),
    pressure("third power", "* f*f*f*f\n", "* f*f*f\n"),
    pressure("reference distance x 2", "DISTANCE / hdx", "2.0*DISTANCE / hdx"),
    pressure("the neighbour's mass dropped", "f = s_m[j] * h1", "f = h1"),
    groups("link radius x 2", "rz*rz < self.radius2:", "rz*rz < 4.0*self.radius2:"),
    groups("label is an index, not a uid", "= d_uid[d_parent[d_idx]]\n", "= d_parent[d_idx]\n"),
    groups("one round only", "self.conv = 1.0 if changed == 0 else -1.0", "self.conv = 1.0"),
    groups("liquid hooks too", "if d_phase[d_idx] == 3:\n            for", "if d_phase[d_idx] >= 0:\n            for"),
    labels("larger uid wins", "if (uid[a] < uid[b])", "if (uid[a] > uid[b])"),
    labels("ghosts are bubbles of their own", "label_join(parent, uid, (int)i, images[i - n]);", ";"),
    buoyancy("archimedes: sign", "self.by = -float", "self.by = float"),
    buoyancy("paper: cap dropped", "min(self.k_bubble * d_bubble_n[d_idx], self.a_max)",
             "self.k_bubble * d_bubble_n[d_idx]"),
    buoyancy("ihmsen: -1 dropped", "(self.k_max - 1.0) * exp", "self.k_max * exp"),
    buoyancy("drag: sign", "d_av[d_idx] -= f * VIJ[1]", "d_av[d_idx] += f * VIJ[1]"),
    buoyancy("drag x 2", "f = self.rate * s_m[s_idx]", "f = 2.0*self.rate * s_m[s_idx]"),
    cohesion("cohesion as a force x 2", "f = most * boiling_cohesion", "f = 2.0*most * boiling_cohesion"),
    cohesion("cohesion as a force: not less in a long step", "most = self.strength / (1.0 +",
             "most = self.strength / (1.0 + 0.0*"),
    cohesion("cohesion x 1/2", "f = self.strength * f * 2.0*s_m", "f = self.strength * f * s_m"),
    cohesion("cohesion: what was moved before is forgotten", "start_y[d_idx]) - d_pulled_y[d_idx]",
             "start_y[d_idx])"),
    cohesion("cohesion: the start of a step is forgotten", "(d_pull_y[d_idx] - d_pull_start_y[d_idx])",
             "d_pull_y[d_idx]"),
    cohesion("cohesion: liquid begins with it", "if d_phase[d_idx] == 3:\n            f = self.share",
             "f = self.share"),
    cohesion("cohesion: undamped", "d_prior[1] / (1.0 + self.stiffness*self.strength*dt*dt)", "d_prior[1]"),
    cohesion("cohesion: limiter does not count", "d_limited[d_idx] += 1", "d_limited[d_idx] += 0"),
    cohesion("cohesion: velocity does not feel it", "d_sy[d_idx] += d_pull_y", "d_sy[d_idx] += 0.0*d_pull_y"),
    cohesion("cohesion: never reset", "d_pulled_y[d_idx] = 0.0", "d_pulled_y[d_idx] += 0.0"),
    cohesion("adhesion: softening dropped", " * min(1.0, r/self.spacing)", ""),
    condensation("new liquid keeps L", "d_e[d_idx] = -d_deficit[d_idx]", "d_e[d_idx] = self.L - d_deficit[d_idx]"),
    condensation("sign of the share", "self.L - d_deficit[d_idx]", "self.L + d_deficit[d_idx]"),
    condensation("not counted", "d_condensed[d_idx] += 1", "d_condensed[d_idx] += 0"),
    container("box: no lid", "y = min(max(d_y[d_idx], self.y0), self.y1)", "y = max(d_y[d_idx], self.y0)"),
    container("cylinder: axis dropped", "x = self.cx + rx * self.radius / r", "x = rx * self.radius / r"),
    container("room: half of the way", "f = missing / max(", "f = 0.5*missing / max("),
    container("room: gradient along y", "gy = (y10*(1.0 - fz) + y11*fz)", "gy = (y10*fz + y11*(1.0 - fz))"),
    convection("boussinesq: sign", "self.by = -float(beta)", "self.by = float(beta)"),
    convection("gradient: sign", "d_av[d_idx] -= f * d_gTy[d_idx]", "d_av[d_idx] += f * d_gTy[d_idx]"),
    convection("gradient: cap x 2", "f = self.largest / size", "f = 2.0*self.largest / size"),
    density("correction: sign of the neighbour's multiplier", "(s_m[j]*lmbda + m*s_lmbda[j])",
            "(s_m[j]*lmbda - m*s_lmbda[j])"),
    density("swollen: the neighbour's swell dropped", "m = s_m[j] * s_swell[j] * h1", "m = s_m[j] * h1"),
    density("swollen correction: its own swell dropped", "m = d_m[d_idx] * d_swell[d_idx]", "m = d_m[d_idx]"),
    density("all of the error before worked off", "(1.0 - d_prior[0]) * d_left_over", "0.0 * d_left_over"),
    density("error before: felt by the velocity", "f = f * d_prior[1]\n        d_sx[d_idx] += f * d_dpx",
            "d_sx[d_idx] += f * d_dpx"),
    density("error before: that of x*", "d_x[d_idx] -= d_sx[d_idx]", "d_x[d_idx] -= 0.0"),
    density("multiplier: the others' gradients dropped", "(own + d_gc2[d_idx] + self.eps)", "(own + self.eps)"),
    density("gradients of the others x 2", "+= f * f * gg\n\n\nclass PBFDensityS",
            "+= 2.0 * f * f * gg\n\n\nclass PBFDensityS"),
    density("wall correction: sign", "f = s_m[j]*lmbda * h1", "f = -s_m[j]*lmbda * h1"),
    density("accelerated: nothing carried on", "qx = f * d_dpx[d_idx] + carried * d_qx[d_idx]",
            "qx = f * d_dpx[d_idx]"),
    density("accelerated: no restart", "            plain = 0.0\n", "            plain = plain\n"),
    density("pressure: sign", "d_pressure[d_idx] -= s_impulse", "d_pressure[d_idx] += s_impulse"),
    density("pressure: dt, not its square", "max(dt*dt, 1e-300)", "max(dt, 1e-300)"),
    density("impulse: without the under-relaxation", "+= d_prior[1] * self.omega * d_lmbda", "+= d_prior[1] * d_lmbda"),
    density("displacement: y dropped", "d_sy[d_idx] += f * d_dpy[d_idx]", "d_sy[d_idx] += 0.0"),
    sweeps("multipliers of walls: weight x 2", "sum->lmbda += W*at.w; sum->all += W;",
           "sum->lmbda += W*at.w; sum->all += 2.0*W;"),
    sweeps("walls: their multipliers dropped", "for (int k = 0; pushes && k < n_walls; k++)",
           "for (int k = 0; pushes && k < 0; k++)"),
    sweeps("density: m of the others' gradients dropped", "f*f * out[4] / p->m", "f*f * out[4]"),
    sweeps("swollen: the neighbours' swell dropped", "&kernel, wendland, swollen, x", "&kernel, wendland, 0, x"),
    sweeps("wall density: sign", "rho += scale * out[0]", "rho -= scale * out[0]"),
    sweeps("nothing set apart", "if (out[3] > 1.0)", "if (out[3] < 0.0)"),
    sweeps("left-over error worked off", "error - forgiven * fluid->left_over[i]", "error"),
    sweeps("wall correction: sign", "const double f = lmbda * slope", "const double f = -lmbda * slope"),
    sweeps("limiter does not count", "fluid->limited[i] += 1;\n        }\n        if (fluid->qx)",
           "}\n        if (fluid->qx)"),
    sweeps("cohesion: limiter does not count", "pz *= f;\n        fluid->limited[i] += 1;", "pz *= f;"),
    sweeps("Chebyshev: nothing carried on", "(weight - 1.0) * fluid->qy[i]", "0.0"),
    sweeps("impulse: what the velocity does not feel counts", "feels * multiplier", "multiplier"),
    sweeps("cohesion: repulsion dropped", "2.0*f - 1.0 : f", "2.0*f : f"),
    sweeps("cohesion: what was moved before is forgotten", " - fluid->pulled_y[i]", ""),
    sweeps("cohesion: the start of a step is forgotten", "(ay - fluid->pull_start_y[i])", "ay"),
    sweeps("cohesion: undamped", "feels / (1.0 + p->stiffness * p->strength * dt2)", "feels"),
    sweeps("cohesion: velocity does not feel it", "fluid->sx[i] += px;", ""),
    sweeps("cohesion: liquid pulls too", "if (fluid->phase[j] != VAPOUR) continue;", ""),
    sweeps("container: velocity does not feel it", "fluid->sy[i] += feels * dy", "fluid->sy[i] += 0.0 * dy"),
    sweeps("room: one step alone", "turn < 4", "turn < 1"),
    burst("regions overlap", "if s_claim[s_idx] != d_fire_key[d_idx]:", "if s_claim[s_idx] < 0.0:"),
    burst("heat of a region x 2", "heat += nucleation_units(share", "heat += 2.0*nucleation_units(share"),
    burst("the others get what was spent", "(heat - price) / others", "heat / others"),
    burst("none left: heat lost", "self.L + (heat - price) / chosen", "self.L"),
    burst("vapour holds latent heat", "d_e_lat[d_idx] = 0.0", "d_e_lat[d_idx] += 0.0"),
    burst("held heat drives the burst", "share * (s_e[s_idx] - s_held[s_idx]) / self.L", "share * s_e[s_idx] / self.L"),
    burst("held heat pays for nobody", "price += s_m[s_idx] * (self.L - s_held[s_idx])",
          "price += s_m[s_idx] * self.L"),
    burst("held heat of the others is lost", "d_e[d_idx] = d_held[d_idx] + s_e_others", "d_e[d_idx] = s_e_others"),
    burst("the threshold of a mixture is that of liquid", "mass += nucleation_units(share * (c/self.c_l))",
          "mass += nucleation_units(share)"),
    exchange("conduction: the last neighbours left out", "if (n > 0) add_heat", "if (n < 0) add_heat"),
    exchange("conduction: sign", "(sum->T - lanes_values(T, neighbours))", "(sum->T + lanes_values(T, neighbours))"),
    exchange("viscosity: sign of the neighbour's velocity", "f*(sum->v - moves.y)", "f*(sum->v + moves.y)"),
    exchange("drag: everywhere", "lanes(forces->drag)*(other*other)", "lanes(forces->drag)"),
    exchange("warm start: the neighbour's multiplier dropped", ": sum->lmbda + moves.w;", ": sum->lmbda;"),
    exchange("swollen warm start: its own swell dropped", "sum->swell*moves.w", "moves.w"),
    exchange("swollen warm start: the neighbour's swell dropped", "*lanes_values(forces->swell, neighbours)", ""),
    exchange("warm start: sign of the walls", "out[1] -= f * near[1]", "out[1] += f * near[1]"),
    exchange("artificial pressure: third power", "(w2*w2) - lanes", "(w2*w) - lanes"),
    exchange("artificial pressure attracts", "sum->ay += g*p.dy", "sum->ay -= g*p.dy"),
    expansion("ramp x 2", "most = self.rate * dt", "most = 2.0*self.rate * dt"),
    expansion("liquid swells too", "if d_phase[d_idx] == 3:", "if d_phase[d_idx] >= 0:"),
    heat("conduction x 1/2", "k = 4.0 * d_k", "k = 2.0 * d_k"),
    heat("conduction: sign", "* k * (d_T[d_idx] - s_T[s_idx]) * f", "* k * (s_T[s_idx] - d_T[d_idx]) * f"),
    heat("paper: density of the neighbour", "here = pair * d_rho[d_idx]", "here = pair * s_rho[s_idx]"),
    heat("paper: leak of the neighbour, sign", "there = -pair", "there = pair"),
    heat("heater x 1/2", "4.0*d_k[d_idx] * (d_T[d_idx] - T)", "2.0*d_k[d_idx] * (d_T[d_idx] - T)"),
    heat("heater: no temperature of its own", "T = s_T_heater[s_idx]", "T = 0.0"),
    heat("heater flux x 2", "d_heater_wet[d_idx] / d_heater_weight[0]", "2.0*d_heater_wet[d_idx] / d_heater_weight[0]"),
    heat("loss: sign", "d_ae[d_idx] -= q\n", "d_ae[d_idx] += q\n"),
    heat("loss: not booked", "d_q_loss[d_idx] += q * d_m", "d_q_loss[d_idx] += 0.0 * d_m"),
    heat("loss: explicit", "if fall > 1e-9:", "if fall > 1e9:"),
    heat("loss: of the temperature before the step", " + d_heat_dt[0] * d_ae[d_idx])", ")"),
    heat("loss: heats past the boiling point", "if -q * d_heat_dt[0] > room:", "if -q * d_heat_dt[0] > 1e9 * room:"),
    heat("loss: cools what is beyond the bound", "if room < 0.0:\n                    room = 0.0", "if room < 0.0:\n"
         "                    room = room + 0.0"),
    heat("loss: capacity of liquid for vapour", "c = self.c_vapour", "c = self.c"),
    heat("loss: capacity of liquid for a mixture", "c = self.c * (d_k[d_idx]/self.cond)", "c = self.c"),
    heat("temperature after: offset",
         "d_T[d_idx] = self.T0 + d_e[d_idx] / self.c\n\n\nclass HeatConductionClearyMonaghan(",
         "d_T[d_idx] = d_e[d_idx] / self.c\n\n\nclass HeatConductionClearyMonaghan("),
    heat("source x 2", "d_ae[d_idx] += self.rate", "d_ae[d_idx] += 2.0*self.rate"),
    heat("update x 2", "d_e[d_idx] += d_heat_dt[0]", "d_e[d_idx] += 2.0*d_heat_dt[0]"),
    pair("cohesion: repulsion dropped", "f = 2.0*f - 1.0", "f = 2.0*f"),
    helpers("vapour: latent heat dropped", "T = T_sat + (e - L) / c_v", "T = T_sat + e / c_v"),
    helpers("liquid below saturation: sign", "T = T_sat + min(e, 0.0) / c_l", "T = T_sat - min(e, 0.0) / c_l"),
    helpers("mixture: heat capacity of liquid", "c_l + (c_v - c_l) * max(", "c_l + (c_l - c_l) * max("),
    helpers("random direction: mean dropped", "return h * 4.656612873077393e-10 - 1.0",
            "return 0.0 * h"),
    helpers("Wendland's slope: factor", "t*(4.0*c4 + t*5.0*c5)", "t*(3.0*c4 + t*5.0*c5)"),
    lean("heater: not booked in full", "flow * d_m[d_idx] * d_heat_dt[0]", "0.5*flow * d_m[d_idx] * d_heat_dt[0]"),
    lean("friction: mass of the wall dropped", "f += s_m[j] * boiling_kernel", "f += boiling_kernel"),
    oscillation("mean direction left in", "(rx/r - d_bdx[d_idx])", "(rx/r)"),
    oscillation("sign", "f = d_push_multiplier[d_idx] / d_m[d_idx]", "f = -d_push_multiplier[d_idx] / d_m[d_idx]"),
    oscillation("same for every mass", "f = d_push_multiplier[d_idx] / d_m[d_idx]", "f = d_push_multiplier[d_idx]"),
    oscillation("displacement not told", "d_sz[d_idx] += pz", "d_sz[d_idx] += 0.0*pz"),
    pairs("transposition of four: y for z", "r.z = LANES_OF(ab_xz", "r.z = LANES_OF(ab_yw"),
    pairs("gradient: the neighbour's multiplier dropped", ": at.w + sum->plus;", ": sum->plus;"),
    pairs("swollen gradient: its own swell dropped", "sum->swell*at.w", "at.w"),
    pairs("swollen gradient: the neighbour's swell dropped", "sum->plus*lanes_values(swell, neighbours)", "sum->plus"),
    pairs("Wendland: slope", "5.0 * kernel->w_scale", "4.0 * kernel->w_scale"),
    pairs("cubic spline: inner part of the slope", "lanes(kernel->ratio)*(p.u*p.u)",
          "lanes(0.5*kernel->ratio)*(p.u*p.u)"),
    pairs("neighbours beyond the end count", "counted + 8 - (n - lanes_last(n))", "counted + 7 - (n - lanes_last(n))"),
    sums("at the edge it is not held", "_CMP_LE_OQ", "_CMP_LT_OQ"),
    sums("compensation dropped", "return total.sum + total.lost;", "return total.sum;"),
    sums("rest of a block dropped", "for (; i < end; i++) rest += a[i];", ""),
    sums("a NaN goes unseen", "none |= a[i] != a[i];", ""),
    sums("groups of several labels", "key[k] >> 32", "key[k] >> 33"),
    sums("on the base is above it", "height[i] - base <= reach", "height[i] - base < reach"),
    sums("what is below lies within", "_mm256_cmpgt_epi32(low, v)", "_mm256_cmpgt_epi32(v, v)"),
    sums("the last values go unseen", "if (low <= a[i] && a[i] <= high) return 1;", ""),
    phase("temperature after: capacity of vapour for liquid",
          "self.c_l,\n                                         self.c_v, self.subcooling)\n\n\nclass PhaseKinetic",
          "self.c_v,\n                                         self.c_v, self.subcooling)\n\n\nclass PhaseKinetic"),
    phase("temperature after: none", "_phase, d_T):\n        d_T[d_idx] = boiling_temperature(d_e[d_idx],",
          "_phase, d_T):\n        d_T[d_idx] += 0.0 * boiling_temperature(d_e[d_idx],"),
    phase("vapour is a site for the cold, not the hot", "if d_e[d_idx] >= 0.0:", "if d_e[d_idx] < 0.0:"),
    phase("a second layer boils", "max(r2, rx*rx + ry*ry + rz*rz) < best", "max(r2, rx*rx + ry*ry + rz*rz) < 0.0"),
    phase("liquid beside the line hides it, too", "max(r2, rx*rx + ry*ry + rz*rz)", "min(r2, rx*rx + ry*ry + rz*rz)"),
    phase("temperature of twice the enthalpy", "d_k, d_ae):\n        d_T[d_idx] = boiling_temperature(d_e[d_idx]",
          "d_k, d_ae):\n        d_T[d_idx] = boiling_temperature(2.0*d_e[d_idx]"),
    phase("mixture: conductivity of liquid", "d_k[d_idx] = self.k_l * (c/self.c_l)", "d_k[d_idx] = self.k_l"),
    phase("vaporisation not counted", "d_vaporised[d_idx] += 1", "d_vaporised[d_idx] += 0"),
    phase("convert: heat is held", "if self.hold > 0.5:", "if self.hold > -0.5:"),
    phase("gu superheats", "if self.near > 0.5:", "if self.near > 1.5:"),
    phase("hold: frozen heat x 1/2", "d_e_lat[d_idx] = d_e[d_idx]", "d_e_lat[d_idx] = 0.5*d_e[d_idx]"),
    pooling("kinetic radius", "float(radius) * float(radius)", "1.21 * float(radius) * float(radius)"),
    pooling("tie", "if s_bubble[s_idx] < label:", "if r2 < self.radius2:"),
    pooling("excess makes no vapour hotter", "self.T_sat + (d_e[d_idx] - self.L) / self.c_v", "self.T_sat"),
    pooling("interface: heat ends in the centre", "d_k[d_idx] *= self.half_spacing",
            "d_k[d_idx] *= d_vapour_distance[d_idx]"),
    pooling("interface: twice as far", "self.half_spacing = 0.5 *", "self.half_spacing = 0.25 *"),
    nucleation("site radius x 2", "if RIJ < self.radius:", "if RIJ < 2.0*self.radius:"),
    nucleation("all embryos alike", "d_drawn[d_idx] += 1", "d_drawn[d_idx] += 0"),
    nucleation("a site wakes by liquid beside it", "if 2.0*up*up >= r2:", "if 2.0*up*up >= 0.0:"),
    nucleation("activation superheat dropped", "d_activation[d_idx]*(1.0 + self.spread*needed)", "0.0*needed"),
    nucleation("a site never sleeps again", "if 2*vapour < d_awake[d_idx]:", "if 2*vapour < 0:"),
    nucleation("a site sleeps with a bubble", "if beyond == 0:", "if beyond >= 0:"),
    nucleation("dormant and active exchanged", "if s_awake[s_idx] == 0:", "if s_awake[s_idx] != 0:"),
    nucleation("attraction: sign", "d_av[d_idx] += f * (s_y", "d_av[d_idx] -= f * (s_y"),
    nucleation("attraction: all liquid for that in transition", "d_phase[d_idx] >= self.first and", "0 >= 0 and"),
    nucleation("attraction: square dropped", "f = self.strength * f * f /", "f = self.strength * f /"),
    storage("occupied site absorbs", "if s_occupied[s_idx] == 0:", "if s_occupied[s_idx] >= 0:"),
    storage("pays twice what it loses", "d_paid[d_idx] = d_m[d_idx] * share", "d_paid[d_idx] = 2.0*d_m[d_idx] * share"),
    storage("emits without paying", "d_Q_s[d_idx] -= d_cost[d_idx]", "d_Q_s[d_idx] -= 0.0"),
    venting("film does not cover less than liquid", "if s_film[s_idx] == 0:", "if s_film[s_idx] >= 0:"),
    venting("free steps x 2", "d_free[d_idx] += 1", "d_free[d_idx] += 2"),
    venting("release: gravity x 2", "d_av[d_idx] = self.gy", "d_av[d_idx] = 2.0*self.gy"),
    viscosity("XSPH: sign", "d_au[d_idx] -= f * VIJ[0]", "d_au[d_idx] += f * VIJ[0]"),
    viscosity("wall friction: y dropped", "d_av[d_idx] -= f * d_v[d_idx]", "d_av[d_idx] -= 0.0"),
    viscosity("gravity x 2", "d_aw[d_idx] = self.gz", "d_aw[d_idx] = 2.0*self.gz"),
    walls("multiplier of walls: a sum, no mean", "d_wall_lmbda[d_idx] = d_wall_lmbda[d_idx] / d_wall_weight[d_idx]",
          "d_wall_lmbda[d_idx] = d_wall_lmbda[d_idx] / 1.0"),
    walls("correction by walls: sign", "d_dpx[d_idx] += f * DWIJ[0]", "d_dpx[d_idx] -= f * DWIJ[0]"),
    walls("warm start of walls: their mass dropped", "f = s_m[s_idx] * s_wall_start[s_idx] / self.rho_rest",
          "f = s_wall_start[s_idx] / self.rho_rest"),
    walls("warm start of walls: weight without masses", "d_wall_weight[d_idx] += s_m[s_idx] * WIJ\n\n    def post_loop("
          "self, d_idx, d_wall_start", "d_wall_weight[d_idx] += WIJ\n\n    def post_loop(self, d_idx, d_wall_start"),
    start("warm start: the neighbour's multiplier dropped", " + d_m[d_idx]*s_lmbda_start[s_idx]) / (d_m", ") / (d_m"),
    start("warm start, walls: sign", "f = s_m[s_idx]*d_lmbda_start[d_idx] /", "f = -s_m[s_idx]*d_lmbda_start[d_idx] /"),
)


def mutated(mutant, root=ROOT):
    """Source of the mutated module. Raises ``ValueError`` unless the text to replace occurs exactly once."""
    source = (root / mutant.path).read_text(encoding="utf-8")
    count = source.count(mutant.old)
    if count != 1:
        raise ValueError(f"{mutant.module}, {mutant.what}: the text to replace occurs {count} times: {mutant.old!r}")
    return source.replace(mutant.old, mutant.new)


def copy_repository(folder):
    """A copy to break, and an environment in which Python finds it and PySPH's cache; returns (root, environment).

    The cache is a folder of links to the user's own: what is compiled here goes no further.
    """
    root, home = folder / "repository", folder / "home"
    shutil.copytree(ROOT, root, ignore=LEFT_OUT)
    cache = Path.home() / ".pysph" / "source"
    for path in (path for path in cache.glob("*/*") if path.is_file()):
        target = home / ".pysph" / "source" / path.relative_to(cache)
        target.parent.mkdir(parents=True, exist_ok=True)
        target.symlink_to(path)
    home.mkdir(exist_ok=True)
    environment = {**os.environ, "HOME": str(home), "PYTHONPATH": str(root), "PYTHONDONTWRITEBYTECODE": "1"}
    where = subprocess.run([sys.executable, "-c", "import pysph_boiling; print(pysph_boiling.__file__)"], cwd=root,
                           env=environment, capture_output=True, text=True, check=True).stdout.strip()
    if not Path(where).is_relative_to(root):
        raise RuntimeError(f"the tests would run on {where}, not on the copy in {root}")
    return root, environment


def run_tests(root, environment, tests):
    """First failing test of the named files, or ``None``. Raises ``RuntimeError`` where they could not run at all."""
    log = root.parent / "log.txt"
    log.unlink(missing_ok=True)
    outcome = run_job(Job(name="the tests", directory=root, environment=environment, log=log, time_limit=TIMEOUT,
                          command=(sys.executable, "-m", "pytest", "-x", "-q", "-p", "no:cacheprovider",
                                   *(f"tests/{name}" for name in tests))))
    if not outcome.failure:
        return None
    if outcome.seconds >= TIMEOUT:
        return outcome.failure
    output = log.read_text(encoding="utf-8", errors="replace")
    failed = re.search(r"^FAILED tests/(\S+)", output, re.M) or re.search(r"^ERROR tests/(\S+::\S+)", output, re.M)
    if outcome.status != 1 or not failed or "CompileError" in output:
        raise RuntimeError(f"the tests did not run:\n{output[-3000:]}")
    return failed[1]


def hunt(mutant, root, environment):
    """Break the copy, run the tests, mend it; returns the test that noticed, or ``None``."""
    path = root / mutant.path
    whole = path.read_text(encoding="utf-8")
    path.write_text(mutated(mutant, root), encoding="utf-8")
    try:
        return run_tests(root, environment, mutant.tests)
    finally:
        path.write_text(whole, encoding="utf-8")


def chosen(only=None, quick=False):
    """The mutants to run: of one module, or the first of each."""
    known = list(dict.fromkeys(mutant.module for mutant in MUTANTS))
    if only is not None and only not in known:
        raise ValueError(f"no mutants of '{only}'; there are of: {', '.join(known)}")
    found = [mutant for mutant in MUTANTS if only in (None, mutant.module)]
    return [next(m for m in found if m.module == name) for name in known if only in (None, name)] if quick else found


def main(argv=None):
    from rich.console import Console
    from rich.markup import escape
    from rich.table import Column, Table

    parser = argparse.ArgumentParser(prog="mutants", description=__doc__.split("\n")[0])
    parser.add_argument("--list", action="store_true", help="list the mutants and stop")
    parser.add_argument("--only", metavar="MODULE", help="mutants of one module of pysph_boiling/equations")
    add_report_options(parser, quick="the first mutant of each module", report=None, json="write the outcome there")
    options = parser.parse_args(argv)
    console = Console(highlight=False)
    try:
        todo = chosen(options.only, options.quick)
        for mutant in todo:
            mutated(mutant)
    except ValueError as error:
        print(f"mutants: {error}", file=sys.stderr)
        return 2
    if options.list:
        table = Table("module", "mutation", "tests")
        for mutant in todo:
            table.add_row(mutant.module, mutant.what, "\n".join(mutant.tests))
        console.print(table)
        return 0

    console.print(f"{len(todo)} mutants; each compiles its module anew, 20 to 60 s")
    table = Table("module", "mutation", Column("killed by", overflow="fold"), "s")
    outcome, begin = [], time.monotonic()
    with tempfile.TemporaryDirectory(prefix="mutants_") as folder:
        root, environment = copy_repository(Path(folder))
        with console.status("the tests as they are") as status:
            noticed = run_tests(root, environment, sorted({name for mutant in todo for name in mutant.tests}))
            if noticed:
                print(f"mutants: {noticed} fails without any mutant", file=sys.stderr)
                return 2
            for number, mutant in enumerate(todo, 1):
                status.update(f"{number}/{len(todo)}  {mutant.module}: {mutant.what}")
                start, killer = time.monotonic(), None
                try:
                    killer = hunt(mutant, root, environment)
                    fate = escape(killer.split("::")[-1]) if killer else "[red]survived[/red]"
                except RuntimeError as error:
                    fate = "[red]did not run[/red]"
                    print(f"mutants: {mutant.module}, {mutant.what}: {error}", file=sys.stderr)
                seconds = time.monotonic() - start
                if not console.is_terminal:
                    console.print(f"{number}/{len(todo)}  {mutant.module}: {mutant.what}: {fate}")
                table.add_row(mutant.module, mutant.what, fate, f"{seconds:.0f}")
                outcome.append({"module": mutant.module, "mutation": mutant.what, "killed_by": killer,
                                "seconds": round(seconds, 1)})
    console.print(table)
    survivors = [row for row in outcome if row["killed_by"] is None]
    if options.json:
        write_json(options.json, {"mutants": outcome, "survivors": len(survivors)})
    console.print(f"{len(outcome)} mutants, {len(survivors)} survived, {(time.monotonic() - begin) / 60:.1f} min")
    return 1 if survivors else 0


if __name__ == "__main__":
    sys.exit(main())
