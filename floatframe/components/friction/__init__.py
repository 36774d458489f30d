"""Friction with sticking and slipping, as public elements."""

from floatframe.components.friction.bristle_friction import BristleFriction

ELEMENTS = {"bristles": "floatframe.components.friction.bristle_friction:BristleFriction"}

__all__ = ["ELEMENTS", "BristleFriction"]
