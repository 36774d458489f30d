"""Cables that run over points of bodies, as public elements."""

from floatframe.cables.cable import Cable

ELEMENTS = {"cable": "floatframe.cables.cable:Cable"}

__all__ = ["ELEMENTS", "Cable"]
