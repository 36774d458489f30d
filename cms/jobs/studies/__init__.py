"""Studies that a job file requests: mesh convergence, correlation with a test."""

from fe_models.door import open_door

open_door(__name__)
