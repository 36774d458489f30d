"""Independent coordinates of closed loops: partitioning by pivoted LU, exact solution of the constraints.

With C the derivative of what is held by the coordinates, scaled by their sizes, LU with pivoting over the columns of C
finds the coordinates that are solved for (the dependent ones, as many as there are constraints); the others are free.
The partition serves as long as the solution is well conditioned, and is made anew where it is not, see
docs/relative.md §7.
"""

from dataclasses import dataclass

import numpy as np
from scipy.linalg import lu_factor, lu_solve

from fe_models.foundation.arrays import Array, IntArray
from floatframe.errors import ModelError

__all__ = ["Partition", "partition_of"]

RANK = 1e-9  #: of the largest pivot: what is none
WORSE = 1e3  #: growth of the solution by which a partition is made anew


@dataclass(frozen=True, eq=False)
class Partition:
    """Which coordinates follow from the others."""

    dependent: IntArray  #: (n_c,)
    independent: IntArray  #: (n - n_c,)
    growth: float  #: largest change of a dependent coordinate by an independent one when it was made, at least 1

    def solved(self, C: Array, right: Array) -> Array:
        """Return the dependent coordinates y of C_d y = right."""
        return np.asarray(lu_solve(lu_factor(C[:, self.dependent]), right)) if len(self.dependent) else np.zeros(0)

    def is_worn(self, C: Array) -> bool:
        """Whether dependent coordinates now change much more with the others than when it was made."""
        return bool(len(self.dependent)) and growth(C, self.dependent, self.independent) > WORSE * self.growth


def growth(C: Array, dependent: IntArray, independent: IntArray) -> float:
    """Return the largest number of C_d⁻¹ C_i, at least 1; infinite where C_d is singular."""
    if not len(dependent) or not len(independent):
        return 1.0
    try:
        return max(1.0, float(np.abs(np.linalg.solve(C[:, dependent], C[:, independent])).max()))
    except np.linalg.LinAlgError:
        return np.inf


def partition_of(C: Array, names: tuple[str, ...], sizes: Array) -> Partition:
    """Return the partition of coordinates for the constraints C, (n_c, n).

    Parameters
    ----------
    C
        Derivative of what is held by the coordinates.
    names
        Of the constraints, for messages.
    sizes
        Of the coordinates, by which their columns are compared, (n,).

    Raises
    ------
    ModelError
        If constraints depend on each other: in a singular position, or always.
    """
    n_c, n = C.shape
    if n_c > n:
        raise ModelError(f"{n_c} constraints of {n} coordinates: {', '.join(dict.fromkeys(names))} hold too much")
    left = (C * sizes).copy()
    size = np.abs(left).max(axis=1, initial=0.0, keepdims=True)
    if n_c and not size.all():
        raise ModelError(f"joint {names[int(np.argmin(size))]!r} holds what cannot move")
    left = left / size if n_c else left
    dependent: list[int] = []
    for k in range(n_c):  # rows in turn, the largest of all numbers that are left as pivot
        rest = np.abs(left[k:])
        row, column = divmod(int(np.argmax(rest)), n)
        if rest[row, column] <= RANK:
            named = ", ".join(repr(name) for name in dict.fromkeys(names))
            raise ModelError(
                f"{n_c - k} of {n_c} constraints of {named} repeat others here: a singular position, or constraints "
                "that are redundant; begin in another position, or replace a joint by one that holds less"
            )
        left[[k, k + row]] = left[[k + row, k]]
        dependent.append(column)
        factors = left[k + 1 :, column] / left[k, column]
        left[k + 1 :] -= np.outer(factors, left[k])
    free = np.setdiff1d(np.arange(n), dependent)
    chosen = np.array(sorted(dependent), dtype=np.int64)
    return Partition(chosen, free, growth(C, chosen, free))
