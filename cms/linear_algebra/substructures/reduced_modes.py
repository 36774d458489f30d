"""The lowest modes of the reduced pencil, which has a diagonal stiffness and a mass with blocks along the tree."""

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from cms.linear_algebra.solvers.eigen import eigenmodes
from cms.linear_algebra.solvers.factorization import Inertia
from cms.linear_algebra.solvers.registry import solver_of
from cms.linear_algebra.solvers.tall import combine, combined, inner
from cms.linear_algebra.substructures.reduced_mass import ReducedMass
from fe_models.foundation.arrays import Array

__all__ = ["reduced_modes", "reduced_omega2"]

START = 5  #: substructure modes per wanted mode in the first pencil of the search
DENSE = 3000  #: number of substructure modes up to which dense matrices are fast and small
TOLERANCE = 1e-4  #: residual of the iteration, far below the error of the substructures
WIDER = 4  #: ratio of substructure modes in successive pencils
SETTLED = 5e-5  #: relative error of omega² that the iteration may leave
LAG = 4.0  #: factor on the error after a step, compared with the contribution of much higher modes alone
MOST_STEPS = 20


class Diagonal:
    """The inverse of a diagonal matrix, in the form that the eigensolver needs."""

    description = "a diagonal"

    def __init__(self, d: Array) -> None:
        self.d, self.n = d, len(d)
        self.inertia = Inertia(0, 0, len(d))
        self.solver = solver_of()

    def solve(self, b: Array) -> Array:
        """Return d⁻¹ b, (n, k)."""
        return b / self.d[:, None]


def reduced_modes(omega2: Array, M: ReducedMass, count: int) -> tuple[Array, Array]:
    """Return the lowest `count` eigenvalues, ascending, and M-orthonormal vectors, (n, count).

    (1) solve the pencil of the lowest substructure modes, some for each wanted mode
    (2) use four times as many, and so on up to all, adding new ones to first order; if that is not accurate enough, use
        subspace iteration that starts with these vectors
    """
    n = len(omega2)
    few = min(n, max(START * count, DENSE // 2))
    if 2 * few >= n:
        return _at_once(omega2, M, count)
    is_in = _lowest(omega2, few)
    lam, Z = _at_once(omega2[is_in], M.of(is_in), count)  # (1)
    while not is_in.all():  # (2)
        few *= WIDER
        before, is_in = is_in, _lowest(omega2, few) if 2 * few < n else np.ones(n, dtype=bool)
        part, is_new, cut = M.of(is_in), ~before[is_in], float(omega2[is_in & ~before].min())
        found, Z = _widened(omega2[is_in], part, lam, Z, is_new)
        is_settled, lam = _is_settled(lam, found, cut), found
        if not is_settled:
            lam, Z = _iterated(omega2[is_in], part, lam, Z, cut)
    return lam, Z


def _widened(omega2: Array, M: ReducedMass, lam: Array, Z: Array, is_new: NDArray[np.bool_]) -> tuple[Array, Array]:
    """Step (2): return the eigenpairs with new substructure modes in addition to those of Z, (n_old, k).

    (1) contribution of a step of subspace iteration along the new modes, d = D⁻¹ M_no Z Lambda; it only scales Z
    (2) H = Lambda + B,  B = dᵀ D d;  G = 1 + A + Aᵀ + dᵀ M_nn d,  A = dᵀ M_no Z = B Lambda⁻¹
    (3) H c = lam G c,  Z <- [Z; d] C
    """
    whole = np.zeros((len(omega2), Z.shape[1]))
    d = M.between(is_new, ~is_new, Z) * lam / omega2[is_new, None]  # (1)
    root = np.sqrt(omega2[is_new])[:, None] * d
    B = inner(root, root)  # (2)
    del root
    G = np.eye(len(lam)) + B / lam + (B / lam).T + _symmetric(inner(d, M.of(is_new) @ d))
    lam, C = la.eigh(np.diag(lam) + B, G)  # (3)
    whole[~is_new], whole[is_new] = Z, d
    return lam, combined(whole, C)


def _symmetric(A: Array) -> Array:
    return (A + A.T) / 2


def _is_settled(before: Array, lam: Array, cut: float) -> bool:
    """Return whether the share of the last change that a step leaves is small.

    The missing part of the modes lies along modes above the cut; a step leaves about (lam / cut)² of their error.
    """
    left = (before / lam - 1) * np.minimum(LAG * (lam / cut) ** 2, 0.5)
    return bool((left <= SETTLED).all())


def _lowest(omega2: Array, few: int) -> NDArray[np.bool_]:
    return omega2 <= np.partition(omega2, few - 1)[few - 1]


def _iterated(omega2: Array, M: ReducedMass, lam: Array, Z: Array, cut: float) -> tuple[Array, Array]:
    """Step (2): subspace iteration Y = D⁻¹ M Z, D = diag(omega²), H = Yᵀ D Y, G = Yᵀ M Y, H c = lam G c, Z <- Y C.

    It ends when the error that a step leaves is small.
    """
    M_Z = M @ Z
    for _ in range(MOST_STEPS):
        before = lam
        Y = M_Z / omega2[:, None]
        H, M_Y = inner(Y, M_Z), M @ Y
        scale = 1 / np.sqrt(np.diag(H))
        lam, C = la.eigh(H * np.outer(scale, scale), inner(Y, M_Y) * np.outer(scale, scale))
        C *= scale[:, None]
        Z, M_Z = combine(Y, C), combine(M_Y, C)
        if _is_settled(before, lam, cut):
            break
    return lam, Z


def _at_once(omega2: Array, M: ReducedMass, count: int) -> tuple[Array, Array]:
    """Solve densely: with D = diag(omega²), the largest theta of D^-½ M D^-½ are 1 / omega² of the modes."""
    n = len(omega2)
    if n > DENSE and 3 * count < n:
        found = eigenmodes(
            sp.csc_array(sp.diags_array(omega2)), M.tocsc(), count, factorization=Diagonal(omega2), tolerance=TOLERANCE
        )
        return np.array(found.omega2), np.array(found.Phi)
    A, scale = _scaled(omega2, M)
    theta, Z = la.eigh(A, subset_by_index=(n - count, n - 1), overwrite_a=True)
    theta, Z = theta[::-1], Z[:, ::-1]
    return 1 / theta, scale[:, None] * Z / np.sqrt(theta)


def reduced_omega2(omega2: Array, M: ReducedMass, k: int) -> float:
    """Return the k-th lowest eigenvalue, k from 1, by a dense solution."""
    n = len(omega2)
    A, _ = _scaled(omega2, M)
    theta = la.eigh(A, subset_by_index=(n - k, n - k), overwrite_a=True, eigvals_only=True)
    return float(1 / theta[0])


def _scaled(omega2: Array, M: ReducedMass) -> tuple[Array, Array]:
    """Return D^-½ M D^-½ and the diagonal of D^-½."""
    scale = 1 / np.sqrt(omega2)
    return scale[:, None] * M.toarray() * scale, scale
