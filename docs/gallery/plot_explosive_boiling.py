"""
Explosive boiling
=================

Superheated water without nucleation sites bursts: regions turn into vapour at once, and lift the water over them.
"""
from pysph_boiling.examples.explosive_boiling import ExplosiveBoiling

run = ExplosiveBoiling(output_dir="explosive_boiling_output")
run.run(["--flat", "--openmp", "--quiet"])

# %%
# Nine moments of the run.

pictures = ["explosive_boiling_output/frames.png"]

# %%
# Vapour over time, and the heat of the superheated water from which it comes.

import matplotlib.pyplot as plt

from pysph_boiling.results import load_run

results = load_run("explosive_boiling_output").results
figure, (vapour, heat) = plt.subplots(1, 2, figsize=(8, 3), layout="constrained")
vapour.plot(results["t"], results["n_vapour"])
vapour.set(xlabel="time [s]", ylabel="particles of vapour")
heat.plot(results["t"], 1e-3 * results["energy_superheated"])
heat.set(xlabel="time [s]", ylabel="superheated water [kJ/m]")
