"""The constant-velocity joint (Rzeppa, tripod): two shafts at any angle that turn equally."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.bodies.markers import Place
from floatframe.errors import ModelError
from floatframe.joints.axis_frame import axis_in_b, checked_axes, normals_of
from floatframe.joints.rows import MOMENT, Row, point_rows
from floatframe.joints.rows.kinds import BISECTOR, EQUAL_TURN

__all__ = ["ConstantVelocityJoint"]


@dataclass(frozen=True, eq=False)
class ConstantVelocityJoint:
    """Holds two points together and lets the shafts through them turn equally, whatever their angle; four constraints.

    B turns against A about axes normal to the bisector of both shafts only, so that the angular velocities of the
    shafts about their own axes agree at every instant. Free: the two deflections of the shafts. The shafts are to be
    placed at less than 135 degrees from one line.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: shaft of A, in the axes of marker A, (3,)
    axis_b: Array | None = None  #: shaft of B, away from A, in the axes of marker B, (3,); None: in line as placed

    size = 6  #: components of the unknown wrench: force and moment
    moment_b = MOMENT  #: where the moment on B begins in it
    coordinates = ()

    def __post_init__(self) -> None:
        checked_axes(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), in ground axes, as placed."""
        axis_b = axis_in_b(self.axis, self.axis_b, A_a, A_b)
        along, across = A_a @ self.axis, A_b @ axis_b
        cosine = float(along @ across)
        if cosine < -np.sqrt(0.5):
            raise ModelError(
                f"joint {self.name!r}: expected shafts less than 135 degrees from one line as placed, got "
                f"{np.degrees(np.arccos(max(cosine, -1.0))):.6g}; axis_b leads away from A"
            )
        x, z = normals_of(self.axis)  # x × z along the axis of A
        turn = np.cross(along, across)  # as placed B is A turned about this axis, straight from shaft to shaft
        in_b = [A_b.T @ (v * cosine + np.cross(turn, v) + turn * (turn @ v) / (1 + cosine)) for v in (A_a @ x, A_a @ z)]
        held = Row(EQUAL_TURN, x, in_b[0], z=z, u=in_b[1])
        return (*point_rows(), held, *(Row(BISECTOR, e, axis_b, z=self.axis, part=MOMENT) for e in (x, z)))
