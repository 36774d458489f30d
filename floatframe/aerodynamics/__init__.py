"""Aerodynamic forces as public elements."""

from floatframe.aerodynamics.lifting_surface import LiftingSurface

ELEMENTS = {"lifting-surface": "floatframe.aerodynamics.lifting_surface:LiftingSurface"}

__all__ = ["ELEMENTS", "LiftingSurface"]
