"""Markers: named places on bodies where joints and forces act."""

from dataclasses import dataclass
from typing import Protocol

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.checked_values import array_of_shape, rotation_of

__all__ = ["Marker", "Named", "Place", "body_name"]


class Named(Protocol):
    """Anything with a name: a body, or the ground."""

    @property
    def name(self) -> str:
        """Its name."""


@frozen_copies
@dataclass(frozen=True, eq=False)
class Marker:
    """A place with axes on a body.

    On a flexible body: an interface by name, with its own triad. On a rigid body or the ground: a position and a
    triad in the body frame, the frame itself by default.
    """

    body: str | Named  #: the body or its name
    interface: str | None = None  #: interface of a flexible body
    position: Array | None = None  #: in the body frame of a rigid body or the ground, (3,) [m]; None: the origin
    triad: Array | None = None  #: columns: axes of the marker in those of the body or interface, (3, 3); None: the same

    def __post_init__(self) -> None:
        where = f"marker on {body_name(self.body)!r}"
        if self.position is not None:
            object.__setattr__(self, "position", array_of_shape(f"{where}: position", self.position, (3,)))
        if self.triad is not None:
            object.__setattr__(self, "triad", rotation_of(f"{where}: triad", self.triad))


Place = Marker | Named | str  #: a marker, or a body (or its name): then where the other marker of the joint is placed


def body_name(body: str | Named) -> str:
    """Return the name of a body given by itself or by its name."""
    return body if isinstance(body, str) else body.name
