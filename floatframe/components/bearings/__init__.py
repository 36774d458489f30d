"""Bearings described by coefficients, as public elements."""

from floatframe.components.bearings.bearing import Bearing

ELEMENTS = {"bearing": "floatframe.components.bearings.bearing:Bearing"}

__all__ = ["ELEMENTS", "Bearing"]
