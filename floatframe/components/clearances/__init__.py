"""Joints with play: hinges and ball joints whose pin moves in its bearing, and dead bands along or about an axis."""

from floatframe.components.clearances.backlash import Backlash, BallWithPlay
from floatframe.components.clearances.hinge import HingeWithPlay

ELEMENTS = {
    "backlash": "floatframe.components.clearances.backlash:Backlash",
    "ball": "floatframe.components.clearances.backlash:BallWithPlay",
    "hinge": "floatframe.components.clearances.hinge:HingeWithPlay",
}

__all__ = ["Backlash", "BallWithPlay", "HingeWithPlay"]
