"""Public elements: forces, joints and components of users and of other rooms, added without changes to the core."""

from floatframe.model.elements.element import NOTHING, POSITION, VELOCITY, Element, ElementLaw, GapSpring, Placed

__all__ = ["ELEMENTS", "NOTHING", "POSITION", "VELOCITY", "Element", "ElementLaw", "GapSpring", "Placed"]

#: elements of this room, by their names in system files without "elements."
ELEMENTS = {"expressions": "floatframe.model.elements.expressions:ExpressionElement"}
