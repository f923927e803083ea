"""Figure 2: the states of a particle, their transitions and the kind of heat, drawn from the table in the code."""
import numpy as np

from pysph_boiling.analysis.drawing import INK, PHASE_COLOURS
from pysph_boiling.evaluation.reproduce.figure import Figure
from pysph_boiling.evaluation.reproduce.rules import Toy
from pysph_boiling.materials import WATER_1ATM as WATER
from pysph_boiling.phases import EDGES, Phase, temperature
from pysph_boiling.report.pictures import plot
from pysph_boiling.report.sections import Picture, Statement, Table, bound, judged, write_csv
from pysph_boiling.schemes.effects import Condensation, PhaseChange

__all__ = ["StateDiagram", "channels", "draw_states", "main_channel", "trigger"]

NAMES = {Phase.LIQUID: "normal liquid", Phase.TRANSITION: "undergoing phase transition",
         Phase.SUPERHEATED: "superheated liquid", Phase.VAPOUR: "vapour"}
RANGES = {"negative": "e < 0", "stored": "0 ≤ e < L", "full": "e ≥ L", "not negative": "e ≥ 0", "lacking": "e < L"}
SITES = {True: "site near", False: "no site near", None: ""}
BY = {"phase_change": "", "nucleation": "enough heat in its region", "condensation": "its bubble lacks m L"}

# Positions of the states, and curvature of the edges; an edge without an entry is straight.
PLACES = {Phase.LIQUID: (0.0, 0.0), Phase.TRANSITION: (5.0, 2.2), Phase.SUPERHEATED: (5.0, -2.2),
          Phase.VAPOUR: (10.0, 0.0)}
BOX = (1.15, 0.55)  # half of a state's width and height
BENDS = {(Phase.LIQUID, Phase.TRANSITION): -0.22, (Phase.TRANSITION, Phase.LIQUID): -0.22,
         (Phase.LIQUID, Phase.SUPERHEATED): 0.22, (Phase.SUPERHEATED, Phase.LIQUID): 0.22,
         (Phase.TRANSITION, Phase.SUPERHEATED): -0.45, (Phase.SUPERHEATED, Phase.TRANSITION): -0.45,
         (Phase.TRANSITION, Phase.VAPOUR): -0.06, (Phase.SUPERHEATED, Phase.VAPOUR): 0.06,
         (Phase.VAPOUR, Phase.LIQUID): -0.78}


def channels(phase, phases=None, condensation=None):
    """Kinds of heat that a particle in ``phase`` takes up: list of (range of its enthalpy, "sensible" or "latent").

    They are found by adding a little heat and checking the temperature, with the forms of the two effects.
    """
    phases, condensation = phases or PhaseChange(), condensation or Condensation()
    held = 0.3 * WATER.L if phases.interrupt == "hold" else 0.0
    samples = {
        Phase.LIQUID: [("e < 0", -0.5, 0.0)],
        Phase.TRANSITION: [("0 ≤ e < L", 0.5, 0.0)],
        Phase.SUPERHEATED: [("e ≥ e_lat", 0.5, held), ("0 ≤ e < e_lat", 0.1, held)] if held else [("e ≥ 0", 0.5, 0.0)],
        Phase.VAPOUR: [("e ≥ L", 1.2, 0.0), ("e < L", 0.8, 0.0)],
    }
    found = []
    for name, e, e_lat in samples[phase]:
        T = [float(temperature(WATER.L * (e + more), phase, WATER, e_lat, condensation.subcooling))
             for more in (0.0, 1e-3)]
        found.append((name, "sensible" if T[1] > T[0] else "latent"))
    return found


def main_channel(phase):
    """The kind of heat in the first range of :func:`channels`."""
    return channels(phase)[0][1]


def trigger(edge):
    """The condition of an edge of the table, in a few words."""
    return ", ".join(filter(None, [RANGES[edge.enthalpy], SITES[edge.kinetic], BY[edge.by]]))


def change_of_heat(edge):
    """The kind of heat that the particle takes up before and after an edge."""
    before = dict(channels(edge.source)).get(RANGES[edge.enthalpy], main_channel(edge.source))
    after = main_channel(edge.target)
    return before if before == after else f"{before} → {after}"


def draw_states(path, edges=EDGES):
    """Draw states and edges; returns the texts in the picture."""
    from matplotlib.patches import FancyArrowPatch, FancyBboxPatch

    with plot(path, width=9.2, height=5.6) as ax:
        boxes = {}
        for phase, (x, y) in PLACES.items():
            boxes[phase] = ax.add_patch(FancyBboxPatch(
                (x - BOX[0], y - BOX[1]), 2 * BOX[0], 2 * BOX[1], zorder=3, linewidth=0.0,
                boxstyle="round,pad=0,rounding_size=0.2", facecolor=PHASE_COLOURS[phase]))
            ink = "white" if phase in (Phase.LIQUID, Phase.VAPOUR) else INK
            ax.text(x, y, f"{NAMES[phase].replace(' phase', chr(10) + 'phase')}\n{main_channel(phase)} heat", zorder=4,
                    ha="center", va="center", color=ink, fontsize=8.5, fontweight="bold")
        for edge in edges:
            (x0, y0), (x1, y1) = PLACES[edge.source], PLACES[edge.target]
            bend = BENDS.get((edge.source, edge.target), 0.0)
            ax.add_patch(FancyArrowPatch(
                (x0, y0), (x1, y1), connectionstyle=f"arc3,rad={bend}", arrowstyle="-|>", mutation_scale=14, color=INK,
                linewidth=1.1, zorder=2, patchA=boxes[edge.source], patchB=boxes[edge.target], shrinkA=1, shrinkB=3))
            x, y = 0.5 * (x0 + x1) + 0.5 * bend * (y1 - y0), 0.5 * (y0 + y1) - 0.5 * bend * (x1 - x0)
            ax.text(x, y, f"{trigger(edge)}\n{change_of_heat(edge)}", ha="center", va="center", fontsize=7.5, color=INK,
                    zorder=3, bbox=dict(facecolor="white", edgecolor="none", pad=1.5))
        ax.set(xlim=(-1.3, 11.3), ylim=(-4.3, 2.9))
        ax.set_axis_off()
        return [text.get_text() for text in ax.texts]


class StateDiagram(Figure):
    """The state machine of ``phases.py`` compared with the paper's description of its Fig. 2."""

    key = "fig2"
    title = "Figure 2: four states of a particle, what leads from one to another, and the kind of heat"

    def make(self, results, folder, quick):
        draw_states(folder / "states.png")
        rows = [(NAMES[edge.source], NAMES[edge.target], trigger(edge), change_of_heat(edge), edge.meaning)
                for edge in EDGES]
        columns = ("from", "to", "on", "heat", "meaning")
        found, more = statements()
        return self.section(
            pictures=[Picture("states.png", "The state machine, drawn from the table of transitions in phases.py, "
                                            "which the kernels implement. e is the enthalpy relative to saturated "
                                            "liquid, L the latent heat of a particle; vapour near a particle counts "
                                            "as a site. The last line at an arrow is the kind of heat taken up before "
                                            "and after.")
                      ],
            tables=[Table(columns, rows, "The edges")],
            data=[write_csv(folder / "edges.csv", dict(zip(columns, zip(*rows))))],
            statements=found,
            text="The statements are from sections 3.2.2, 3.3 and 4.2.2 of the paper, which describe the figure. "
            + more)


def statements():
    """The paper's statements on the transitions, with the row of the table that answers each; and what is not there."""
    table = {(edge.source, edge.target): edge for edge in EDGES}
    L, T, S, V = Phase
    transitions = [
        ("Liquid that reaches saturation with a nucleation site near it starts its phase change.", L, T, "not negative",
         True, "phase_change"),
        ("Liquid that reaches saturation without a site near it is superheated.", L, S, "not negative", False,
         "phase_change"),
        ("A superheated particle that comes near a site resumes its phase change; its excess sensible heat becomes "
         "latent.", S, T, "not negative", True, "phase_change"),
        ("Once the latent heat reaches its threshold the particle becomes vapour.", T, V, "full", None, "phase_change"),
        ("Where a region of superheated liquid holds too much heat, some of it becomes vapour at once, without a site.",
         S, V, "not negative", None, "nucleation"),
        ("Vapour below saturation condenses, as much of a bubble as the heat that it lost pays for.", V, L, "lacking",
         None, "condensation"),
    ]
    rows = []
    for paper, source, target, enthalpy, kinetic, by in transitions:
        edge, ours = table.get((source, target)), "no such edge"
        if edge:
            ours = f"{NAMES[source]} → {NAMES[target]} on {trigger(edge)}; {change_of_heat(edge)}"
        rows.append(Statement(
            paper, ours, edge is not None and (edge.enthalpy, edge.kinetic, edge.by) == (enthalpy, kinetic, by),
            fair="The row of the table in the code from which the kernels are made and tested; states, condition and "
                 "rule must be those of the text"))

    rows.insert(2, interruption())
    more = [edge for edge in EDGES if (edge.source, edge.target) not in
            {(source, target) for _, source, target, *_ in transitions} | {(T, S)}]
    return rows, ("The table has two transitions more than the text: "
                  + ", ".join(f"{NAMES[edge.source]} → {NAMES[edge.target]} on {trigger(edge)}" for edge in more)
                  + ". Without them a particle that cools below saturation would never become normal liquid again.")


def interruption(stored=0.5):
    """The statement on lost sites, judged in the paper's form; ``stored`` is the latent heat before, in units of L."""
    def warmed(form):
        """Rise of temperature [K] of particles that lose their site, and their phases."""
        toy = Toy(site=False, phases=PhaseChange(interrupt=form)).heat(stored, Phase.TRANSITION)
        phases, fluid = toy.step(stages=("phases",)), toy.fluid
        held = fluid.e_lat if "e_lat" in fluid.properties else np.zeros_like(fluid.e)
        return [float(temperature(e, phase, WATER, e_lat)) - WATER.T_sat
                for e, phase, e_lat in zip(fluid.e, phases, held)], phases

    jump, phases = warmed("convert")
    due = stored * WATER.L / WATER.c_l
    return judged(
        "A particle that loses its site goes from phase change to superheated, and the latent heat stored so far turns "
        "into sensible heat.",
        f"{sum(phases == Phase.SUPERHEATED)} of {len(phases)} particles that hold {stored:g} L become superheated, "
        f"{jump[0]:.0f} K hotter. By default this heat is held instead, and they are {warmed('hold')[0][0]:.0f} K "
        "hotter, because a particle should not jump by hundreds of kelvins in a step.",
        [bound("particles, of all, that become superheated", [np.mean(phases == Phase.SUPERHEATED)], 1, 1),
         bound("rise of temperature in K", jump, 0.999 * due, 1.001 * due)],
        fair="The kernels with --phases.interrupt convert, the paper's form, on a block of liquid; all the latent heat "
             "must be sensible afterwards")
