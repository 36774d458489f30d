"""A slender body divided into parts: reduced bodies in a row, each with its own floating frame."""

from collections.abc import Sequence

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from floatframe.components.flexible_parts.flexible_part import FlexiblePart
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import euler_parameters_from_user
from floatframe.model.checked_values import array_of_shape
from floatframe.model.joints import FixedJoint, Joint
from floatframe.model.rotations import rotation_matrix

__all__ = ["floating_parts"]


def floating_parts(
    name: str,
    reduced: Sequence[ReducedBody],
    *,
    position: Array | None = None,
    orientation: Array | None = None,
    velocity: Array | None = None,
    omega_B: Array | None = None,
    ends: tuple[str, str] = ("start", "end"),
    stiffening: bool = True,
) -> FlexiblePart:
    """Return reduced bodies in a row, fixed to each other at their ends.

    The row may bend and rotate arbitrarily. Only the bending of each part in its own frame must stay small
    (docs/multibody.md, The range of a linear frame); it decreases with the square of the part's length.

    Parameters
    ----------
    name
        Name of the part; its bodies are "name 1", "name 2", ..., its joints "name joint 1", ....
    reduced
        Bodies in a row (repeated instances if they are equal); the first interface of each lies on the second interface
        of the previous one.
    position, orientation
        Position of the mesh axes of the first body in ground axes, (3,) [m], and their Euler parameters, (4,); all mesh
        axes are parallel.
    velocity, omega_B
        Velocity of this origin in ground axes, (3,) [m/s], and angular velocity in mesh axes, (3,) [rad/s]; initially
        the part moves as a rigid body.
    ends
        Interfaces of every body; they need rotations.
    stiffening
        Whether their geometric stiffness, which is then required, is used.

    Returns
    -------
    FlexiblePart
        Markers "start", "end" and "node 1", "node 2", ... on the interfaces.

    Raises
    ------
    ModelError
        If there is no body, or a body lacks the geometric stiffness that `stiffening` requires.
    """
    where = f"floating_parts {name!r}"
    if not reduced:
        raise ModelError(f"{where}: expected a reduced body or several, got none")
    r = array_of_shape(f"{where}: position", np.zeros(3) if position is None else position, (3,))
    p = euler_parameters_from_user(f"{where}: orientation", np.eye(4)[0] if orientation is None else orientation)
    v = array_of_shape(f"{where}: velocity", np.zeros(3) if velocity is None else velocity, (3,))
    omega = array_of_shape(f"{where}: omega_B", np.zeros(3) if omega_B is None else omega_B, (3,))
    R, origin, last = rotation_matrix(p), r, np.zeros(3)
    bodies: list[FlexibleBody] = []
    joints: list[Joint] = []
    markers: dict[str, Marker] = {}
    for number, body in enumerate(reduced, start=1):
        if stiffening and body.geometric is None:
            raise ModelError(
                f"{where}: body {body.name!r} has no geometric stiffness; reduce it with geometric=True, or ask for "
                "stiffening=False"
            )
        a, b = (body.frame.origin + body.frame.axes @ body.interface(end).position for end in ends)
        if number > 1:
            r = r + R @ (last - a)
        last = b
        called = f"{name} {number}"
        moving = v + R @ np.cross(omega, R.T @ (r - origin))
        bodies.append(
            FlexibleBody(called, body, position=r, orientation=p, velocity=moving, omega_B=omega, stiffening=stiffening)
        )
        markers[f"node {number}"] = Marker(called, ends[0])
        if number > 1:
            before = Marker(f"{name} {number - 1}", ends[1])
            joints.append(FixedJoint(f"{name} joint {number - 1}", before, Marker(called, ends[0])))
    markers |= {"start": markers["node 1"], "end": Marker(bodies[-1].name, ends[1])}
    markers[f"node {len(bodies) + 1}"] = markers["end"]
    return FlexiblePart(name, tuple(bodies), tuple(joints), (), markers)
