"""Reports: presentation of records without computation."""

from fe_models.door import open_door

open_door(__name__)
