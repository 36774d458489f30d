"""The model: what a user describes, from bodies and joints to forces, functions and elements."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
