"""Tables 1 and 2: properties of the models of boiling and the kind of heat in each state, found by running the code."""
import numpy as np

from pysph_boiling.evaluation.reproduce.figure import Figure
from pysph_boiling.evaluation.reproduce.rules import Toy
from pysph_boiling.evaluation.reproduce.runs import Run
from pysph_boiling.evaluation.reproduce.states import NAMES, channels
from pysph_boiling.phases import Phase
from pysph_boiling.report.sections import Statement, Table, write_csv
from pysph_boiling.schemes.effects import Condensation, DensityConstraint, PhaseChange
from pysph_boiling.schemes.modes import MODES

__all__ = ["HeatChannels", "Models", "PAPER_MODELS", "answers"]

ASPECTS = ("Method", "Superheat capability", "Phase transition condition", "Phase-transition candidate particle",
           "Superheat treatment")
PAPER_MODELS = {  # the paper's cells, its Table 1
    "gu": ("SPH", "No", "Thermodynamic only", "Liquid particles", "No"),
    "li_xiao": ("PBF", "Yes", "Thermodynamic only", "Preset nucleation sites", "No"),
    "dynamic": ("PBF", "Yes", "Thermodynamic + Kinetic", "Liquid particles", "Yes"),
}
PAPER_CHANNELS = dict.fromkeys(Phase, "sensible") | {Phase.TRANSITION: "latent"}  # its Table 2
WARM, HOT, COLD = 0.02, 0.3, -0.02  # enthalpy over L: 11 K and 161 K above saturation, 11 K below


HOSTS = {"WCSPHScheme": "SPH"}  # PySPH's scheme -> the method


def hosted_method(result):
    """The method of a run in which the model is a guest of a scheme of PySPH: "other" unless it boiled there."""
    boiled = result.results["n_nucleated"][-1] > 0.0
    return HOSTS.get(result.record["scheme"], "other") if boiled else "other"


def answers(mode):
    """Properties of a model: aspect -> answer, in the paper's words where they apply.

    They are found by running the model on small blocks of liquid (:class:`Toy`): a warm block with and without a site,
    a hot block without a site, and a cold block at a site that holds heat.
    """
    toys = {site: Toy(mode, site=site).heat(WARM) for site in (True, False)}
    phases = {site: toy.step(2) for site, toy in toys.items()}
    near = toys[True].near
    enters = {"near": np.all(phases[True][near] == Phase.TRANSITION),
              "far": np.all(phases[True][~near] == Phase.TRANSITION),
              "without": np.all(phases[False] == Phase.TRANSITION),
              "cold": np.any(Toy(mode).heat(COLD).step(2) == Phase.TRANSITION)}
    sites = toys[True].sites
    in_sites = "Q_s" in sites.properties and sites.Q_s[0] > 0.0
    conditions = {(True, True, True, False): "Thermodynamic only",
                  (True, False, False, False): "Thermodynamic + Kinetic"}
    condition = conditions.get(tuple(bool(enters[name]) for name in ("near", "far", "without", "cold")))
    if condition is None and in_sites and cold_site_emits(mode):
        condition = "A site that holds enough heat, for any state of the particle"

    treated = Toy(mode, site=False).heat(HOT)
    vapour = np.count_nonzero(treated.step() == Phase.VAPOUR)
    return dict(zip(ASPECTS, (
        "PBF" if isinstance(toys[True].scheme.effects.get("density"), DensityConstraint) else "other",
        "Yes" if np.all(phases[False] == Phase.SUPERHEATED) else "No",
        condition or "other",
        "Preset nucleation sites" if in_sites else "Liquid particles" if enters["near"] else "other",
        "Yes" if vapour else "No")))


def cold_site_emits(mode):
    """Whether a site that holds heat turns liquid below saturation into vapour."""
    toy = Toy(mode).heat(COLD)
    toy.sites.Q_s[:] = 100.0 * toy.fluid.m[0] * toy.scheme.material.L
    return bool(np.any(toy.step() == Phase.VAPOUR))


class Models(Figure):
    """Table 1: the three models, compared by running the kernels of each on blocks of liquid."""

    key = "table1"
    title = "Table 1: three models of boiling: which superheats, on which condition, and what it does about it"

    def runs(self, quick):
        return [Run("gu_in_wcsph", "reuse_wcsph", ("--mode", "gu", *(("--tf", "0.35") if quick else ())),
                    resumes=False)]

    def make(self, results, folder, quick):
        ours = {mode: answers(mode) for mode in PAPER_MODELS}
        hosted = results["gu_in_wcsph"]
        ours["gu"]["Method"] = hosted_method(hosted)
        rows = [(MODES[mode].source, aspect, cell, ours[mode][aspect])
                for mode, cells in PAPER_MODELS.items() for aspect, cell in zip(ASPECTS, cells)]
        columns = ("model", "aspect", "the paper", "ours")
        words = [(MODES[mode].source, MODES[mode].latent_stage, MODES[mode].storage, MODES[mode].vapour)
                 for mode in PAPER_MODELS]
        return self.section(
            tables=[Table(columns, rows, "Cell by cell"),
                    Table(("model", "enters the latent stage", "stores latent heat", "becomes vapour"), words,
                          "The models in words, from schemes/modes.py")],
            data=[write_csv(folder / "models.csv", dict(zip(columns, zip(*rows))))],
            statements=[self.statement(aspect, k, ours) for k, aspect in enumerate(ASPECTS)],
            text=f"Our cells are found by running the kernels of each mode on a block of {Toy.SIDE**2} particles that "
                 f"is warm (e = {WARM} L), hot ({HOT} L) or cold ({COLD} L), with or without a site. The method of Gu "
                 f"et al. is that of a run in which their model is a guest of PySPH's {hosted.record['scheme']}: "
                 f"{hosted.results['n_nucleated'][-1]:.0f} particles became vapour, {len(hosted.record['departures'])} "
                 f"bubbles departed, and at most {np.max(hosted.results['n_superheated']):.0f} particles were "
                 "superheated. In the figures it runs on the same fluid as the others, so that they only differ in the "
                 "phase change.")

    def statement(self, aspect, k, ours):
        def text(cells):
            return "; ".join(f"{MODES[mode].source}: {cell}" for mode, cell in cells.items())

        paper, own = ({mode: PAPER_MODELS[mode][k] for mode in ours}, {mode: ours[mode][aspect] for mode in ours})
        why = {
            "Method": "The model of Gu et al. did not boil in a scheme of PySPH.",
            "Phase transition condition":
                "The paper's text (section 6) says that Li & Xiao consider neither condition of a particle, but its "
                "table says thermodynamic. Here a site collects heat from liquid above saturation, and the liquid that "
                "it turns into vapour may be colder.",
        }
        return Statement(f"{aspect}. {text(paper)}", text(own), paper == own,
                         "" if paper == own else why.get(aspect, ""),
                         fair="Every cell must be the paper's, in the words to which the kernels' answers on blocks of "
                              "liquid lead")


class HeatChannels(Figure):
    """Table 2: the kind of heat that a particle takes up in each state."""

    key = "table2"
    title = "Table 2: sensible or latent: the kind of heat that each state takes up"

    def make(self, results, folder, quick):
        papers = dict(phases=PhaseChange(interrupt="convert"), condensation=Condensation(form="paper"))
        rows, statements = [], []
        for phase, paper in PAPER_CHANNELS.items():
            own, literal = channels(phase), channels(phase, **papers)
            rows.append((NAMES[phase], f"{paper} heat", describe_channels(literal), describe_channels(own)))
            statements.append(Statement(
                f"{NAMES[phase].capitalize()}: {paper} heat",
                describe_channels(literal) + ("." if own == literal else
                                              f"; by default {describe_channels(own)}. {WHY[phase]}"),
                {kind for _, kind in literal} == {paper},
                fair="The kernels' temperature in the paper's forms before and after a little heat: it must rise with "
                     "sensible heat, and stay with latent heat"))
        columns = ("state", "the paper", "ours in the paper's forms", "ours by default")
        return self.section(
            tables=[Table(columns, rows, "e is the enthalpy relative to saturated liquid, e_lat the latent heat held "
                          "since an interruption")],
            data=[write_csv(folder / "channels.csv", dict(zip(columns, zip(*rows))))], statements=statements,
            text="The kind of heat is found by adding a little heat to a particle and checking its temperature. The "
                 "paper's forms are --phases.interrupt convert and --condensation.form paper.")


WHY = {
    Phase.SUPERHEATED: "A particle whose phase change was interrupted keeps the stored latent heat, because otherwise "
                       "its temperature would jump.",
    Phase.VAPOUR: "Vapour that loses heat does not cool here; the loss is latent heat of its bubble, which condenses "
                  "particle by particle. If vapour cooled instead, a bubble of eleven particles would never condense, "
                  "even in ice water.",
}


def describe_channels(found):
    """Text for the result of :func:`channels`: a single kind of heat if it is the same in all ranges."""
    kinds = list(dict.fromkeys(kind for _, kind in found))
    if len(kinds) == 1:
        return f"{kinds[0]} heat"
    return "; ".join(f"{kind} heat where {name}" for name, kind in found)
