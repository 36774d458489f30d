"""Ready systems, each a function that returns a `System`: rigid by default, flexible with reduced bodies."""

from floatframe.mechanisms.linkages import four_bar, slider_crank
from floatframe.mechanisms.pendulums import chain, double_pendulum, pendulum
from floatframe.mechanisms.satellite import satellite
from floatframe.mechanisms.top import spinning_top

__all__ = ["chain", "double_pendulum", "four_bar", "pendulum", "satellite", "slider_crank", "spinning_top"]
