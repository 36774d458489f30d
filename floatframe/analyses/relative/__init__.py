"""Analyses in joint coordinates: a basis of named small motions, and steps towards an equilibrium."""
