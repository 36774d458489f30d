"""Shells: properties, laminates, meshes, interfaces and stresses."""

from fe_models.door import open_door

open_door(__name__, "fe_models.errors:ArgumentError")
