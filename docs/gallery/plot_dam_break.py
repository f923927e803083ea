"""
Dam break
=========

No heat at all: a column of water collapses, and its front is compared with two experiments. ``--quick`` has a quarter
of the particles.
"""
from pysph_boiling.examples.dam_break import DamBreak

run = DamBreak(output_dir="dam_break_output")
run.run(["--quick", "--openmp", "--quiet"])

# %%
# Nine moments of the run, coloured by speed, and the position of the front.

pictures = ["dam_break_output/frames.png", "dam_break_output/front.png"]
