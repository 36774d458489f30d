"""Analyses of a system other than a run: equilibrium, driven motion, linearisation, system modes, responses."""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
