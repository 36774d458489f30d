"""Relative coordinates: the tree of bodies, its joint coordinates, recursive kinematics and forces."""
