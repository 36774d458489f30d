"""Steady running: vehicles with spinning wheels that run straight or in a circle."""
