"""Computed once before a motion: consistent positions, velocities and accelerations, and diagnoses of constraints."""
