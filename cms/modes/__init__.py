"""Modes: the families of static and vibration modes, and the mode sets that are made of them."""
