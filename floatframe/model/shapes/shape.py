"""A geometry with its position and colour, for a body or the surroundings."""

import re
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, number
from floatframe.model.rotations import rotation_exp
from floatframe.model.shapes.piece import Piece, shifted

__all__ = ["Geometry", "Shape", "shape_tuple"]

COLOR = re.compile(r"#[0-9a-fA-F]{6}")
#: colours with a name
COLORS = {
    "steel": "#9aa7b3", "aluminium": "#c3cad0", "dark": "#3b4249", "black": "#24272b", "white": "#eef0f1",
    "red": "#c4473a", "orange": "#d98a3d", "yellow": "#d9b84a", "green": "#5f9a63",
    "blue": "#4a7fb5", "gold": "#c7a24a",
}  # fmt: skip


class Geometry(Protocol):
    """An object with a surface or lines in its own axes."""

    def pieces(self) -> tuple[Piece, ...]:
        """Return the pieces with which it is drawn."""


@dataclass(frozen=True, eq=False)
class Shape:
    """A geometry with position and colour.

    Raises
    ------
    ModelError
        If a number is not finite, or the colour is invalid.
    """

    geometry: Geometry
    #: position of its origin [m] in axes of the body (flexible: of its mesh), the interface, or the ground
    position: Array = field(default_factory=lambda: np.zeros(3))
    rotation_vector: Array = field(default_factory=lambda: np.zeros(3))  #: rotation relative to these axes, (3,) [rad]
    color: str | None = None  #: colour "#rrggbb" or a name in `COLORS`; None: the default for its kind or its body
    opacity: float = 1.0  #: opacity, above 0 and at most 1
    interface: str | None = None  #: interface of a flexible body that carries the shape; None: the body frame

    def __post_init__(self) -> None:
        put = object.__setattr__
        if not callable(getattr(self.geometry, "pieces", None)):
            raise ModelError(f"shape: expected a geometry such as Box or Wheel, got {self.geometry!r}")
        for name in ("position", "rotation_vector"):
            put(self, name, array_of_shape(f"shape: {name}", getattr(self, name), (3,)))
        put(self, "opacity", number("shape: opacity", self.opacity, above=0.0))
        if self.opacity > 1:
            raise ModelError(f"shape: opacity: expected a number up to 1, got {self.opacity:g}")
        if self.color is not None:
            put(self, "color", color_of(self.color))

    def pieces(self) -> tuple[Piece, ...]:
        """Return the pieces in axes of the carrier; those without colour or opacity get the shape's."""
        R = rotation_exp(self.rotation_vector)
        return tuple(
            replace(
                shifted(piece, self.position, R), color=self.color or piece.color, opacity=self.opacity * piece.opacity
            )
            for piece in self.geometry.pieces()
        )


def color_of(text: str) -> str:
    """Return "#rrggbb" for a colour; raise `ModelError` if it is invalid."""
    if isinstance(text, str) and text in COLORS:
        return COLORS[text]
    if not isinstance(text, str) or not COLOR.fullmatch(text):
        raise ModelError(f'shape: color: expected "#rrggbb" or a name, got {quoted(text)}{nearest(str(text), COLORS)}')
    return text.lower()


def shape_tuple(where: str, shapes: Any, interfaces: Sequence[str] = ()) -> tuple[Shape, ...]:
    """Return shapes as a tuple; a geometry among them becomes a shape at the origin.

    Parameters
    ----------
    interfaces
        Interfaces to which they may be fixed.

    Raises
    ------
    ModelError
        If an item is neither a shape nor a geometry, or is fixed to an unknown interface.
    """
    if not isinstance(shapes, Sequence):
        shapes = (shapes,)
    found = []
    for each in shapes:
        shape = each if isinstance(each, Shape) else Shape(each)
        if shape.interface is not None and shape.interface not in interfaces:
            hint = nearest(shape.interface, interfaces) if interfaces else "; it has none"
            raise ModelError(f"{where}: shapes: there is no interface {quoted(shape.interface)}{hint}")
        found.append(shape)
    return tuple(found)
