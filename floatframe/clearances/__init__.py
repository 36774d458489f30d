"""Joints with play: hinges and ball joints whose pin moves in its bearing, and dead bands along or about an axis."""

from floatframe.clearances.backlash import Backlash
from floatframe.clearances.ball import BallWithPlay
from floatframe.clearances.hinge import HingeWithPlay

ELEMENTS = {
    "backlash": "floatframe.clearances.backlash:Backlash",
    "ball": "floatframe.clearances.ball:BallWithPlay",
    "hinge": "floatframe.clearances.hinge:HingeWithPlay",
}

__all__ = ["ELEMENTS", "Backlash", "BallWithPlay", "HingeWithPlay"]
