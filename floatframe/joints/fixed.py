"""The fixed joint: two markers share position and orientation."""

from dataclasses import dataclass

import numpy as np

from cms.arrays import Array
from floatframe.arrays import rotation_of
from floatframe.joints.rows import DOT, Row, point_rows
from floatframe.markers import Place

__all__ = ["FixedJoint"]


@dataclass(frozen=True, eq=False)
class FixedJoint:
    """Holds marker B at marker A; six constraints.

    The held orientation is the one in which the bodies were placed, unless `rotation` gives it.
    """

    name: str
    marker_a: Place
    marker_b: Place
    rotation: Array | None = None  #: R_AB from marker axes B to A that is held, (3, 3); None: as placed

    size = 6  #: components of the reaction: force, moment

    def __post_init__(self) -> None:
        if self.rotation is not None:
            object.__setattr__(self, "rotation", rotation_of(f"joint {self.name!r}: rotation", self.rotation))

    def rows(self, A_a: Array, A_b: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3) in ground axes, as placed.

        x_A·y' = y_A·z' = z_A·x' = 0 with the axes x', y', z' fixed in B that coincide with x_A, y_A, z_A.
        """
        R_AB = A_a.T @ A_b if self.rotation is None else self.rotation
        in_b = R_AB.T  # columns: the axes of A as they lie in B
        x, y, z = np.eye(3)
        pairs = ((x, in_b[:, 1]), (y, in_b[:, 2]), (z, in_b[:, 0]))
        return (*point_rows(), *(Row(DOT, a, b) for a, b in pairs))
