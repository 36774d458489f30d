"""Relative frames, and rotations by roll, pitch and yaw."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["Frame", "rpy_of"]

UPRIGHT = 1e-12  #: cosine of the pitch below which roll and yaw rotate about the same axis


@dataclass(frozen=True, eq=False)
class Frame:
    """A frame relative to another frame."""

    x: Array = field(default_factory=lambda: np.zeros(3))  #: position of the origin, (3,)
    R: Array = field(default_factory=lambda: np.eye(3))  #: axes as columns, (3, 3)

    def __matmul__(self, other: "Frame") -> "Frame":
        return Frame(self.x + self.R @ other.x, self.R @ other.R)

    @property
    def inverse(self) -> "Frame":
        """The reference frame relative to this frame."""
        return Frame(-self.R.T @ self.x, self.R.T)


def rpy_of(R: Array) -> Array:
    """Return roll, pitch and yaw, (3,) [rad], for R = R_z(yaw) R_y(pitch) R_x(roll).

    If the pitch is a right angle, yaw and roll rotate about the same axis; the roll is then zero.
    """
    cosine = float(np.hypot(R[0, 0], R[1, 0]))
    pitch = np.arctan2(-R[2, 0], cosine)
    if cosine < UPRIGHT:
        return np.array([0.0, pitch, np.arctan2(-R[0, 1], R[1, 1])])
    return np.array([np.arctan2(R[2, 1], R[2, 2]), pitch, np.arctan2(R[1, 0], R[0, 0])])
