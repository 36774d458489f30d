"""The constant-orientation joint: two bodies move without relative rotation."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.model.bodies.markers import Place
from floatframe.model.checked_values import rotation_of
from floatframe.model.joints.rows import FORCE, GAUGE, MOMENT, Row, orientation_rows

__all__ = ["ConstantOrientation"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class ConstantOrientation:
    """Fixes the orientation of marker B relative to marker A; three constraints.

    The fixed orientation is that of the assembled bodies, unless `rotation` is given.
    """

    name: str
    marker_a: Place
    marker_b: Place
    rotation: Array | None = None  #: fixed rotation R_AB from marker axes B to A, (3, 3); None: as assembled

    size = 6  #: components of the unknown wrench
    moment_b = MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ()

    def __post_init__(self) -> None:
        if self.rotation is not None:
            object.__setattr__(self, "rotation", rotation_of(f"joint {self.name!r}: rotation", self.rotation))

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), ground axes, as assembled."""
        R_AB = A_a.T @ A_b if self.rotation is None else self.rotation
        return (*(Row(GAUGE, axis, part=FORCE) for axis in np.eye(3)), *orientation_rows(R_AB))
