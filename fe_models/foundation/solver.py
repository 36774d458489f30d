"""What a solver of large sparse symmetric systems is: it factorises a matrix once and solves for many columns.

Packages above keep the solvers by name (`cms.solvers.registry`); whatever factorises asks for a `Solver` and holds
a `Factor`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import scipy.sparse as sp

from fe_models.foundation.arrays import Array
from fe_models.foundation.ranks.spread_matrix import SpreadBlock

__all__ = ["Factor", "MakeFactor", "MakeSpreadFactor", "Solver"]


class Factor(Protocol):
    """The factor of a symmetric matrix, in the solver's own memory until `close`."""

    is_open: bool

    @property
    def n(self) -> int:
        """Order of the matrix."""

    @property
    def n_negative(self) -> int:
        """Negative pivots, 0 of a positive definite matrix; -1: the solver cannot tell."""

    @property
    def n_perturbed(self) -> int:
        """Pivots within rounding of zero, which the solver raised."""

    @property
    def n_positive(self) -> int:
        """Positive pivots; -1: the solver cannot tell."""

    @property
    def n_factor_entries(self) -> int:
        """Stored entries of the factor; 8 bytes each."""

    @property
    def description(self) -> str:
        """Solver, its version and settings, in words for the provenance."""

    def solve(self, b: Array) -> Array:
        """Return A⁻¹ b for b (n, k), any order; that of the result is the solver's."""

    def close(self) -> None:
        """Free the factor; a second time does nothing."""


class MakeFactor(Protocol):
    """Factorises a matrix; raises the factorisation error of its package where that fails."""

    def __call__(self, lower: sp.csc_array, *, definite: bool) -> Factor:
        """Return the factor of the symmetric matrix with this lower triangle.

        Parameters
        ----------
        lower
            Lower triangle, (n, n), every diagonal entry stored, sorted row indices; it is the solver's, which may empty
            it.
        definite
            Whether the matrix must be positive definite; False: any symmetric regular one.
        """


class MakeSpreadFactor(Protocol):
    """Factorises a matrix whose rows lie on many ranks."""

    def __call__(self, lower: SpreadBlock, *, definite: bool) -> Factor:
        """Return the factor, rows of columns in solution on the ranks that have those of the block.

        Parameters
        ----------
        lower, definite
            As of `MakeFactor`; of the block each rank takes its rows from the diagonal on.
        """


@dataclass(frozen=True)
class Solver:
    """A way to factorise, by the name that users choose it by."""

    name: str
    factor: MakeFactor
    missing: Callable[[], str] = lambda: ""  #: "" where it can be used, else what is missing and what to install
    spread: MakeSpreadFactor | None = None  #: None: it takes matrices of one process
