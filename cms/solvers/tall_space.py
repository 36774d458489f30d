"""Where the tall columns of an iteration lie, (n, k) with n much larger than k, and what it does with them.

`ArraySpace`: arrays of this process. Rows of them on many ranks: `cms.solvers.rank_space`.
"""

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sp

from cms.solvers.inverse import Inverse
from cms.solvers.sparse_product import SymmetricProduct
from cms.solvers.tall import combine, combined, inner, put, subtract
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["ArraySpace", "TallBasis", "TallProduct", "TallSpace"]

RESTART_ROWS = 65536  #: turned at once; no second basis in memory


class TallProduct(Protocol):
    """The map x -> A x of a symmetric matrix A, of columns of one space."""

    def __matmul__(self, x: Any) -> Any:
        """Return A x, (n, k)."""


class TallBasis(Protocol):
    """Columns that grow in number, in memory of their own."""

    capacity: int  #: columns there is room for

    def columns(self, first: int, last: int) -> Any:
        """Return some of them, (n, last - first); they change with the basis."""

    def put(self, first: int, X: Any) -> None:
        """Write columns, from this one on."""

    def turn(self, m: int, C: Array) -> None:
        """Replace the first k columns by V C of the first m, C (m, k)."""

    def grow(self, capacity: int, m: int) -> None:
        """Make room for more; the first m columns stay."""


class TallSpace(Protocol):
    """What an iteration asks of the place where its columns lie; columns are arrays, or stand for rows on ranks."""

    n: int

    def random(self, generator: np.random.Generator, k: int) -> Any:
        """Return columns of normally distributed numbers, (n, k)."""

    def inner(self, X: Any, Y: Any) -> Array:
        """Return Xᵀ Y, (k, l)."""

    def combine(self, X: Any, C: Array) -> Any:
        """Return X C, (n, l)."""

    def combined(self, X: Any, C: Array) -> Any:
        """Return X C, (n, l), for columns X that are not used any more, in their place if that is possible."""

    def subtract(self, Y: Any, X: Any, C: Array) -> None:
        """Take X C from Y in place."""

    def scale(self, X: Any, factors: Array) -> None:
        """Multiply every column by its factor, (k,), in place."""

    def basis(self, capacity: int) -> TallBasis:
        """Return room for so many columns."""

    def whole(self, X: Any) -> Array:
        """Return columns as an array of this process, (n, k)."""

    def product(self, A: Any) -> TallProduct:
        """Return the product with a symmetric matrix, (n, n)."""

    def solver(self, factorization: Inverse) -> Callable[[Any], Any]:
        """Return what solves for columns by a factorisation."""


class ArrayBasis:
    """The basis, column by column."""

    def __init__(self, n: int, capacity: int) -> None:
        self.rows, self.capacity = np.empty((capacity, n)), capacity

    def columns(self, first: int, last: int) -> Array:
        """Return a view."""
        return self.rows[first:last].T

    def put(self, first: int, X: Array) -> None:
        """Write columns, from this one on."""
        put(X, self.columns(first, first + X.shape[1]))

    def turn(self, m: int, C: Array) -> None:
        """Replace the first k columns by V C of the first m."""
        C_t, n = np.ascontiguousarray(C.T), self.rows.shape[1]
        for first in range(0, n, RESTART_ROWS):
            part = slice(first, first + RESTART_ROWS)
            self.rows[: len(C_t), part] = C_t @ self.rows[:m, part]

    def grow(self, capacity: int, m: int) -> None:
        """Make room for more; the first m columns stay."""
        rows = np.empty((capacity, self.rows.shape[1]))
        rows[:m] = self.rows[:m]
        self.rows, self.capacity = rows, capacity


class ArraySpace:
    """Columns are arrays of this process."""

    def __init__(self, n: int, numbering: IntArray | None = None) -> None:
        """Columns of n rows; numbering: of the rows, by which random numbers are dealt to them, None: as they lie."""
        self.n, self.numbering = n, numbering

    def random(self, generator: np.random.Generator, k: int) -> Array:
        """Return columns of normally distributed numbers, (n, k)."""
        return dealt(generator.standard_normal((k, self.n)).T, self.numbering)

    def inner(self, X: Array, Y: Array) -> Array:
        """Return Xᵀ Y, (k, l)."""
        return inner(X, Y)

    def combine(self, X: Array, C: Array) -> Array:
        """Return X C, (n, l)."""
        return combine(X, C)

    def combined(self, X: Array, C: Array) -> Array:
        """Return X C, (n, l), in the place of X, which is lost."""
        return combined(X, C)

    def subtract(self, Y: Array, X: Array, C: Array) -> None:
        """Take X C from Y in place."""
        subtract(Y, X, C)

    def scale(self, X: Array, factors: Array) -> None:
        """Multiply every column by its factor, (k,), in place."""
        X *= factors

    def basis(self, capacity: int) -> ArrayBasis:
        """Return room for so many columns."""
        return ArrayBasis(self.n, capacity)

    def whole(self, X: Array) -> Array:
        """Return the columns."""
        return X

    def product(self, A: sp.csc_array) -> SymmetricProduct:
        """Return the product with a symmetric matrix, (n, n)."""
        return SymmetricProduct(A)

    def solver(self, factorization: Inverse) -> Callable[[Array], Array]:
        """Return what solves for columns by a factorisation, in the order of the factor."""
        return factorization.solve


def dealt(X: Array, numbering: IntArray | None) -> Array:
    """Return row numbering[r] of X at each row r, (n, k), in the order in memory that X has."""
    return X if numbering is None else X.T[:, numbering].T
