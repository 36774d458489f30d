"""Ready systems, each a function that returns a `System`: rigid by default, flexible with reduced bodies."""

from floatframe.mechanisms.linkages import four_bar, slider_crank
from floatframe.mechanisms.pendulums import chain, double_pendulum, pendulum
from floatframe.mechanisms.satellite import satellite
from floatframe.mechanisms.spinning import rotating_blade, spin_up_beam, spinning_shaft
from floatframe.mechanisms.telescopic import telescopic_slider_crank
from floatframe.mechanisms.top import spinning_top

__all__ = [
    "chain",
    "double_pendulum",
    "four_bar",
    "pendulum",
    "rotating_blade",
    "satellite",
    "slider_crank",
    "spin_up_beam",
    "spinning_shaft",
    "spinning_top",
    "telescopic_slider_crank",
]
