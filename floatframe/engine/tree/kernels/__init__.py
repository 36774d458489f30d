"""Kernels of relative coordinates: the absolute iterate follows from joint coordinates, and forces go back to them."""
