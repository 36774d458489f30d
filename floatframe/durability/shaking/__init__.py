"""Vibration tests of a body or a system on moving bases: sine, random, shock, transients, notching, results."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
