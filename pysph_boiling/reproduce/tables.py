"""Tables 1 and 2, made from the code."""
