"""A rigid body, defined by its mass properties."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from numbers import Real

import numpy as np

from fe_models.foundation.arrays import Array, GivenArray, GivenArrayOrNone, given
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, number
from floatframe.model.shapes.shape import Geometry, Shape, shape_tuple

__all__ = ["RigidBody"]

#: relative excess of a principal moment over the sum of the other two that is accepted as rounding
TRIANGLE_DEFECT = 1e-6


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class RigidBody:
    """A rigid body with its initial position and motion.

    Parameters
    ----------
    name
        Name of the body, unique in the system; markers name the body by it.
    mass
        Mass [kg].
    inertia
        Inertia tensor about the centre of mass, not about the frame origin, in body axes, (3, 3) [kg m²].
    center_of_mass
        Centre of mass relative to the frame origin, in body axes, (3,) [m]; default: the origin.
    position
        Initial position of the frame origin, in ground axes, (3,) [m]; None: the joints place the body (below).
    orientation
        Initial unit Euler parameters p = (w, x, y, z) of R_GB, which maps components in body axes to ground axes, (4,).
    velocity
        Initial velocity of the frame origin, in ground axes, (3,) [m/s].
    omega_B
        Initial angular velocity, in body axes, (3,) [rad/s].
    shapes
        Drawn shapes, in the body frame.

    Notes
    -----
    A body without a position moves from the ground origin to the nearest pose in which the points of its joints
    coincide. A body that has no orientation either takes the smallest rotation that satisfies the `axis_b` or
    `rotation` of a joint. Motions that the joints leave free do not change its pose. A joint with one marker is at this
    marker.

    Raises
    ------
    ModelError
        If mass or inertia is impossible, or a number is not finite.
    """

    name: str
    mass: float
    inertia: GivenArray = given()
    center_of_mass: GivenArray = given(np.zeros(3))
    position: GivenArrayOrNone = given(None)
    orientation: GivenArray = given((1.0, 0.0, 0.0, 0.0))
    velocity: GivenArray = given(np.zeros(3))
    omega_B: GivenArray = given(np.zeros(3))  # noqa: N815
    shapes: Sequence[Shape | Geometry] = field(default=(), kw_only=True)

    def __post_init__(self) -> None:
        where = f"rigid body {self.name!r}"
        put = object.__setattr__
        put(self, "mass", number(f"{where}: mass", self.mass, above=0.0))
        moments = self.inertia.tolist() if isinstance(self.inertia, np.ndarray) else self.inertia
        if isinstance(moments, list | tuple) and len(moments) == 3 and all(isinstance(x, Real) for x in moments):
            raise ModelError(
                f"{where}: inertia: expected a tensor of shape (3, 3), got three numbers; "
                f"principal moments about the body axes are numpy.diag({list(moments)})"
            )
        put(self, "inertia", array_of_shape(f"{where}: inertia", self.inertia, (3, 3)))
        for name in ("center_of_mass", "velocity", "omega_B"):
            put(self, name, array_of_shape(f"{where}: {name}", getattr(self, name), (3,)))
        if self.position is not None:
            put(self, "position", array_of_shape(f"{where}: position", self.position, (3,)))
        put(self, "orientation", euler_parameters_from_user(f"{where}: orientation", self.orientation))
        put(self, "shapes", shape_tuple(where, self.shapes))
        scale = np.abs(self.inertia).max()
        if np.abs(self.inertia - self.inertia.T).max() > 1e-9 * scale:
            raise ModelError(f"{where}: inertia: expected a symmetric tensor, got {self.inertia.tolist()}")
        low, middle, high = np.linalg.eigvalsh(self.inertia)
        if low < 0 or high > (low + middle) * (1 + TRIANGLE_DEFECT):
            raise ModelError(
                f"{where}: inertia: no mass distribution has the principal moments {low:.6g}, "
                f"{middle:.6g}, {high:.6g}: none may be negative or exceed the sum of the other two; "
                "give the tensor about the centre of mass, products of inertia with their sign"
            )
        if high == 0:
            raise ModelError(
                f"{where}: inertia: expected moments above zero, got none; give a point mass a small extent"
            )

    @property
    def drawn_position(self) -> Array:
        """The given position (3,) [m]; for a body without one, the ground origin until its joints place it."""
        return np.zeros(3) if self.position is None else self.position

    @property
    def inertia_about_origin(self) -> Array:
        """Inertia tensor about the frame origin, body axes, (3, 3) [kg m²] (Huygens-Steiner)."""
        c = self.center_of_mass
        return self.inertia + self.mass * (c @ c * np.eye(3) - np.outer(c, c))


def euler_parameters_from_user(where: str, values: Array) -> Array:
    """Return unit Euler parameters, (4,); `ModelError` if their length differs from one by more than 1e-6."""
    p = array_of_shape(where, values, (4,))
    length = float(np.linalg.norm(p))
    if abs(length - 1) > 1e-6:
        raise ModelError(
            f"{where}: expected Euler parameters (w, x, y, z) of length 1, got {p.tolist()} of length "
            f"{length:.6g}; make them with floatframe.model.rotations.euler_parameters_of_rotation_vector"
        )
    return array_of_shape(where, p / length, (4,))
