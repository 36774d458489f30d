"""The time loop (`integrate`) with its events, its restart, and the checks of step size and linear frames."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
