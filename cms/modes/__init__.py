"""Modes: the families of static and vibration modes, and the mode sets made from them."""
