"""Named sensors that measure a motion, and the channels of controllers."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
