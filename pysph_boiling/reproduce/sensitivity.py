"""Table 3: how much the empirical constants matter."""
