"""The shift-inverted operator S = (K - sigma M)⁻¹ M on tall columns, and refinement of modes by one more application.

`ArraySpace` keeps the columns of an iteration in arrays of this process; `cms.linear_algebra.solvers.slepc_modes`
distributes their rows over ranks. The operations on the columns are those of `fe_models.foundation.tall.columns`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import scipy.linalg as la

from cms.linear_algebra.solvers.factorization import Matrix
from cms.linear_algebra.solvers.inverse import Inverse
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.sparse.sparse_product import SymmetricProduct
from fe_models.foundation.tall.columns import combine, gram, inner, subtract

__all__ = [
    "ArraySpace", "Modes", "ShiftInverted", "TallProduct", "TallSpace", "measured_residual",
    "refined_modes",
]  # fmt: skip

SAMPLES = 4  #: number of random combinations that measure all residuals together


# where an iteration keeps its columns, (n, k) with n much larger than k -----------------------------------------------


class TallProduct(Protocol):
    """Map x -> A x with a symmetric matrix A, for columns of one space."""

    def __matmul__(self, x: Any) -> Any:
        """Return A x, (n, k)."""


class TallSpace(Protocol):
    """Storage of the columns of an iteration, with random columns and the operators on them."""

    n: int

    def random(self, generator: np.random.Generator, k: int) -> Any:
        """Return k columns of normally distributed numbers, (n, k)."""

    def empty(self, k: int) -> Any:
        """Return k uninitialised columns, (n, k)."""

    def product(self, A: Any) -> TallProduct:
        """Return the product with a symmetric matrix A, (n, n), as an operator."""

    def solver(self, factorization: Inverse) -> Callable[[Any], Any]:
        """Return the solution with a factorisation as an operator on columns."""


@dataclass(eq=False)
class ArraySpace:
    """Space whose columns are arrays of this process."""

    n: int  #: number of rows
    #: row r of random columns gets random value numbering[r]; None: the value of its row
    numbering: IntArray | None = None

    def random(self, generator: np.random.Generator, k: int) -> Array:
        """Return k columns of normally distributed numbers, (n, k)."""
        columns = generator.standard_normal((k, self.n))
        return columns.T if self.numbering is None else columns[:, self.numbering].T

    product = SymmetricProduct

    def empty(self, k: int) -> Array:
        """Return k uninitialised columns, (n, k), stored column by column."""
        return np.empty((self.n, k), order="F")

    def solver(self, factorization: Inverse) -> Callable[[Array], Array]:
        """Return the solution with a factorisation as an operator on columns in the memory order of the factor."""
        return factorization.solve


# the operator ---------------------------------------------------------------------------------------------------------


class ShiftInverted:
    """Operator S with its tolerance, for columns of one space; it counts the solved columns."""

    def __init__(
        self,
        M: Matrix,
        shift: float,
        factorization: Inverse,
        tolerance: float,
        progress: Callable[[int, int], None] | None = None,
        space: TallSpace | None = None,
    ) -> None:
        self.shift, self.tolerance = shift, tolerance
        self.has_mass_everywhere = bool((M.diagonal() > 0).all())
        self.n = M.shape[0]
        self.space: TallSpace = space or ArraySpace(self.n)
        self.M_product = self.space.product(M)
        self.n_solves = 0
        self.factorization = factorization
        #: callback that receives the number of found modes and of wanted modes
        self.report = progress or (lambda found, wanted: None)
        self._solve = self.space.solver(factorization)

    def solve(self, b: Any) -> Any:
        """Return (K - sigma M)⁻¹ b, (n, k)."""
        self.n_solves += b.shape[1]
        return self._solve(b)


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes as combinations of a block of columns: the wanted modes, then a few guard modes."""

    omega2: Array  #: squared angular frequencies, ascending, (n_wanted + n_guards,)
    n_wanted: int
    residuals: Array  #: residuals of all modes before the last improvement, (n_wanted + n_guards,)
    Y: Any  #: columns of the space that are combined, (n, p)
    Z: Array  #: coefficients of M-orthonormal modes Phi = Y Z, (p, n_wanted + n_guards)


def refined_modes(operator: ShiftInverted, X: Any, theta: Array, n_wanted: int) -> Modes:
    """Refine M-orthonormal Ritz vectors X, (n, p), by one inverse iteration and Rayleigh-Ritz.

    (1) Y = S X / theta; residuals |Y - X|_M
    (2) Yᵀ (K - sigma M) Y = Yᵀ M X / theta = H,  Yᵀ M Y = G;  H z = (omega² - sigma) G z
    """
    M = operator.M_product
    M_X = M @ X
    Y = operator.solve(M_X)
    Y *= 1 / theta
    H = inner(Y, M_X) / theta
    del M_X
    subtract(X, Y, np.eye(len(theta)))
    residuals = np.sqrt(np.maximum(np.diag(inner(X, M @ X)), 0.0))
    del X
    mu, Z = la.eigh((H + H.T) / 2, gram(Y, M @ Y))
    return Modes(mu + operator.shift, n_wanted, residuals, Y, Z)


def measured_residual(operator: ShiftInverted, modes: Modes) -> tuple[float, float]:
    """Measure (Σ_j |r_j|_M²)^½ of the wanted modes, r_j = x_j - (omega_j² - sigma) S x_j, with few columns.

    A sum Σ ± r_j with random signs has the expected squared length Σ |r_j|² in any norm. The mean of `SAMPLES` sums is
    used.

    Returns
    -------
    residual
        Estimate in the M-norm, (Σ_j |r_j|_M²)^½, which bounds each |r_j|_M.
    defect
        Estimate in the Euclidean norm, relative to the columns; it includes massless components.
    """
    k = modes.n_wanted
    Z, above_shift = modes.Z[:, :k], modes.omega2[:k] - operator.shift
    signs = np.random.default_rng(0).choice([-1.0, 1.0], size=(k, SAMPLES))
    M = operator.M_product
    r = combine(modes.Y, Z @ signs)
    size = np.sqrt(np.trace(inner(r, r)))
    S_x = operator.solve(M @ combine(modes.Y, Z @ (above_shift[:, None] * signs)))
    subtract(r, S_x, np.eye(SAMPLES))
    squared = np.trace(inner(r, M @ r))
    left = np.sqrt(np.trace(inner(r, r)))
    return float(np.sqrt(max(squared, 0.0) / SAMPLES)), float(left / size) if size else 0.0
