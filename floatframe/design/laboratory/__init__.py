"""The reference laboratory: one mechanism with many descriptions of its flexible body, each against a reference."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
