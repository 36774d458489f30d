"""Beams: sections, properties, lines of nodes, interfaces, and what is attached to them."""

from fe_models.door import open_door

open_door(__name__, "fe_models.errors:ArgumentError")
