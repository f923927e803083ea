"""The equations of the model: one module per term, and one PySPH ``Equation`` per kernel."""
