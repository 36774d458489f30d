"""Computed motions: the results file (`writer`, `results_file`), the trajectory, and quantities computed from them."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
