"""
Two bubbles merge
=================

The lower bubble is larger, rises faster, and catches the other. Bubbles are connected components of vapour, so two
become one where they touch; cohesion pulls the one bubble round.
"""
from pysph_boiling.examples.bubble_merge import BubbleMerge

run = BubbleMerge(output_dir="bubble_merge_output")
run.run(["--flat", "--openmp", "--quiet"])

# %%
# Nine moments of the run.

pictures = ["bubble_merge_output/frames.png"]

# %%
# The number of bubbles, and the particles in the largest one.

import matplotlib.pyplot as plt

bubbles = run.history()
figure, (number, size) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
number.step(bubbles["t"], bubbles["bubbles"], where="post")
number.set(xlabel="time [s]", ylabel="bubbles")
size.plot(bubbles["t"], bubbles["n1"])
size.set(xlabel="time [s]", ylabel="particles in the largest bubble")
