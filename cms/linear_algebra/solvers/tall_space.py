"""Storage of the tall columns of an iteration, (n, k) with n much larger than k, and operations on them.

`ArraySpace` uses arrays of this process; `cms.linear_algebra.solvers.slepc_modes` distributes the rows over ranks.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np

from cms.linear_algebra.solvers.inverse import Inverse
from cms.linear_algebra.solvers.sparse_product import SymmetricProduct
from cms.linear_algebra.solvers.tall import combine, combined, inner, put, subtract
from fe_models.foundation.arrays import Array, IntArray

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
    """Operations of an iteration on its columns, which are arrays or refer to rows on ranks."""

    n: int

    def random(self, generator: np.random.Generator, k: int) -> Any:
        """Return columns of normally distributed numbers, (n, k)."""

    def inner(self, X: Any, Y: Any) -> Array:
        """Return Xᵀ Y, (k, l)."""

    def combine(self, X: Any, C: Array) -> Any:
        """Return X C, (n, l)."""

    def combined(self, X: Any, C: Array) -> Any:
        """Return X C, (n, l), for columns X that are no longer needed, in their memory if possible."""

    def subtract(self, Y: Any, X: Any, C: Array) -> None:
        """Subtract X C from Y in place."""

    def scale(self, X: Any, factors: Array) -> None:
        """Multiply every column by its factor, (k,), in place."""

    def basis(self, capacity: int) -> TallBasis:
        """Allocate memory for `capacity` columns."""

    def whole(self, X: Any) -> Array:
        """Return columns as an array of this process, (n, k)."""

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

    inner = staticmethod(inner)
    combine = staticmethod(combine)
    combined = staticmethod(combined)
    subtract = staticmethod(subtract)
    product = SymmetricProduct

    def scale(self, X: Array, factors: Array) -> None:
        """Multiply every column by its factor, (k,), in place."""
        X *= factors

    def basis(self, capacity: int) -> ArrayBasis:
        """Allocate memory for `capacity` columns."""
        return ArrayBasis(self.n, capacity)

    def whole(self, X: Array) -> Array:
        """Return the columns."""
        return X

    def solver(self, factorization: Inverse) -> Callable[[Array], Array]:
        """Return the function that solves for columns with a factorisation, in the memory order of the factor."""
        return factorization.solve


def dealt(X: Array, numbering: IntArray | None) -> Array:
    """Return row numbering[r] of X at each row r, (n, k), in the memory order of X."""
    return X if numbering is None else X.T[:, numbering].T
