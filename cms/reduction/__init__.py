"""Reduction: from a body and a mode set to a reduced body in its body frame, with geometric stiffness and recovery."""

from fe_models.door import open_door

open_door(__name__, "cms.errors:ArgumentError")
