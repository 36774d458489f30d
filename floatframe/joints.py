"""Joints and the coordinates along and about their axes, beyond the common joints of `floatframe` itself."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
