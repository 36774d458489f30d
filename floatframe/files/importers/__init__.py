"""Robots described in URDF, read and written: links become bodies, joints joints; and back."""
