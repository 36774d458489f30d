"""The lowest modes of the reduced pencil: a diagonal stiffness, a mass with blocks along the tree."""

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cms.solvers.eigen import eigenmodes
from cms.solvers.factorization import Inertia
from cms.solvers.registry import solver_of
from fe_models.foundation.arrays import Array

__all__ = ["reduced_modes"]

DENSE = 3000  #: modes of substructures up to which dense matrices are fast and small
TOLERANCE = 1e-4  #: residual of the iteration, far below what the substructures leave out


class Diagonal:
    """The inverse of a diagonal matrix, as the eigensolver wants it."""

    description = "a diagonal"

    def __init__(self, d: Array) -> None:
        self.d, self.n = d, len(d)
        self.inertia = Inertia(0, 0, len(d))
        self.solver = solver_of()

    def solve(self, b: Array) -> Array:
        """Return d⁻¹ b, (n, k)."""
        return b / self.d[:, None]


def reduced_modes(omega2: Array, M: sp.csc_array, count: int) -> tuple[Array, Array]:
    """Return the lowest `count` eigenvalues, ascending, and M-orthonormal vectors, (n, count).

    Dense: with D = diag(omega²), the largest theta of D^-½ M D^-½ are 1 / omega² of the modes.
    """
    n = len(omega2)
    if n > DENSE and 3 * count < n:
        found = eigenmodes(
            sp.csc_array(sp.diags_array(omega2)), M, count, factorization=Diagonal(omega2), tolerance=TOLERANCE
        )
        return np.array(found.omega2), np.array(found.Phi)
    scale = 1 / np.sqrt(omega2)
    A = scale[:, None] * M.toarray() * scale
    theta, Z = la.eigh(A, subset_by_index=(n - count, n - 1), overwrite_a=True)
    theta, Z = theta[::-1], Z[:, ::-1]
    return 1 / theta, scale[:, None] * Z / np.sqrt(theta)
