"""Reduced bodies of straight beams without a mesh, from assumed functions."""
