"""Relative coordinates: a tree of bodies, coordinates of its joints, recursive kinematics and forces."""
