"""
Heat in PySPH's own scheme
==========================

PySPH's WCSPH, unmodified, with our heat equations: a wave of temperature drifts with the fluid and decays.
:doc:`/docs/tutorials/heat_in_sph` shows how to add these equations to a program of your own.
"""
from pysph_boiling.examples.heat_wave import HeatWave

run = HeatWave(output_dir="heat_wave_output")
run.run(["--openmp", "--quiet"])

# %%
# The wave at the start and at the end.

pictures = ["heat_wave_output/profile.png"]
