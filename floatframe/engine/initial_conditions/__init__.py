"""Computations before a motion: consistent positions, velocities and accelerations, and diagnosis of constraints."""
