"""Stress at named points of a reduced body, and its von Mises stress."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Annotated

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies

__all__ = ["PointStress", "stress_of", "von_mises", "von_mises_of"]

CHUNK_SIZE = 2_000_000  #: number of stress values in memory at a time


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class PointStress:
    """Stress modes at named points that are not nodes, such as the extreme fibres of beam sections."""

    names: Annotated[tuple[str, ...], ArrayShape(("n_points",))]  #: name of each point
    positions: Annotated[Array, ArrayShape(("n_points", 3))]  #: undeformed, in B [m]
    #: stress xx yy zz yz xz xy for each mode, in axes of B [Pa per unit of q]
    modes: Annotated[Array, ArrayShape(("n_points", 6, "n_q"))]


def von_mises(stress: Array) -> Array:
    """Return the von Mises stress sqrt(3/2 s:s) [Pa]; s is the deviator, components xx yy zz yz xz xy are on axis 1.

    Parameters
    ----------
    stress
        Stress components, (n, 6) or (n, 6, k).
    """
    xx, yy, zz, yz, xz, xy = np.moveaxis(np.asarray(stress), 1, 0)
    normal = (xx - yy) ** 2 + (yy - zz) ** 2 + (zz - xx) ** 2
    return np.asarray(np.sqrt(normal / 2 + 3 * (yz**2 + xz**2 + xy**2)))


def stress_of(modes: Array, q: Array) -> Array:
    """Return stress [Pa]: (n, 6) if q has shape (n_q,), or (n, 6, k) if q has shape (k, n_q).

    Parameters
    ----------
    modes
        Stress xx yy zz yz xz xy for each mode, (n, 6, n_q) [Pa per unit of q].
    q
        All modal coordinates, including static ones.
    """
    return np.asarray(modes @ np.asarray(q).T)


def von_mises_of(modes: Array, q: Array) -> Iterator[Array]:
    """Yield the von Mises stress in blocks of rows, (rows, n) [Pa], for many modal coordinates q (k, n_q)."""
    rows = max(1, CHUNK_SIZE // max(1, modes[..., 0].size))
    for first in range(0, len(q), rows):
        yield von_mises(stress_of(modes, q[first : first + rows])).T
