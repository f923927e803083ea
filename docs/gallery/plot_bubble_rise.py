"""
A bubble rises
==============

One bubble of vapour in superheated water, in 2-D. It takes up heat, grows, rises and leaves through the surface.
"""
from pysph_boiling.examples.bubble_rise import BubbleRise

run = BubbleRise(output_dir="bubble_rise_output")
run.run(["--flat", "--openmp", "--quiet"])

# %%
# Nine moments of the run. Vapour is red, superheated water is orange.

pictures = ["bubble_rise_output/frames.png"]

# %%
# What the scene measures of its largest bubble at each output.

import matplotlib.pyplot as plt

bubble = run.history()
figure, (rise, growth) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
rise.plot(bubble["t"], 1e3 * bubble["height1"])
rise.set(xlabel="time [s]", ylabel="height of its centre [mm]")
growth.plot(bubble["t"], bubble["n1"])
growth.set(xlabel="time [s]", ylabel="particles in the bubble")
