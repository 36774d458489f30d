"""Open equations of a system in Python (residual, matrices, constraints, maps), for the user's own integrators."""

from floatframe.engine.open_equations.body_equations import BodyEquations, body_equations
from floatframe.engine.open_equations.configuration import Configurations
from floatframe.engine.open_equations.integrators import radau, rattle
from floatframe.engine.open_equations.layout import Component, Layout
from floatframe.engine.open_equations.system_equations import Equations, Tangents, open_equations

__all__ = [
    "BodyEquations",
    "Component",
    "Configurations",
    "Equations",
    "Layout",
    "Tangents",
    "body_equations",
    "open_equations",
    "radau",
    "rattle",
]
