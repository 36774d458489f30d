"""Markers: points with axes on bodies, where joints and forces act."""

from dataclasses import dataclass
from typing import Protocol

from cms.body.address import Address
from cms.errors import BodyError
from fe_models.body.kept_nodes import TOLERANCE
from fe_models.foundation.arrays import GivenArrayOrNone, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, number, rotation_of

__all__ = ["Marker", "Named", "Place", "body_name"]


class Named(Protocol):
    """An object with a name: a body, or the ground."""

    @property
    def name(self) -> str:
        """Name of the object."""


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Marker:
    """A point with axes on a body.

    On a flexible body, a marker is at an interface, with its own triad. On a rigid body or the ground, it has a
    position and a triad in the body frame (default: the body frame itself). Sensors and channels also accept a point on
    a flexible body that is not an interface: a kept node, given by its number in the user's mesh or its position there,
    or the mean motion of the nodes of an element or a set.

    Parameters
    ----------
    body
        The body or its name.
    interface
        Interface of a flexible body.
    position
        Position in the body frame of a rigid body or the ground, (3,) [m]; None: the origin.
    triad
        Axes of the marker as columns, in those of the body or interface, (3, 3); None: the same axes.
    node
        Number of a kept node; "INSTANCE.number" if instances have the same numbers.
    element
        Number of an element on the surface.
    set
        Name of a set of nodes or elements.
    tolerance
        Largest distance of a node from a position, relative to the size of the body.
    """

    body: str | Named
    interface: str | None = None
    position: GivenArrayOrNone = given(None)
    triad: GivenArrayOrNone = given(None)
    node: int | str | None = None
    element: int | str | None = None
    set: str | None = None
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        where = f"marker on {body_name(self.body)!r}"
        given = [k for k in ("interface", "position", "node", "element", "set") if getattr(self, k) is not None]
        if len(given) > 1:
            raise ModelError(f"{where}: expected one place, got {' and '.join(given)}")
        if self.position is not None:
            object.__setattr__(self, "position", array_of_shape(f"{where}: position", self.position, (3,)))
        if self.triad is not None:
            object.__setattr__(self, "triad", rotation_of(f"{where}: triad", self.triad))
        number(f"{where}: tolerance", self.tolerance, at_least=0.0)

    @staticmethod
    def of_name(name: str) -> "Marker":
        """Return the marker for a text "body" or "body.interface"."""
        body, _, interface = name.partition(".")
        return Marker(body, interface or None)

    @property
    def address(self) -> Address | None:
        """The address of the marker on a flexible body; None if the marker is an interface or the body itself."""
        if self.position is None and self.node is None and self.element is None and self.set is None:
            return None
        try:
            return Address(self.node, self.element, self.set, self.position, self.tolerance)
        except BodyError as error:
            raise ModelError(f"marker on {body_name(self.body)!r}: {error}") from error


#: a marker, also by name ("body.interface"), or a body (or its name), whose marker is at the joint's other marker
Place = Marker | Named | str


def body_name(body: str | Named) -> str:
    """Return the name of a body, given as the body or its name."""
    return body if isinstance(body, str) else body.name
