"""Load cases of a body, and the loads that they consist of."""

from fe_models.door import open_door

open_door(__name__, "fe_models.errors:ArgumentError")
