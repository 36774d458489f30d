"""Whole decks of Abaqus and CalculiX: one module for each kind of block; all add to one draft."""
