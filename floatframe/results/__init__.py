"""Computed motions: the results file (`writer`, `results_file`), the trajectory, and quantities computed from them."""
