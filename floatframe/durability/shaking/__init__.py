"""Vibration tests of a body or a system on moving bases: sine, random, shock, transients, notching, results."""
