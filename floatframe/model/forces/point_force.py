"""A force and torque at a marker, fixed in space or in the body."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import array_of_shape
from floatframe.model.functions.time_functions import TimeFunction

__all__ = ["PointForce"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class PointForce:
    """A force and a torque on a marker."""

    name: str
    marker: Marker
    force: Array = field(default_factory=lambda: np.zeros(3))  #: (3,) [N]
    torque: Array = field(default_factory=lambda: np.zeros(3))  #: (3,) [N m]
    is_follower: bool = False  #: True: components in the axes of the (deformed) marker; False: ground axes
    amplitude: TimeFunction | None = None  #: function of time that multiplies both; None: one

    def __post_init__(self) -> None:
        if not isinstance(self.amplitude, TimeFunction | None):
            raise ModelError(
                f"force {self.name!r}: amplitude: expected a function of "
                f"floatframe.model.functions.time_functions, got "
                f"{self.amplitude!r}"
            )
        for name in ("force", "torque"):
            value = array_of_shape(f"force {self.name!r}: {name}", getattr(self, name), (3,))
            object.__setattr__(self, name, value)
