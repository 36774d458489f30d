"""Whole decks of ANSYS."""
