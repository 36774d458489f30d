"""An aircraft that rolls steadily before it meets an obstacle."""

from floatframe.analyses.steady.steady_motion import steady_motion
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["rolling_state"]


def rolling_state(system: System, speed: float, *, body: str = "fuselage") -> State:
    """Return the state of straight rolling at a speed [m/s], with wings, struts and tyres under static load.

    A motion that begins from it, `integrate(system, ..., state=...)`, shows only the effect of the obstacles.
    """
    return steady_motion(system, body, speed).equilibrium.state
