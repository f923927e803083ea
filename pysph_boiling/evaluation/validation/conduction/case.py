"""Conduction in still matter: see README.md beside this file."""
import math

from pysph_boiling.analysis.plots import BLUE, ORANGE
from pysph_boiling.evaluation.problems.conduction import FourierMode, HotPlate, TwoBodies, lattice_constant
from pysph_boiling.report.pictures import plot

LATTICES = ((2, 1.0), (2, 1.3), (2, 2.0), (3, 1.0), (3, 1.2), (3, 1.5))  # dimension, h/dx
DISORDER = (0.0, 0.05, 0.1, 0.2, 0.3)  # spacings
CLOUDS = {"2d": dict(dim=2, hdx=1.2, width=32), "2d_wide": dict(dim=2, hdx=1.3, width=32),
          "3d": dict(dim=3, hdx=1.2)}  # row -> its Fourier mode of 32 layers


def run(quick):
    return dict(
        plate={dx: HotPlate(spacing=dx).run() for dx in (2e-3, 1e-3, 5e-4)},
        mode={(layers, hdx): FourierMode(layers=layers, hdx=hdx).run() for hdx in (1.2, 1.3)
              for layers in (16, 32, 64)},
        bodies={layers: TwoBodies(layers=layers).run() for layers in (20, 40, 80)},
        lattice={(dim, hdx): lattice_constant(dim, hdx) for dim, hdx in LATTICES},
        disorder={row: [FourierMode(**cloud, disorder=most).run() for most in DISORDER]
                  for row, cloud in CLOUDS.items() if not (quick and row == "3d")})


def order(errors):
    """Mean order of convergence over halvings of the spacing."""
    return math.log2(abs(errors[0] / errors[-1])) / (len(errors) - 1)


def percent(errors, signed=False):
    return ", ".join(f"{100.0 * error:{'+' if signed else ''}.2g}" for error in errors) + " %"


def rows(outcomes):
    plate = [one.errors["L2"] for one in outcomes["plate"].values()]
    yield "plate", plate[1], f"{percent(plate)} at 2, 1, 0.5 mm"
    yield "plate_order", order(plate), f"{order(plate):.2f}"
    rate = [outcomes["mode"][layers, 1.3].errors["rate"] for layers in (16, 32, 64)]
    yield "mode", rate[-1], f"{percent(rate, signed=True)} at 16, 32, 64 layers"
    orders = [math.log2(outcomes["mode"][n, hdx].errors["order"] / outcomes["mode"][2 * n, hdx].errors["order"])
              for hdx in (1.2, 1.3) for n in (16, 32)]
    yield "mode_order", min(orders), f"{min(orders):.2f} to {max(orders):.2f}"
    bodies = outcomes["bodies"]
    for row, error in (("bodies", "L2"), ("bodies_flux", "flux"), ("bodies_heat", "heat")):
        errors = [one.errors[error] for one in bodies.values()]
        yield row, errors[-1], f"{percent(errors, signed=error != 'L2')} at 20, 40, 80 layers"
    L2 = [one.errors["L2"] for one in bodies.values()]
    yield "bodies_order", order(L2), f"{order(L2):.2f}"
    lattice = outcomes["lattice"]
    yield "lattice", max(abs(ratio - 1.0) for ratio in lattice.values()), "ratio to exact " + ", ".join(
        f"{ratio:.3f}" for ratio in lattice.values())
    at = f"at {', '.join(f'{most:g}' for most in DISORDER)} dx"
    for row, found in outcomes["disorder"].items():
        rate, local = ([one.errors[error] for one in found] for error in ("rate", "local"))
        yield f"disorder_{row}", rate[-1], f"{percent(rate, signed=True)} {at}"
        yield f"local_{row}", local[-1], f"{', '.join(f'{100.0 * one:.0f}' for one in local)} % {at}"
    energy = max(one.facts["energy"] for one in bodies.values())
    yield "conserved", energy, f"{energy:.0e}"


def draw(outcomes, path):
    with plot(path, width=9.6, columns=2) as (left, right):
        plate, bodies = outcomes["plate"][1e-3].curves, outcomes["bodies"][80].curves
        left.plot(1e3 * plate["depth [m]"], plate["T [K]"], ".", color=ORANGE, label="particles, 1 mm")
        left.plot(1e3 * plate["depth [m]"], plate["exact [K]"], color=BLUE, label="exact")
        left.set(xlabel="distance from the plate [mm]", ylabel="temperature [K]", title="hot plate on still water")
        right.plot(1e3 * bodies["y [m]"], bodies["T [K]"], ".", markersize=3, color=ORANGE, label="particles")
        right.plot(1e3 * bodies["y [m]"], bodies["exact [K]"], color=BLUE, label="exact")
        right.set(xlabel="vapour | distance from the interface [mm] | liquid", ylabel="temperature [K]",
                  title="hot vapour on cold liquid")
        for ax in (left, right):
            ax.legend()
