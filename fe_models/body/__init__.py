"""The finite element model of one body (`FEBody`), its interfaces, couplings and loads."""

from fe_models.door import open_door

open_door(__name__, "fe_models.errors:ArgumentError")
