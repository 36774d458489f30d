"""A landing gear: a drop on a flexible piston with an oleo-pneumatic strut, retraction by a jack; and closed forms."""

from floatframe.machines.landing_gear.closed_forms import Retraction, retraction

__all__ = ["Retraction", "retraction"]
