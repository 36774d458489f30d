"""Where an iteration on tall columns, (n, k) with n much larger than k, keeps them and multiplies them.

`ArraySpace` uses arrays of this process; `cms.linear_algebra.solvers.slepc_modes` distributes the rows over ranks.
The operations on the columns themselves are those of `fe_models.foundation.tall.columns`.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from cms.linear_algebra.solvers.inverse import Inverse
from cms.linear_algebra.solvers.sparse_product import SymmetricProduct
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.columns import put

__all__ = ["ArraySpace", "TallBasis", "TallProduct", "TallSpace"]

RESTART_ROWS = 65536  #: number of rows transformed at a time, which avoids a second basis in memory


class TallProduct(Protocol):
    """The map x -> A x of a symmetric matrix A, for columns of one space."""

    def __matmul__(self, x: Any) -> Any:
        """Return A x, (n, k)."""


class TallBasis(Protocol):
    """A growing number of columns in their own memory."""

    capacity: int  #: number of columns for which memory is allocated

    def columns(self, first: int, last: int) -> Any:
        """Return some columns, (n, last - first); they change together with the basis."""

    def put(self, first: int, X: Any) -> None:
        """Write columns, starting at index `first`."""

    def turn(self, m: int, C: Array) -> None:
        """Replace the first k columns by V C, where V are the first m columns and C is (m, k)."""

    def grow(self, capacity: int, m: int) -> None:
        """Allocate memory for more columns; the first m columns stay."""


class TallSpace(Protocol):
    """The columns of an iteration: their start, their storage, and the maps between them."""

    n: int

    def random(self, generator: np.random.Generator, k: int) -> Any:
        """Return columns of normally distributed numbers, (n, k)."""

    def basis(self, capacity: int) -> TallBasis:
        """Allocate memory for `capacity` columns."""

    def product(self, A: Any) -> TallProduct:
        """Return the product with a symmetric matrix, (n, n)."""

    def solver(self, factorization: Inverse) -> Callable[[Any], Any]:
        """Return the function that solves for columns with a factorisation."""


class ArrayBasis:
    """The basis, stored column by column."""

    def __init__(self, n: int, capacity: int) -> None:
        self.rows, self.capacity = np.empty((capacity, n)), capacity

    def columns(self, first: int, last: int) -> Array:
        """Return a view."""
        return self.rows[first:last].T

    def put(self, first: int, X: Array) -> None:
        """Write columns, starting at index `first`."""
        put(X, self.columns(first, first + X.shape[1]))

    def turn(self, m: int, C: Array) -> None:
        """Replace the first k columns by V C, where V are the first m columns."""
        C_t, n = np.ascontiguousarray(C.T), self.rows.shape[1]
        for first in range(0, n, RESTART_ROWS):
            part = slice(first, first + RESTART_ROWS)
            self.rows[: len(C_t), part] = C_t @ self.rows[:m, part]

    def grow(self, capacity: int, m: int) -> None:
        """Allocate memory for more columns; the first m columns stay."""
        rows = np.empty((capacity, self.rows.shape[1]))
        rows[:m] = self.rows[:m]
        self.rows, self.capacity = rows, capacity


class ArraySpace:
    """Columns are arrays of this process."""

    def __init__(self, n: int, numbering: IntArray | None = None) -> None:
        """Columns with n rows; numbering: numbers of the rows that assign random values to them; None: row order."""
        self.n, self.numbering = n, numbering

    def random(self, generator: np.random.Generator, k: int) -> Array:
        """Return columns of normally distributed numbers, (n, k)."""
        return dealt(generator.standard_normal((k, self.n)).T, self.numbering)

    product = SymmetricProduct

    def basis(self, capacity: int) -> ArrayBasis:
        """Allocate memory for `capacity` columns."""
        return ArrayBasis(self.n, capacity)

    def solver(self, factorization: Inverse) -> Callable[[Array], Array]:
        """Return the function that solves for columns with a factorisation, in the memory order of the factor."""
        return factorization.solve


def dealt(X: Array, numbering: IntArray | None) -> Array:
    """Return row numbering[r] of X at each row r, (n, k), in the memory order of X."""
    return X if numbering is None else X.T[:, numbering].T
