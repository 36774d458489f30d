"""Axes of joints: a common direction of both markers, and its normals."""

from collections.abc import Mapping
from dataclasses import field
from typing import TYPE_CHECKING, Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError
from floatframe.model.checked_values import rotation_of, unit_vector
from floatframe.model.functions.time_functions import TimeFunction, constant
from floatframe.model.joints.joint import Joint
from floatframe.model.rotations import cross

__all__ = [
    "AxisJoint",
    "GivenMotions",
    "axis_in_b",
    "checked_axes",
    "checked_motions",
    "checked_rotation",
    "given_motions",
    "normals_of",
    "turning_frame",
]


def normals_of(axis: Array) -> tuple[Array, Array]:
    """Return two unit vectors normal to the axis, (3,) each, that form a right-handed frame with it."""
    helper = np.eye(3)[int(np.argmin(np.abs(axis)))]
    first = cross(axis, helper)
    first /= np.linalg.norm(first)
    return first, cross(axis, first)


def axis_in_b(axis: Array, axis_b: Array | None, A_a: Array, A_b: Array) -> Array:
    """Return the axis in axes of marker B, (3,): the given one, or the same direction in the assembled position."""
    return A_b.T @ A_a @ axis if axis_b is None else axis_b


def turning_frame(axis: Array, axis_b: Array, A_a: Array, A_b: Array) -> tuple[Array, Array, Array]:
    """Return x, z of A with x × z = axis, and y of B, which is parallel to z at angle zero (when assembled).

    If a given axis of B has another direction as assembled, y is the direction normal to it that is nearest to z.
    """
    x, z = normals_of(axis)
    y = A_b.T @ A_a @ z
    y = y - (y @ axis_b) * axis_b
    if np.linalg.norm(y) < 1e-3:
        y = normals_of(axis_b)[0]
    return x, z, y / np.linalg.norm(y)


def checked_axes(joint: Any) -> None:
    """Make `axis` and `axis_b` of a joint unit vectors; raise `ModelError` for a zero vector."""
    for name in ("axis", "axis_b"):
        if getattr(joint, name, None) is not None:  # not every joint has an axis on B
            object.__setattr__(joint, name, unit_vector(f"joint {joint.name!r}: {name}", getattr(joint, name)))


def checked_rotation(joint: Any) -> None:
    """Make `rotation` of a joint orthonormal to roundoff, if it is given; raise `ModelError` if it is no rotation."""
    if joint.rotation is not None:
        object.__setattr__(joint, "rotation", rotation_of(f"joint {joint.name!r}: rotation", joint.rotation))


class AxisJoint(Joint):
    """A joint about or along an axis, with motions."""

    def __post_init__(self) -> None:
        checked_axes(self)
        checked_motions(self)


if TYPE_CHECKING:

    class GivenMotions:
        """A field that takes functions of time or numbers by coordinate, and holds functions."""

        def __get__(self, joint: object, kind: object = None) -> Mapping[str, TimeFunction]: ...
        def __set__(self, joint: object, value: Mapping[str, TimeFunction | float]) -> None: ...

else:
    GivenMotions = Mapping[str, TimeFunction | float]


def given_motions() -> Any:
    """Return the field `motions` of a joint, of the type `GivenMotions`; by default there are none."""
    return field(default_factory=dict)


def checked_motions(joint: Any) -> None:
    """Convert `motions` of a joint to `TimeFunction`s by coordinate; raise `ModelError` for unknown coordinates."""
    where = f"joint {joint.name!r}: motions"
    if not isinstance(joint.motions, Mapping):
        raise ModelError(f"{where}: expected a dict from coordinates to functions of time, got {joint.motions!r}")
    motions = {}
    for name, motion in joint.motions.items():
        if name not in joint.coordinates:
            raise ModelError(f"{where}: no coordinate {name!r}; choices: {', '.join(joint.coordinates)}")
        motions[name] = constant(motion) if isinstance(motion, int | float) else motion
        if not isinstance(motions[name], TimeFunction):
            raise ModelError(
                f"{where}: {name}: expected a function of floatframe.functions or a number, got {motion!r}; a "
                "Python function can be sampled with floatframe.functions.sampled"
            )
        for order, what in enumerate(("value", "rate")):
            times, sizes = motions[name].jumps(order)
            if len(times):
                raise ModelError(
                    f"{where}: {name}: the {what} jumps by {sizes[0]:.6g} at t = {times[0]:.6g}, which no body can "
                    "follow; make its pieces continuous"
                )
    object.__setattr__(joint, "motions", motions)
