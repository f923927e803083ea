"""
A hot plate under still water
=============================

Conduction alone, without motion, against the exact solution.
"""
from pysph_boiling.examples.heated_slab import HeatedSlab

run = HeatedSlab(output_dir="heated_slab_output")
run.run(["--openmp", "--quiet"])

# %%
# The temperature over the height.

pictures = ["heated_slab_output/profile.png"]
