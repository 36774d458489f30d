"""Public elements: forces, joints and components of users and of the rooms beside, without a change of the core."""

from floatframe.elements.element import NOTHING, POSITION, VELOCITY, Element, ElementLaw, Placed

__all__ = ["NOTHING", "POSITION", "VELOCITY", "Element", "ElementLaw", "Placed"]
