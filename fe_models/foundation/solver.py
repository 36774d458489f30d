"""Protocol of a solver for large sparse symmetric systems: factorise once, then solve for many columns.

Higher packages keep the solvers by name (`cms.linear_algebra.solvers.registry`). Code that factorises takes a `Solver`
and keeps a `Factor`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import scipy.sparse as sp

from fe_models.foundation.arrays import Array
from fe_models.foundation.ranks.spread_matrix import SpreadBlock

__all__ = ["Factor", "MakeFactor", "MakeSpreadFactor", "Solver"]


class Factor(Protocol):
    """The factor of a symmetric matrix, in the solver's own memory until `close` is called."""

    is_open: bool

    @property
    def n(self) -> int:
        """Order of the matrix."""

    @property
    def n_negative(self) -> int:
        """Number of negative pivots, 0 for a positive definite matrix; -1 if the solver does not report it."""

    @property
    def n_perturbed(self) -> int:
        """Number of pivots that were zero to rounding and that the solver perturbed."""

    @property
    def n_positive(self) -> int:
        """Number of positive pivots; -1 if the solver does not report it."""

    @property
    def n_factor_entries(self) -> int:
        """Number of stored entries of the factor, 8 bytes each."""

    @property
    def description(self) -> str:
        """Solver, its version and settings, for the provenance."""

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b for b, (n, k), in any memory order; the solver chooses the memory order of the result."""

    def close(self) -> None:
        """Free the factor; further calls do nothing."""


class MakeFactor(Protocol):
    """Function that factorises a matrix; it raises the factorisation error of its package if that fails."""

    def __call__(self, lower: sp.csc_array, *, definite: bool) -> Factor:
        """Return the factor of the symmetric matrix with this lower triangle.

        Parameters
        ----------
        lower
            Lower triangle, (n, n), with every diagonal entry stored and sorted row indices. The solver owns it and may
            empty it.
        definite
            Whether the matrix must be positive definite; False: any regular symmetric matrix.
        """


class MakeSpreadFactor(Protocol):
    """Function that factorises a distributed matrix."""

    def __call__(self, lower: SpreadBlock, *, definite: bool) -> Factor:
        """Return the factor. Right-hand sides and solutions are distributed like the rows of the block.

        Parameters
        ----------
        lower, definite
            As for `MakeFactor`; each rank takes its rows of the upper triangle from the block.
        """


@dataclass(frozen=True)
class Solver:
    """A factorisation method under the name by which users choose it."""

    name: str
    factor: MakeFactor
    #: returns "" if the solver can be used, else what is missing and what to install
    missing: Callable[[], str] = lambda: ""
    #: factorisation of distributed matrices; None: only matrices of a single process
    spread: MakeSpreadFactor | None = None
