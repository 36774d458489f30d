"""Open equations of a system (residual, matrices, constraints, maps) in Python, for integrators of the user."""

from floatframe.equations.body_equations import BodyEquations, body_equations
from floatframe.equations.configuration import Configurations
from floatframe.equations.layout import Component, Layout
from floatframe.equations.radau import radau
from floatframe.equations.rattle import rattle
from floatframe.equations.system_equations import Equations, Tangents, open_equations

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
