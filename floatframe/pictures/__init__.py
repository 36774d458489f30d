"""Plots, pictures and films of systems and their motions."""
