"""Whole decks of Nastran: one module for each kind of card; all add to one model.

`whole_deck` reads a deck and makes the cells of solids, shells and bars; `card_fields` lists all cards. Cells get their
properties and materials in `sections` (solids, shells, bars), `layups` (PCOMP), `tapers` (PBEAM) and `bars`
(orientation and offsets of CBAR, CBEAM). Elements without cells are in `springs` (CELAS, CBUSH), `panels` (shear panels
CSHEAR), `bends` (CBEND), `welds` (CWELD) and `attached` (masses, RBE2, RBE3, constraints, loads). `model` holds the
cards and results of a deck that is being read. A mesh alone is read by `fe_models.files.nastran.mesh`.
"""
