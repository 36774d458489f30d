"""An aircraft that rolls steadily before it meets something."""

from floatframe.analyses.steady.steady_motion import steady_motion
from floatframe.state import State
from floatframe.system import System

__all__ = ["rolling_state"]


def rolling_state(system: System, speed: float, *, body: str = "fuselage") -> State:
    """Return the state in which all rolls straight on with a speed [m/s], wings sagged, struts and tyres pressed.

    A motion that begins from it, `integrate(system, ..., state=...)`, shows nothing but what comes on the way.
    """
    return steady_motion(system, body, speed).equilibrium.state
