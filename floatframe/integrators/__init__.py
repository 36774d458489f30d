"""Integrators, one file each. The time loop is `floatframe.simulation.integrate`.

An integrator is a frozen object with the functions `start` and `step`. Its state between steps is a `Memory`.
"""

from fe_models.door import open_door

open_door(__name__, "floatframe.errors:ModelError")
