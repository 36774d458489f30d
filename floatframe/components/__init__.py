"""Components: elements that are built on the model alone, such as tyres, rails, drives and hydraulics."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
