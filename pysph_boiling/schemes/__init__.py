"""The schemes, which put the equations in order, and the effects from which they are composed."""
