"""Real experiments: see README.md beside this file."""
import math

import numpy as np

from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.boiling_rate import BoilingRate
from pysph_boiling.evaluation.problems.bubble_rise import BubbleRise
from pysph_boiling.evaluation.problems.from_scene import from_scene
from pysph_boiling.evaluation.problems.growth import Growth, growth_constant
from pysph_boiling.examples.steady_boiling import SteadyBoiling
from pysph_boiling.materials import WATER_1ATM
from pysph_boiling.report.pictures import plot
from pysph_boiling.schemes.effects import Buoyancy, Cohesion, XSPHViscosity

G, SMALL = 9.81, dict(width=30, fill=16, sites=3)


def benchmark(cells):
    """Case 1 of Hysing et al. 2009 at equal densities; ``cells`` spacings in the diameter."""
    d, h = 0.012, 1.2 * 0.012 / cells
    nu, sigma = math.sqrt(G) * d**1.5 / 35.0, WATER_1ATM.rho_l * G * d**2 / 10.0
    return BubbleRise(cells=cells, diameter=d, width=2.0, starts=1, effects=(
        ("drag", None), ("viscosity", XSPHViscosity(rate=nu / (31.0 / 196.0 * h**2))),
        ("cohesion", Cohesion(sigma=sigma)), ("buoyancy", Buoyancy(k_bubble=0.9))))


def boil(duration, **parameters):
    """Bubbles that left the sites of ``steady_boiling`` in ``duration`` [s]: (scene, their numbers of particles)."""
    scene, stepper = from_scene(SteadyBoiling, duration=duration, **parameters)
    stepper.step(round(duration / stepper.dt))
    return scene, np.array([n for _, n, _ in scene.departures])


def run(quick):
    growth = Growth(dim=3, growth=2.0, radius=1.5 if quick else 3.0, stefan=0.1)
    found = {"growth": (growth, growth.run())}
    flat = dict(dim=2, spacing=0.002, time_scaling=1000.0, **SMALL)
    superheats = (20.0, 40.0) if quick else (10.0, 20.0, 40.0, 80.0, 200.0)
    duration = 2.0 if quick else 3.0
    found["flux"] = {dT: BoilingRate(superheat=dT, duration=duration, begin=1.0, **SMALL).run().facts["flux"]
                     for dT in superheats}
    if quick:
        return found
    found["rise"] = BubbleRise(dim=3, cells=9, diameter=0.018, starts=1).run()
    found["benchmark"] = benchmark(12).run()
    found["boil"] = 2.5, *boil(2.5, width=20, fill=18, sites=9)  # ``--demo``
    found["onset"] = {dT: len(boil(3.0, superheat=dT, **flat)[1]) for dT in (3.0, 5.0, 10.0, 20.0, 40.0)}
    return found


def rows(found):
    problem, one = found["growth"]
    water = WATER_1ATM
    t, radius = one.curves["t [s]"], one.curves["R [dx]"]
    power, coefficient = np.polyfit(np.log(t), np.log(radius), 1)[0], radius[-1] / one.curves["exact [dx]"][-1]
    superheat = problem.stefan * water.L / water.c_l
    jakob = water.rho_l / water.rho_v * problem.stefan
    coefficient *= 2.0 * growth_constant(3, problem.stefan)
    yield "growth_power", power, f"{power:.2f}"
    ratio = coefficient / (math.sqrt(12.0 / math.pi) * jakob)
    yield "growth_rate", ratio, f"{ratio:.4f}: R = {coefficient:.2f} √(α t) at {superheat:.0f} K"
    flux = found["flux"]
    text = ", ".join(f"{q / 1e3:.1f}" for q in flux.values()) + " kW/m² at " + (
        ", ".join(f"{dT:g}" for dT in flux) + " K")
    below = [dT for dT in flux if dT <= 40.0]
    slope = np.polyfit(np.log(below), np.log([flux[dT] for dT in below]), 1)[0]
    yield "slope", slope, f"{slope:.2f}; {text}"
    if "rise" not in found:
        return
    yield "critical", max(flux.values()) / 1e6, f"{max(flux.values()) / 1e6:.3f} MW/m²; the flux rises up to 200 K"
    facts = found["rise"].facts
    yield "speed", facts["speed"], f"{facts['speed']:.2f}"
    drag = 4.0 / (3.0 * facts["speed"] ** 2)
    yield "drag", drag, f"{drag:.1f}"
    wellek = 1.0 + 0.163 * facts["eotvos"] ** 0.757
    yield "flat", facts["aspect"] / wellek - 1.0, (
        f"{facts['aspect']:.2f} instead of {wellek:.2f} at Eo = {facts['eotvos']:.0f}")
    t, height, aspect = found["benchmark"].curves.values()
    speed = np.gradient(np.convolve(height, np.ones(3) / 3.0, "valid"), t[1:-1])
    until = t[1:-1] < 4.2
    yield "benchmark_speed", max(speed[until]), f"{max(speed[until]):.3f}"
    at = float(np.interp(4.2, t, height))  # t = 3 of the benchmark, in sqrt(d/g)
    yield "benchmark_height", at, f"{at:.2f}"
    round_ = min(circularity(a) for a in aspect[t < 4.2])
    yield "benchmark_round", round_, f"{round_:.3f}"
    duration, scene, sizes = found["boil"]
    scheme, p = scene.scheme, scene.parameters
    sigma, force = scheme.effects["cohesion"].sigma_in(scheme.scene()), scheme.effects["buoyancy"].k_bubble * G
    diameter = float(np.mean((6.0 / math.pi * sizes) ** (1.0 / 3.0))) * p.spacing
    length = math.sqrt(sigma / (force * scheme.rho0))
    yield "departure", diameter / length, (f"{diameter / length:.2f}: {1e3 * diameter:.1f} mm, with √(σ/(g Δρ)) = "
                                           f"{1e3 * length:.1f} mm; {len(sizes)} bubbles")
    product = len(sizes) / duration / p.sites * diameter
    zuber = 0.59 * (sigma * force / scheme.rho0) ** 0.25
    yield "frequency", product / p.time_scaling / zuber, (
        f"{product / p.time_scaling / zuber:.1e}; {product / zuber:.2f} with f not over A: {1e3 * product:.0f} mm/s, "
        f"Zuber {1e3 * zuber:.0f} mm/s")
    onset = [dT for dT, n in found["onset"].items() if n > 0]
    yield "onset", min(onset, default=math.nan), ", ".join(f"{n}" for n in found["onset"].values()) + (
        " bubbles in 3 s at " + ", ".join(f"{dT:g}" for dT in found["onset"]) + " K")


def circularity(aspect):
    """Circumference of a circle over that of an ellipse of the same area (Ramanujan 1914); ``aspect``: of its axes."""
    a, b = math.sqrt(aspect), 1.0 / math.sqrt(aspect)
    return 2.0 / (3.0 * (a + b) - math.sqrt((3.0 * a + b) * (a + 3.0 * b)))


def draw(found, path):
    with plot(path, width=9.6 if "benchmark" in found else 5.2, columns=2 if "benchmark" in found else 1) as axes:
        left, *right = axes if "benchmark" in found else [axes]
        flux = found["flux"]
        left.plot(list(flux), [q / 1e6 for q in flux.values()], "o-", color=ORANGE, label="particles, over A")
        superheat = np.array([5.0, 30.0])
        left.plot(superheat, (superheat / 30.0) ** 3, color=BLUE, label="about what Nukiyama measured")
        left.set(xlabel="superheat of the base [K]", ylabel="heat flux [MW/m²]", xscale="log", yscale="log",
                 title="boiling curve")
        left.legend()
        for ax in right:
            t, height, _ = found["benchmark"].curves.values()
            ax.plot(t * 3.0 / 4.2, 0.5 * height, color=ORANGE, label="particles")
            ax.plot([0.0, 3.0], [0.5, 1.081], "o", color=BLUE, label="Hysing et al.")
            ax.set(xlim=(0.0, 3.0), ylim=(0.4, 1.3), xlabel="t [-]", ylabel="height of the centre [-]",
                   title="2-D benchmark")
            ax.legend()
