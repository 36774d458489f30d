"""What the eigensolver asks of whatever solves (K - sigma M) x = f for it."""

from typing import Protocol

from cms.solvers.factorization import Inertia
from fe_models.foundation.arrays import Array
from fe_models.foundation.solver import Solver

__all__ = ["Inverse"]


class Inverse(Protocol):
    """A `Factorization`, or an operator made from one (`cms.families.flexibility`)."""

    @property
    def n(self) -> int:
        """Order."""

    @property
    def description(self) -> str:
        """Solver in words for the provenance."""

    @property
    def solver(self) -> Solver:
        """What factorised, for further matrices of the same pencil."""

    @property
    def inertia(self) -> Inertia:
        """Signs of the eigenvalues of K - sigma M."""

    def solve(self, b: Array) -> Array:
        """Return the solutions of right-hand sides (n, k)."""
