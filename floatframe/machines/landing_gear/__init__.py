"""A landing gear: drop, braking, shimmy, taxi, landing and retraction; closed forms and small motions."""

from floatframe.machines.landing_gear.closed_forms import Retraction, retraction
from floatframe.machines.landing_gear.shimmy import critical_speed, growth, rolling, shimmy_locus
from floatframe.machines.landing_gear.taxi import rolling_state

__all__ = ["Retraction", "critical_speed", "growth", "retraction", "rolling", "rolling_state", "shimmy_locus"]
