"""Slender rods as parts of mechanisms: rigid bodies, or instances of a reduced body."""

from dataclasses import replace

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from floatframe.components.flexible_parts.flexible_part import PartMaker
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import RigidBody
from floatframe.model.forces import Force
from floatframe.model.joints import Joint
from floatframe.model.rotations import euler_parameters, rotation_matrix, tilde
from floatframe.model.system import Body

__all__ = ["Rod", "between", "slender_inertia", "turning"]

THICKNESS = 0.02  #: diameter of a rigid rod divided by its length, which gives it an inertia about its axis


def slender_inertia(mass: float, length: float) -> Array:
    """Return the inertia of a round rod along x about its centre, (3, 3) [kg m²]."""
    radius = THICKNESS * length / 2
    across = mass * (length**2 / 12 + radius**2 / 4)
    return np.diag([mass * radius**2 / 2, across, across])


class Rod:
    """A rod between two points in the xy plane, with markers at its ends; its x axis points from start to end."""

    def __init__(
        self,
        name: str,
        start: Array,
        end: Array,
        mass: float,
        reduced: ReducedBody | PartMaker | None = None,
        ends: tuple[str, str] = ("start", "end"),
    ) -> None:
        """Place the rod between two points: a reduced body by its interfaces `ends`, any other rod by its x axis."""
        start, end = np.asarray(start, dtype=float), np.asarray(end, dtype=float)
        self.length = float(np.linalg.norm(end - start))
        self.joints: tuple[Joint, ...] = ()
        self.forces: tuple[Force, ...] = ()
        self.bodies: tuple[Body, ...]
        if reduced is None:
            orientation = rotation_onto(end - start, np.array([1.0, 0.0, 0.0]))
            self.bodies = (
                RigidBody(
                    name,
                    mass,
                    slender_inertia(mass, self.length),
                    center_of_mass=np.array([self.length / 2, 0, 0]),
                    position=start,
                    orientation=orientation,
                ),
            )
            self.start, self.end = Marker(name), Marker(name, position=np.array([self.length, 0, 0]))
            return
        if not isinstance(reduced, ReducedBody):
            part = reduced(name, position=start, orientation=rotation_onto(end - start, np.array([1.0, 0.0, 0.0])))
            self.bodies, self.joints, self.forces = part.bodies, part.joints, part.forces
            self.start, self.end = (part.marker(place) for place in ends)
            return
        a, b = (between(reduced, interface) for interface in ends)
        size = float(np.linalg.norm(b - a))
        if abs(size - self.length) > 1e-3 * self.length:
            raise ModelError(
                f"rod {name!r}: its interfaces {ends[0]} and {ends[1]} are {size:.6g} apart, expected {self.length:.6g}"
            )
        orientation = rotation_onto(end - start, b - a)
        position = start - rotation_matrix(orientation) @ a
        self.bodies = (FlexibleBody(name, reduced, position=position, orientation=orientation),)
        self.start, self.end = Marker(name, ends[0]), Marker(name, ends[1])

    def across(self, direction: Array) -> Array:
        """Return a direction given in ground axes in the axes of the start marker, (3,)."""
        body = self.body
        if isinstance(body, FlexibleBody):
            assert self.start.interface is not None
            axes = body.frame_orientation @ body.reduced.interface(self.start.interface).triad
        else:
            axes = rotation_matrix(body.orientation)
        return np.asarray(axes.T @ direction)

    @property
    def body(self) -> Body:
        """The single body of a rigid or reduced rod."""
        return self.bodies[0]


def between(reduced: ReducedBody, interface: str) -> Array:
    """Return the position of an interface in mesh axes, (3,)."""
    return np.asarray(reduced.frame.origin + reduced.frame.axes @ reduced.interface(interface).position)


def rotation_onto(to: Array, direction: Array) -> Array:
    """Return Euler parameters, (4,), of the smallest rotation that takes one direction to another."""
    a, b = direction / np.linalg.norm(direction), to / np.linalg.norm(to)
    axis, cosine = np.cross(a, b), float(a @ b)
    if cosine < -1 + 1e-12:  # half a turn, about z if possible
        axis = np.array([0.0, 0.0, 1.0]) if abs(a[2]) < 0.9 else np.array([1.0, 0.0, 0.0])
        axis = axis - (axis @ a) * a
        return np.concatenate([[0.0], axis / np.linalg.norm(axis)])
    turn = tilde(axis)
    return euler_parameters(np.eye(3) + turn + turn @ turn / (1 + cosine))


def turning(body: Body, omega: Array, *, point: Array | None = None, velocity: Array | None = None) -> Body:
    """Return the body with the velocities of a rigid rotation omega, (3,), ground axes.

    The rotation is about the ground origin, or about a point, (3,), that moves with a velocity, (3,).
    """
    omega = np.asarray(omega, dtype=float)
    arm = body.drawn_position if point is None else body.drawn_position - point
    base = np.zeros(3) if velocity is None else velocity
    return replace(body, velocity=base + np.cross(omega, arm), omega_B=rotation_matrix(body.orientation).T @ omega)
