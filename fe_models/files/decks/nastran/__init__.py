"""Whole decks of Nastran: one module for each kind of card, all writing one model."""
