"""Protocol of a solver for (K - sigma M) x = f in the eigensolver."""

from typing import Protocol

from cms.linear_algebra.solvers.factorization import Inertia
from fe_models.foundation.arrays import Array
from fe_models.foundation.solver import Solver

__all__ = ["Inverse"]


class Inverse(Protocol):
    """A `Factorization`, or an operator made from one (`cms.modes.families.flexibility`)."""

    @property
    def n(self) -> int:
        """Order of the matrix."""

    @property
    def description(self) -> str:
        """Name and settings of the solver, for the provenance."""

    @property
    def solver(self) -> Solver:
        """Solver that computed the factor, for further matrices of the same pencil."""

    @property
    def inertia(self) -> Inertia:
        """Return the signs of the eigenvalues of K - sigma M."""

    def solve(self, b: Array) -> Array:
        """Return the solutions for the right-hand sides b, (n, k)."""
