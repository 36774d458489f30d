"""Steady running: vehicles that go straight on or turn with a constant radius, their wheels spinning."""
