"""The reduced body and its data: invariants, geometric stiffness, stress, labels."""

from fe_models.door import open_door

open_door(__name__, "cms.errors:ArgumentError")
