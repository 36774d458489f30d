"""The constant-velocity joint (Rzeppa, tripod): two shafts at any angle that rotate at equal speed."""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Place
from floatframe.model.joints.axis_frame import axis_in_b, checked_axes, normals_of
from floatframe.model.joints.rows import MOMENT, Row, point_rows
from floatframe.model.joints.rows.kinds import BISECTOR, EQUAL_TURN

__all__ = ["ConstantVelocityJoint"]


@dataclass(frozen=True, eq=False)
class ConstantVelocityJoint:
    """Joins two points, and makes the shafts through them rotate equally at any angle between them; four constraints.

    B only rotates relative to A about axes normal to the bisector of both shafts. The angular velocities of the shafts
    about their own axes are therefore equal at every instant. The two deflections of the shafts are free. In the
    assembled position the shafts must be at less than 135 degrees from a straight line.
    """

    name: str
    marker_a: Place
    marker_b: Place
    axis: Array = field(default_factory=lambda: np.array([0.0, 0.0, 1.0]))  #: shaft of A, in the axes of marker A, (3,)
    #: shaft of B, pointing away from A, in the axes of marker B, (3,); None: collinear as assembled
    axis_b: Array | None = None

    size = 6  #: components of the unknown wrench: force and moment
    moment_b = MOMENT  #: index at which the moment on B starts in the wrench
    coordinates = ()

    def __post_init__(self) -> None:
        checked_axes(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for marker axes A_a, A_b, (3, 3), and r_B - r_A = d, (3,), ground axes, as assembled."""
        axis_b = axis_in_b(self.axis, self.axis_b, A_a, A_b)
        along, across = A_a @ self.axis, A_b @ axis_b
        cosine = float(along @ across)
        if cosine < -np.sqrt(0.5):
            raise ModelError(
                f"joint {self.name!r}: expected shafts less than 135 degrees from one line as placed, got "
                f"{np.degrees(np.arccos(max(cosine, -1.0))):.6g}; axis_b leads away from A"
            )
        x, z = normals_of(self.axis)  # x × z is along the axis of A
        turn = np.cross(along, across)  # as assembled, B is A rotated about this axis from shaft to shaft
        in_b = [A_b.T @ (v * cosine + np.cross(turn, v) + turn * (turn @ v) / (1 + cosine)) for v in (A_a @ x, A_a @ z)]
        held = Row(EQUAL_TURN, x, in_b[0], z=z, u=in_b[1])
        return (*point_rows(), held, *(Row(BISECTOR, e, axis_b, z=self.axis, part=MOMENT) for e in (x, z)))
