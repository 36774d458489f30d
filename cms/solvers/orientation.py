"""One fixed basis among many equal ones: signs of modes, and directions within multiple frequencies."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.on_disk import in_memory

__all__ = ["orientation", "turn"]

SLICE = 8192  #: rows that are turned at a time
MULTIPLE = 1e-10  #: relative gap of omega² below which modes count as one multiple mode


def orientation(Phi: Any, omega2: Array) -> Array:
    """Orthogonal matrix Z, (k, k), that turns modes into their standard basis Phi @ Z.

    Within a group of modes of one frequency any rotation is as good as another, and rounding chooses. The length of a
    row of the group is blind to rotations, so (1) the row of greatest length is turned into (+, 0, 0, …), (2) the
    greatest remaining row into (*, +, 0, …), and so on. A group of one: its greatest entry becomes positive.
    Rows within 1 % of the greatest are equal for this purpose; the first of them is taken.

    Parameters
    ----------
    Phi
        Modes by ascending frequency, (n, k); of those on all ranks one frequency at a time is collected.
    omega2
        Their squared frequencies, (k,) [1/s²].
    """
    k = Phi.shape[1]
    Z = np.zeros((k, k))
    gaps = np.abs(np.diff(omega2, prepend=-np.inf))
    starts = np.flatnonzero(gaps > MULTIPLE * np.abs(omega2))
    for first, last in zip(starts, [*starts[1:], k], strict=True):
        if last == first + 1:
            mode = in_memory(Phi[:, first:last])[:, 0]
            size = np.abs(mode)
            Z[first, first] = -1.0 if mode[np.argmax(size > 0.99 * size.max())] < 0 else 1.0
        else:
            Z[first:last, first:last] = _standard_rotation(in_memory(Phi[:, first:last]))
    return Z


def _standard_rotation(group: Array) -> Array:
    p = group.shape[1]
    leading = []
    rest = group
    for _ in range(p):
        length = np.linalg.norm(rest, axis=1)
        row = int(np.argmax(length > 0.99 * length.max()))
        leading.append(row)
        if length[row] > 0:
            direction = rest[row] / length[row]
            rest = rest - np.outer(rest @ direction, direction)
    # rows of the leading entries = L Qᵀ with L lower triangular, so Q turns them into L; its diagonal made positive
    Q, R = np.linalg.qr(group[leading].T)
    return Q * np.where(np.diag(R) < 0, -1.0, 1.0)


def turn(Phi: Array, Z: Array) -> None:
    """Put Phi Z into Phi, (n, k); the Z of `orientation` is a diagonal but for small blocks."""
    signs = np.diag(Z)
    groups = np.split(np.arange(len(Z)), np.flatnonzero(_new_block(Z)))
    for first in range(0, len(Phi), SLICE):
        part = Phi[first : first + SLICE]
        turned = [(group, part[:, group] @ Z[np.ix_(group, group)]) for group in groups if len(group) > 1]
        part *= signs
        for group, columns in turned:
            part[:, group] = columns


def _new_block(Z: Array) -> NDArray[np.bool_]:
    """Return whether a block begins at each column of a matrix of blocks along the diagonal, (k,); not at the first."""
    row, column = np.nonzero(Z)
    last = np.arange(len(Z))
    np.maximum.at(last, row, column)
    np.maximum.at(last, column, row)
    return np.arange(len(Z)) > np.concatenate([[len(Z)], np.maximum.accumulate(last)[:-1]])
