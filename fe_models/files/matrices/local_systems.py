"""Dofs that another program writes in local axes of their nodes, turned to basic axes: K_basic = D K Dᵀ."""

from dataclasses import replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from fe_models.errors import MatrixError
from fe_models.files.matrices.foreign_matrices import ROLES, ForeignMatrices

__all__ = ["in_basic_axes"]

ORTHONORMAL = 1e-8  #: largest |Rᵀ R - 1| of axes as files with nine digits have them


def in_basic_axes(read: ForeignMatrices) -> ForeignMatrices:
    """Return the matrices and loads with all rows in basic axes, and no local systems left.

    u_basic = D u_local with D = blockdiag(R) on the three translations and the three rotations of a node, so that
    K_basic = D K Dᵀ and f_basic = D f.

    Raises
    ------
    MatrixError
        If axes are not orthonormal and right-handed, or a turned node lacks a component: what is held in oblique axes
        has no row of its own in basic ones.
    """
    if not read.systems:
        return read
    if read.dofs is None:
        raise MatrixError("local systems: the dofs of the rows are not known; give the list of dofs with the matrices")
    turned = {node: R for node, R in read.systems.items() if not np.array_equal(R, np.eye(3))}
    places: dict[tuple[int, int], int] = {
        (int(node), int(component)): row
        for row, (node, component) in enumerate(read.dofs)
        if int(node) in turned and component >= 0
    }
    rows: list[Any] = []
    columns: list[Any] = []
    values: list[Any] = []
    is_turned = np.zeros(len(read.dofs), dtype=bool)
    for node, R in turned.items():
        if np.abs(R.T @ R - np.eye(3)).max() > ORTHONORMAL or np.linalg.det(R) < 0:
            raise MatrixError(f"local system of node {node}: expected orthonormal right-handed axes, got {R.tolist()}")
        for first in (0, 3):
            at = [places[node, first + c] for c in range(3) if (node, first + c) in places]
            if not at:
                continue
            if len(at) < 3:
                raise MatrixError(
                    f"local system of node {node}: {3 - len(at)} of its components have no row, while others in "
                    "oblique axes have; give all rows of the node (without its supports)"
                )
            rows += np.repeat(at, 3).tolist()
            columns += at * 3
            values += R.ravel().tolist()
            is_turned[at] = True
    rest = np.flatnonzero(~is_turned)
    n = len(read.dofs)
    place = (np.concatenate([rest, rows]).astype(np.int64), np.concatenate([rest, columns]).astype(np.int64))
    D = sp.csc_array((np.concatenate([np.ones(len(rest)), values]), place), shape=(n, n))
    held = [int(read.dofs[row, 0]) for row in read.constrained if is_turned[row]]
    if held:
        raise MatrixError(
            f"local system of node {held[0]}: some of its rows are held in oblique axes ({len(held)} such rows), which "
            "basic axes cannot say; give the matrices without supports"
        )
    matrices = {role: D @ matrix @ D.T for role in ROLES if (matrix := getattr(read, role)) is not None}
    note = f"dofs of {len(turned)} nodes turned from local to basic axes"
    return replace(
        read,
        **matrices,
        loads={name: D @ load for name, load in read.loads.items()},
        systems={},
        notes=(*read.notes, note) if turned else read.notes,
    )
