"""Functions of time for drives, loads and bases: pieces, tables, moves from rest to rest."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
