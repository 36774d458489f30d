"""Other descriptions of flexible parts than one floating frame, each a handful of bodies, joints and forces."""

from floatframe.descriptions.finite_segments import finite_segments
from floatframe.descriptions.flexible_part import FlexiblePart, PartMaker
from floatframe.descriptions.superelement import corotational

__all__ = ["FlexiblePart", "PartMaker", "corotational", "finite_segments"]
