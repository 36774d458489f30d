"""Files: systems, signals, models of other programs, and co-simulation."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
