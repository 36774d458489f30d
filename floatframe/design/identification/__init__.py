"""Inertial parameters of trees: linear forms, base parameters, exciting motions, estimation from measurements."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
