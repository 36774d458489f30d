"""Bearings described by coefficients, as public elements."""

from floatframe.bearings.bearing import Bearing

ELEMENTS = {"bearing": "floatframe.bearings.bearing:Bearing"}

__all__ = ["ELEMENTS", "Bearing"]
