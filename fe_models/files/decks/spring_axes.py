"""Axes of a spring or damper along the line of its nodes."""

import numpy as np

from fe_models.files.decks.deck import Vector
from fe_models.foundation.arrays import Array

__all__ = ["as_triad", "axes_along"]


def axes_along(x: Array) -> Array:
    """Return axes as rows, (3, 3), with the first along x; x must not be zero, the other two are arbitrary."""
    x = x / np.linalg.norm(x)
    y = np.cross(x, np.eye(3)[int(np.argmin(np.abs(x)))])
    y = y / np.linalg.norm(y)
    return np.stack([x, y, np.cross(x, y)])


def as_triad(rows: Array) -> tuple[Vector, Vector, Vector]:
    """Return axes, (3, 3) as rows, in the form of the triad of a `DeckSpring`."""
    triad = [(float(a[0]), float(a[1]), float(a[2])) for a in rows]
    return triad[0], triad[1], triad[2]
