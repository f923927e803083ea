"""The terms of the model: one module a term, one PySPH Equation a kernel."""
