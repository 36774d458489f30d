"""Stops at the ends of a stroke: dissipative linear springs that only push."""

from numba.extending import register_jitable

__all__ = ["stop_force"]


@register_jitable
def stop_force(depth, rate, stiffness, damping):
    """Return the force k x (1 + d dx/dt) >= 0 of a stop at depth x > 0, its energy, and the power it dissipates."""
    if depth.real <= 0.0:
        return 0.0 * depth, 0.0 * depth, 0.0 * depth
    factor = 1.0 + damping * rate
    if factor.real < 0.0:
        factor = 0.0 * factor
    spring = stiffness * depth
    return spring * factor, 0.5 * spring * depth, spring * (factor - 1.0) * rate
