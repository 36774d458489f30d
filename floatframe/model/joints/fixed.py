"""The fixed joint: two markers have the same position and orientation."""

from dataclasses import dataclass

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.model.bodies.markers import Place
from floatframe.model.checked_values import rotation_of
from floatframe.model.joints.rows import MOMENT, Row, orientation_rows, point_rows

__all__ = ["FixedJoint"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class FixedJoint:
    """Fixes marker B to marker A; six constraints.

    The fixed orientation is that of the assembled bodies, unless `rotation` is given.
    """

    name: str
    marker_a: Place
    marker_b: Place
    rotation: Array | None = None  #: fixed rotation R_AB from marker axes B to A, (3, 3); None: as assembled

    size = 6  #: components of the unknown wrench: force, moment
    moment_b = MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ()

    def __post_init__(self) -> None:
        if self.rotation is not None:
            object.__setattr__(self, "rotation", rotation_of(f"joint {self.name!r}: rotation", self.rotation))

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), ground axes, as assembled."""
        R_AB = A_a.T @ A_b if self.rotation is None else self.rotation
        return (*point_rows(), *orientation_rows(R_AB))
