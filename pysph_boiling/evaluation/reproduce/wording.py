"""What the report of the paper's figures and tables says of itself."""
from pysph_boiling.evaluation.reproduce.faults import caveat
from pysph_boiling.report.page import Wording

__all__ = ["PAPER"]

PAPER = Wording(
    title="Boiling: the paper, reproduced",
    intro="Each figure and table of <cite>Physically Based Boiling Simulation with Thermally Driven Dynamic "
          "Nucleation</cite>, next to what pysph_boiling shows for it. Boiling is chaotic: figures over several seeds "
          "are given as mean (lowest to highest). {form}A disagreement is a finding and says why.",
    quick="This is the quick form: small scenes that show that everything works; the full form has the paper's size. ",
    counted="statements of the paper",
    sides=("the paper", "ours"),
    command="reproduce",
    caveat=caveat)
