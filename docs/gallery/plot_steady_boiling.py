"""
Steady boiling
==============

A vessel on a hot base, in 2-D. Bubbles grow at six sites, leave them, rise and burst. :doc:`/docs/tutorials/first_boil`
explains this run.
"""
from pysph_boiling.examples.steady_boiling import SteadyBoiling

run = SteadyBoiling(output_dir="steady_boiling_output")
run.run(["--flat", "--openmp", "--quiet"])

# %%
# Nine moments of the run, and its results over time.

pictures = ["steady_boiling_output/frames.png", "steady_boiling_output/history.png"]

# %%
# When bubbles departed from each site, and how large they were.

import matplotlib.pyplot as plt

times, particles, sites = zip(*run.departures)
figure, axes = plt.subplots(figsize=(7, 3), layout="constrained")
dots = axes.scatter(times, sites, s=[6 * n for n in particles], c=particles)
figure.colorbar(dots, label="particles")
axes.set(xlabel="time [s]", ylabel="site")
