"""Assessment: quality of a reduced body, comparison of mode sets, correlation with tests, reports and pictures."""

from fe_models.door import open_door

open_door(__name__, "cms.errors:ArgumentError")
