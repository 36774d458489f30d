"""Reports about a mesh or a frame before its reduction: counts, quality, units, findings."""

from fe_models.door import open_door

open_door(__name__, "fe_models.errors:ArgumentError")
