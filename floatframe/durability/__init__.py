"""Durability: vibration tests and fatigue."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
