"""Forces and loads, beyond the common ones of `floatframe` itself."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
