"""Public elements: forces, joints and components, which users and other packages add without changes to the core."""

from floatframe.model.elements.element import NOTHING, POSITION, VELOCITY, Element, ElementLaw, GapSpring, Placed

__all__ = ["ELEMENTS", "NOTHING", "POSITION", "VELOCITY", "Element", "ElementLaw", "GapSpring", "Placed"]

#: element types of this package, by their names in system files without "elements."
ELEMENTS = {"expressions": "floatframe.model.elements.expressions:ExpressionElement"}
