"""Figure 2: the states of a particle and the edges between them."""
