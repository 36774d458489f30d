"""Files of Abaqus and CalculiX: keyword blocks (`blocks`), a mesh (`mesh`), whole decks (`whole_deck`), matrices.

A module for each kind of block of a whole deck adds to one draft.
"""
