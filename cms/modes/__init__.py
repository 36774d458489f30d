"""Modes: the families of static and vibration modes, and the mode sets made from them."""

from fe_models.door import open_door

open_door(__name__, "cms.errors:ArgumentError")
