"""A flexible part that consists of several bodies of a system."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.bodies.rigid_body import euler_parameters_from_user
from floatframe.model.checked_values import array_of_shape
from floatframe.model.forces import Force
from floatframe.model.joints import Joint
from floatframe.model.system import Body

__all__ = ["FlexiblePart", "PartMaker", "placement"]


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FlexiblePart:
    """Bodies, joints and forces for a system, and markers at named points of the part.

    Parameters
    ----------
    name
        Name of the part; it begins the names of its bodies, joints and forces.
    bodies
        The bodies of the part.
    joints
        The joints of the part.
    forces
        The forces of the part.
    markers
        Markers by name, at which the part is joined to others.
    """

    name: str
    bodies: tuple[Body, ...]
    joints: tuple[Joint, ...]
    forces: tuple[Force, ...]
    markers: Mapping[str, Marker]

    def marker(self, place: str) -> Marker:
        """Return the marker at a named point; `ModelError` with the choices if there is none."""
        if place not in self.markers:
            raise ModelError(f"part {self.name!r}: no place {quoted(place)}{nearest(place, self.markers)}")
        return self.markers[place]


class PartMaker(Protocol):
    """A function that returns a part at a given position, such as `partial(finite_segments, line=line, n=10)`."""

    def __call__(self, name: str, *, position: Array, orientation: Array) -> FlexiblePart:
        """Return the part with its origin at a position, (3,), rotated by Euler parameters, (4,)."""


def placement(
    where: str, position: Array | None, orientation: Array | None, velocity: Array | None, omega_B: Array | None
) -> tuple[Array, Array, Array, Array]:
    """Return position, (3,), Euler parameters, (4,), velocity and angular velocity, (3,), of a part; None: at rest."""
    return (
        array_of_shape(f"{where}: position", np.zeros(3) if position is None else position, (3,)),
        euler_parameters_from_user(f"{where}: orientation", np.eye(4)[0] if orientation is None else orientation),
        array_of_shape(f"{where}: velocity", np.zeros(3) if velocity is None else velocity, (3,)),
        array_of_shape(f"{where}: omega_B", np.zeros(3) if omega_B is None else omega_B, (3,)),
    )
