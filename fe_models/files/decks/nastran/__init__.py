"""Whole decks of Nastran: one module for each kind of card, all writing one model.

`whole_deck` reads a deck. `card_fields` lists all cards. Elements with their properties and materials are in
`sections` (solids, shells, bars), `bars` (orientation and offsets of CBAR, CBEAM), `springs` (CELAS, CBUSH), `layups`
(PCOMP), and `attached` (masses, RBE2, RBE3, constraints, loads).
"""
