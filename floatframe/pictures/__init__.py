"""Plots, pictures and films of systems and their motions."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
