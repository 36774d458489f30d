"""A flexible body: a reduced body (modal file) with initial position and motion."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array, GivenArray, GivenArrayOrNone, given
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.mean_axes import MeanAxes, mean_axes
from floatframe.model.bodies.rigid_body import euler_parameters_from_user
from floatframe.model.checked_values import array_of_shape
from floatframe.model.rotations import rotation_matrix
from floatframe.model.shapes.shape import Geometry, Shape, shape_tuple

__all__ = ["FlexibleBody"]


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FlexibleBody:
    """An instance of a reduced body; several instances can share its data.

    Position and motion are those of the *mesh* axes. By default a body is therefore where its mesh was drawn, and the
    input does not depend on the frame in which the part was reduced (nodal or Tisserand).

    Parameters
    ----------
    name
        Name of the body, unique in the system; markers name the body by it.
    reduced
        The reduced body.
    position
        Initial position of the mesh origin, in ground axes, (3,) [m]; None: the joints place the body (below).
    orientation
        Euler parameters of the mesh axes, (4,).
    velocity
        Initial velocity of the body point at the mesh origin, in ground axes, (3,) [m/s].
    omega_B
        Angular velocity in mesh axes, (3,) [rad/s].
    q
        Initial modal coordinates, (n_q,); empty: undeformed.
    q_dot
        Initial rates of the modal coordinates, (n_q,); empty: zero.
    source
        Path of the modal file, stored in results and used for films.
    stiffening
        Whether to use the geometric stiffness, by which loads stiffen or soften the body (theory.md §7); "auto": if
        present.
    leave_out_missing
        Whether to neglect inertia terms that the reduced body lacks (`Moments.missing`); the motion is then exact to
        first order in speeds and deformation. False: a body without them is refused.
    shapes
        Shapes drawn in addition to its surface, in mesh axes or in axes of interfaces.

    Notes
    -----
    A body without a position moves from the ground origin to the nearest pose in which the points of its joints
    coincide. A body that has no orientation either takes the smallest rotation that satisfies the `axis_b` or
    `rotation` of a joint. Motions that the joints leave free do not change its pose. A joint with one marker is at this
    marker.

    Raises
    ------
    ModelError
        If a number is not finite or an array has a wrong shape.
    """

    name: str
    reduced: ReducedBody
    position: GivenArrayOrNone = given(None)
    orientation: GivenArray = given((1.0, 0.0, 0.0, 0.0))
    velocity: GivenArray = given(np.zeros(3))
    omega_B: GivenArray = given(np.zeros(3))  # noqa: N815
    q: GivenArray = given(np.zeros(0))
    q_dot: GivenArray = given(np.zeros(0))
    source: str = ""
    stiffening: bool | Literal["auto"] = "auto"
    leave_out_missing: bool = False
    shapes: Sequence[Shape | Geometry] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        where = f"flexible body {self.name!r}"
        if self.reduced.is_held:
            raise ModelError(
                f"{where}: the reduced body {self.reduced.name!r} is held to the ground, but a "
                "floating frame needs a free body; reduce it again without its supports, and hold it here by joints or "
                "bushings"
            )
        put = object.__setattr__
        for name in ("velocity", "omega_B"):
            put(self, name, array_of_shape(f"{where}: {name}", getattr(self, name), (3,)))
        if self.position is not None:
            put(self, "position", array_of_shape(f"{where}: position", self.position, (3,)))
        put(self, "orientation", euler_parameters_from_user(f"{where}: orientation", self.orientation))
        interfaces = [interface.name for interface in self.reduced.interfaces]
        put(self, "shapes", shape_tuple(where, self.shapes, interfaces))
        n = self.reduced.n_q
        for name in ("q", "q_dot"):
            value = getattr(self, name) if np.size(getattr(self, name)) else np.zeros(n)
            put(self, name, array_of_shape(f"{where}: {name}", value, (n,)))
        if not (isinstance(self.stiffening, bool) or self.stiffening == "auto"):
            raise ModelError(f"{where}: stiffening: expected true, false or 'auto', got {self.stiffening!r}")
        if self.stiffening is True and self.reduced.geometric is None:
            raise ModelError(
                f"{where}: stiffening is requested, but the reduced body {self.reduced.name!r} contains no geometric "
                "stiffness; reduce it again with geometric stiffness from a body with an element model, or omit "
                "stiffening"
            )
        missing = self.reduced.moments.missing
        if not isinstance(self.leave_out_missing, bool):
            raise ModelError(f"{where}: leave_out_missing: expected true or false, got {self.leave_out_missing!r}")
        if missing and self.reduced.n_q and not self.leave_out_missing:
            raise ModelError(
                f"{where}: a motion needs the inertia terms {', '.join(missing)}, which the reduced body "
                f"{self.reduced.name!r} does not contain, because the program that reduced it did not write them. "
                "Import it again with its full mass matrix, its nodal masses, or its mesh and density (cms import); or "
                f"give leave_out_missing = true: {self.reduced.moments.trust}"
            )
        if self.reduced.moments.m <= 0:
            raise ModelError(f"{where}: expected a mass above zero, got {self.reduced.moments.m:g}")

    @property
    def drawn_position(self) -> Array:
        """The given position (3,) [m]; for a body without one, the ground origin until its joints place it."""
        return np.zeros(3) if self.position is None else self.position

    @property
    def is_stiffened(self) -> bool:
        """Whether the geometric stiffness of the reduced body is used."""
        return self.stiffening is not False and self.reduced.geometric is not None

    @property
    def mean_axes(self) -> MeanAxes | None:
        """Mean axes in which the engine computes a stiffened body; None if it uses the frame of the file."""
        return mean_axes(self.reduced) if self.is_stiffened else None

    @property
    def moved(self) -> ReducedBody:
        """The reduced body in the frame in which the engine computes its motion."""
        axes = self.mean_axes
        return self.reduced if axes is None else axes.reduced

    @property
    def frame_orientation(self) -> Array:
        """R_GB of the body frame at the start, (3, 3)."""
        return rotation_matrix(self.orientation) @ self.reduced.frame.axes

    @property
    def frame_position(self) -> Array:
        """Position of the frame origin at the start, in ground axes, (3,) [m]."""
        return self.drawn_position + rotation_matrix(self.orientation) @ self.reduced.frame.origin

    @property
    def frame_velocity(self) -> Array:
        """Velocity of the frame origin at the start, in ground axes, (3,) [m/s]."""
        arm = np.cross(self.omega_B, self.reduced.frame.origin)
        return self.velocity + rotation_matrix(self.orientation) @ arm

    @property
    def frame_omega(self) -> Array:
        """Angular velocity at the start, in axes of the body frame, (3,) [rad/s]."""
        return self.reduced.frame.axes.T @ self.omega_B
