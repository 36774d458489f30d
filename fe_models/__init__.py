"""Finite element models of bodies: meshes, materials, elements, interfaces and loads."""

from fe_models.door import open_door

open_door(__name__, "fe_models.errors:ArgumentError")
