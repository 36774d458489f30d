"""Unique choice among equivalent bases: signs of modes, and directions within multiple frequencies."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.on_disk import in_memory

__all__ = ["orientation", "turn"]

SLICE = 8192  #: number of rows transformed at a time
MULTIPLE = 1e-10  #: relative gap of omega² below which modes count as one multiple mode


def orientation(Phi: Any, omega2: Array) -> Array:
    """Return the orthogonal matrix Z, (k, k), that transforms modes to their standard basis Phi @ Z.

    Within a group of modes with equal frequency, any rotation is equally valid, and rounding decides. The length of a
    row of the group does not depend on the rotation. Therefore (1) the longest row is rotated to (+, 0, 0, …), (2) the
    longest remaining row to (*, +, 0, …), and so on. In a group of one mode, the largest entry becomes positive. Rows
    within 1 % of the longest count as equally long; the first of them is used.

    Parameters
    ----------
    Phi
        Modes by ascending frequency, (n, k); distributed modes are collected one frequency at a time.
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
    # rows of the leading entries = L Qᵀ with lower triangular L, so Q transforms them to L; its diagonal is made
    # positive
    Q, R = np.linalg.qr(group[leading].T)
    return Q * np.where(np.diag(R) < 0, -1.0, 1.0)


def turn(Phi: Array, Z: Array) -> None:
    """Overwrite Phi, (n, k), with Phi Z; the Z of `orientation` is diagonal except for small blocks."""
    signs = np.diag(Z)
    groups = np.split(np.arange(len(Z)), np.flatnonzero(_new_block(Z)))
    for first in range(0, len(Phi), SLICE):
        part = Phi[first : first + SLICE]
        turned = [(group, part[:, group] @ Z[np.ix_(group, group)]) for group in groups if len(group) > 1]
        part *= signs
        for group, columns in turned:
            part[:, group] = columns


def _new_block(Z: Array) -> NDArray[np.bool_]:
    """Return whether a diagonal block begins at each column of a block-diagonal matrix, (k,); False for the first."""
    row, column = np.nonzero(Z)
    last = np.arange(len(Z))
    np.maximum.at(last, row, column)
    np.maximum.at(last, column, row)
    return np.arange(len(Z)) > np.concatenate([[len(Z)], np.maximum.accumulate(last)[:-1]])
