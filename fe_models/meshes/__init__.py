"""Meshes as data: solids, shells and lines, their boundary, selections of nodes, and the cut into parts."""

from fe_models.door import open_door

open_door(__name__, "fe_models.errors:ArgumentError")
