"""Computed motions: results file, trajectory, and quantities evaluated from them."""
