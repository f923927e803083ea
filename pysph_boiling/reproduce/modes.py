"""Figures 13 and 14: the paper's model, Gu et al. and Li & Xiao on the same vessel."""
