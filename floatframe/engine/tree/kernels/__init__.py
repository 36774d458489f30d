"""Kernels of relative coordinates: the absolute iterate from joint coordinates, and forces projected back."""
