"""Rows of joints in the kernels: the formulas of each kind, and what they are made of."""
