"""A landing gear: drop, braking, shimmy, taxi, landing and retraction; closed forms and small motions."""

from floatframe.machines.landing_gear.shimmy import (
    Retraction,
    critical_speed,
    growth,
    retraction,
    rolling,
    rolling_state,
    shimmy_locus,
)

__all__ = ["Retraction", "critical_speed", "growth", "retraction", "rolling", "rolling_state", "shimmy_locus"]
