"""Design: sweeps, optimisation, sensitivities, identification, generated code and the laboratory."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
