"""Exchange: reduced bodies of other programs, read and written."""

from fe_models.door import open_door

open_door(__name__, "cms.errors:ArgumentError")
