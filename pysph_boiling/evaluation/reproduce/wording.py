"""The texts of the report on the paper's figures and tables."""
from pysph_boiling.evaluation.reproduce.faults import caveat
from pysph_boiling.report.page import Wording

__all__ = ["PAPER"]

PAPER = Wording(
    title="Boiling: the paper, reproduced",
    intro="Each figure and table of <cite>Physically Based Boiling Simulation with Thermally Driven Dynamic "
          "Nucleation</cite> is compared with the results of pysph_boiling. Boiling is chaotic, so results of several "
          "seeds are given as mean (lowest to highest). {form}For each disagreement the reason is given.",
    quick="This is the quick form with small scenes, which only shows that everything works; the full form has the "
          "paper's size. ",
    counted="statements of the paper",
    sides=("the paper", "ours"),
    command="reproduce",
    caveat=caveat)
