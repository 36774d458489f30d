"""Stops at the ends of a stroke: linear springs that lose energy and never pull."""

from numba.extending import register_jitable

__all__ = ["stop_force"]


@register_jitable
def stop_force(depth, rate, stiffness, damping):
    """Return the force k x (1 + d dx/dt) of a stop at depth x > 0, never below 0, its energy and the power it loses."""
    if depth.real <= 0.0:
        return 0.0 * depth, 0.0 * depth, 0.0 * depth
    factor = 1.0 + damping * rate
    if factor.real < 0.0:
        factor = 0.0 * factor
    spring = stiffness * depth
    return spring * factor, 0.5 * spring * depth, spring * (factor - 1.0) * rate
