"""Equations between components of nodes in basic axes. Equations of a node with its own axes are solved together."""

from collections.abc import Iterable

import numpy as np
from scipy.linalg import qr

__all__ = ["Row", "solved_equations"]

NEGLIGIBLE = 1e-14  #: coefficient divided by the largest one, below which it counts as zero
Row = dict[tuple[int, int], float]  #: coefficient of each (node, component in basic axes); the sum of all terms is zero


def solved_equations(rows: Iterable[tuple[tuple[int, int], Row]]) -> tuple[list[Row], list[tuple[int, int]]]:
    """Return equations whose first component can be eliminated, and (node, count) of equations without any.

    If the first terms of n equations are components of one node along its own axes, these equations are solved together
    for n components of the node in basic axes. Pivoting selects the components that are determined best.

    Parameters
    ----------
    rows
        Node of the component to be eliminated with 0 for its translations or 3 for its rotations, and the equation.
    """
    together: dict[tuple[int, int], list[Row]] = {}
    for lead, row in rows:
        together.setdefault(lead, []).append(row)
    made: list[Row] = []
    refused = []
    for (node, first), mine in together.items():
        own = [(node, first + j) for j in range(3)]
        names = own + [name for name in dict.fromkeys(name for row in mine for name in row) if name not in own]
        A = np.array([[row.get(name, 0.0) for name in names] for row in mine])
        if len(mine) > 3 or np.linalg.matrix_rank(A[:, :3]) < len(mine):
            refused.append((node, len(mine)))
            continue
        order = qr(A[:, :3], pivoting=True, mode="r")[1][: len(mine)]
        A = np.linalg.solve(A[:, order], A)
        A[np.abs(A) < NEGLIGIBLE * np.abs(A).max()] = 0.0
        rest = [k for k in range(len(names)) if k not in order]
        made += [
            {names[j]: float(A[k, j]) for j in (slave, *rest) if A[k, j] or j == slave} for k, slave in enumerate(order)
        ]
    return made, refused
