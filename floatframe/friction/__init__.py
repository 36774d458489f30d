"""Friction that sticks and slips, as public elements."""

from floatframe.friction.bristle_friction import BristleFriction

ELEMENTS = {"bristles": "floatframe.friction.bristle_friction:BristleFriction"}

__all__ = ["ELEMENTS", "BristleFriction"]
