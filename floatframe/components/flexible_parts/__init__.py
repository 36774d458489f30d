"""Flexible parts of several bodies, joints and forces: alternatives to a body in a single floating frame."""

from floatframe.components.flexible_parts.exact_beams import exact_beams
from floatframe.components.flexible_parts.finite_segments import finite_segments, floating_parts
from floatframe.components.flexible_parts.flexible_part import FlexiblePart, PartMaker
from floatframe.components.flexible_parts.superelement import corotational

__all__ = ["FlexiblePart", "PartMaker", "corotational", "exact_beams", "finite_segments", "floating_parts"]
