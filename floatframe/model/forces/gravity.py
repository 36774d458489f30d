"""Gravity: a uniform field."""

from dataclasses import dataclass

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.model.checked_values import array_of_shape

__all__ = ["Gravity"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class Gravity:
    """A uniform gravitational acceleration, which acts on every particle of the deformed bodies."""

    acceleration: Array  #: ground axes, (3,) [m/s²], such as (0, 0, -9.81)

    def __post_init__(self) -> None:
        object.__setattr__(self, "acceleration", array_of_shape("gravity", self.acceleration, (3,)))
