"""Figure 1: superheated liquid over time for several numbers of preset sites."""
