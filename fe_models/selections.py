"""Selections of nodes of a mesh: by sets and groups of its file, by numbers and by place."""

from fe_models.door import open_door

open_door(__name__, "fe_models.errors:ArgumentError")
