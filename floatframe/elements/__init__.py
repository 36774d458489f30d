"""Public elements: forces, joints and components of users and of the rooms beside, without a change of the core."""

from floatframe.elements.element import NOTHING, POSITION, VELOCITY, Element, ElementLaw, GapSpring, Placed

__all__ = ["ELEMENTS", "NOTHING", "POSITION", "VELOCITY", "Element", "ElementLaw", "GapSpring", "Placed"]

#: elements of this room, by their names in system files ("elements.expressions")
ELEMENTS = {"expressions": "floatframe.elements.expressions:ExpressionElement"}
