"""Computed motions: the file, the trajectory, and what is recovered from it."""
