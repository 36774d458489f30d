"""Aerodynamic forces as public elements."""

from floatframe.components.aerodynamics.lifting_surface import LiftingSurface

ELEMENTS = {"lifting-surface": "floatframe.components.aerodynamics.lifting_surface:LiftingSurface"}

__all__ = ["ELEMENTS", "LiftingSurface"]
