"""Cables that run over points of bodies, as public elements."""

from floatframe.components.cables.cable import Cable

ELEMENTS = {"cable": "floatframe.components.cables.cable:Cable"}

__all__ = ["ELEMENTS", "Cable"]
