"""Frames in frames, and rotations as roll, pitch and yaw."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["Frame", "rpy_of"]

UPRIGHT = 1e-12  #: cosine of the pitch below which roll and yaw turn about one axis


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame in another one."""

    x: Array = field(default_factory=lambda: np.zeros(3))  #: its origin, (3,)
    R: Array = field(default_factory=lambda: np.eye(3))  #: its axes as columns, (3, 3)

    def __matmul__(self, other: "Frame") -> "Frame":
        return Frame(self.x + self.R @ other.x, self.R @ other.R)

    @property
    def inverse(self) -> "Frame":
        """The other frame in this one."""
        return Frame(-self.R.T @ self.x, self.R.T)


def rpy_of(R: Array) -> Array:
    """Return roll, pitch and yaw of R = R_z(yaw) R_y(pitch) R_x(roll), (3,) [rad].

    Where the pitch is a right angle, yaw and roll turn about one axis: the roll is zero there.
    """
    cosine = float(np.hypot(R[0, 0], R[1, 0]))
    pitch = np.arctan2(-R[2, 0], cosine)
    if cosine < UPRIGHT:
        return np.array([0.0, pitch, np.arctan2(-R[0, 1], R[1, 1])])
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])
