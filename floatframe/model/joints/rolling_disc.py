"""The rolling disc: a thin wheel on a plane, without slip.

Evaluated in `floatframe.engine.kernels.joints.rolling`.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array, GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import LENGTH, Quantity
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker, Place, body_name
from floatframe.model.checked_values import number
from floatframe.model.joints.axis_frame import checked_axes, normals_of
from floatframe.model.joints.joint import Joint
from floatframe.model.joints.rows import MOMENT_B, RIM, RIM_HEIGHT, ROLL, Row, arm_rows

__all__ = ["RollingDisc"]

METRE = Quantity(1.0, LENGTH)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class RollingDisc(Joint):
    """A thin disc about the point of marker B rolls without slip on a plane through the point of marker A.

    It has one position constraint, the contact, and two velocity constraints: the rim does not slide at the contact.
    The disc cannot lift off, so check the sign of the reaction. Constrained velocities do not drift, but the resulting
    path has the errors of the integrator.

    Parameters
    ----------
    name
        Name of the joint, unique in the system.
    marker_a
        Marker at a point of the plane.
    marker_b
        Marker at the centre of the disc.
    radius
        Radius of the disc [m].
    axis
        Normal of the plane, axes of marker A.
    axis_b
        Axis of the disc, in the axes of marker B.
    """

    name: str
    marker_a: Place
    marker_b: Place
    radius: float = METRE
    axis: GivenArray = given((0.0, 0.0, 1.0))
    axis_b: GivenArray = given((0.0, 1.0, 0.0))

    size = 9  #: components of the unknown wrench
    moment_b = MOMENT_B  #: index at which the moment on B starts in the wrench

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", number(f"joint {self.name!r}: radius", self.radius, above=0.0))
        for key, what in (("marker_a", "a point of the plane"), ("marker_b", "the centre of the disc")):
            given = getattr(self, key)
            # a body without marker is attached at the other marker, so that the centre of the disc would be on the
            # plane
            if not isinstance(given, Marker):
                raise ModelError(
                    f"joint {self.name!r}: {key}: expected a Marker, {what}, such as Marker({body_name(given)!r}, "
                    f"position=(0, 0, 0)), in a system file {key} = [0, 0, 0]; got the body {body_name(given)!r} alone"
                )
        checked_axes(self)

    def rows(self, A_a: Array, A_b: Array, d: Array) -> tuple[Row, ...]:
        """Return the rows for the assembled axes of the markers, (3, 3), and d = r_B - r_A, (3,), in ground axes."""
        if abs(float((A_a @ self.axis) @ (A_b @ self.axis_b))) > 1 - 1e-6:
            raise ModelError(
                f"joint {self.name!r}: the disc lies flat on the plane as placed, so that no point of its rim is the "
                "lowest; tilt it, or check axis and axis_b"
            )

        def row(kind: int, x: Array) -> Row:
            return Row(kind, x, self.axis_b, c=self.radius, z=self.axis)

        return (
            *arm_rows(),
            *(row(RIM, x) for x in np.eye(3)),
            row(RIM_HEIGHT, self.axis),
            *(row(ROLL, t) for t in normals_of(self.axis)),
        )
