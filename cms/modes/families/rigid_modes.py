"""Motions without strain energy: rigid-body modes (docs/theory.md §2), and motions of mechanisms."""

import numpy as np
import scipy.linalg as la

from cms.errors import BodyError
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.columns import combine, dots, of_this_process
from fe_models.foundation.words import node_list

__all__ = [
    "WITHIN_ROUNDING",
    "determinate_partition",
    "free_motions",
    "independent_rigid_modes",
    "mechanism_words",
    "moving_nodes",
    "rounding_of_energy",
    "without_energy",
]

HOLDS = 1e-4  #: pivot above which fixing a dof prevents a motion well enough for a factorisation
#: tolerance for rigid-body modes restricted to some dofs, with rotations scaled by the body length
RANK_TOLERANCE = 1e-8


def independent_rigid_modes(body: FEBody) -> tuple[Array, IntArray]:
    """Return independent rigid-body modes about the mean of the nodes; none if the body is fixed to the ground.

    Returns
    -------
    Psi_R
        Modes, (n_dof, n_r), with columns d [-] and theta [m]; n_r is 6 in space, 3 for a body with plane dofs, 1 for a
        row of masses.
    components
        Index of each mode among d_x d_y d_z theta_x theta_y theta_z, (n_r,).

    Raises
    ------
    BodyError
        If the body has no displacement dofs.
    """
    if body.is_held:
        return np.zeros((body.n_dof, 0)), np.zeros(0, np.int64)
    Psi_R = rigid_motion_of_dofs(body.nodes, body.dofs, body.nodes.mean(axis=0))
    scaled = _in_lengths(body, Psi_R)
    scaled[:, 3:] /= body.length
    _, R, pivots = la.qr(scaled, mode="economic", pivoting=True)
    sizes = np.abs(np.diag(R))
    rank = int((sizes > RANK_TOLERANCE * sizes.max(initial=0.0)).sum()) if sizes.any() else 0
    if rank == 0:
        raise BodyError(f"body {body.name!r}: has no displacement dofs; expected components 0..5")
    components = np.sort(pivots[:rank]).astype(np.int64)
    return Psi_R[:, components], components


def determinate_partition(body: FEBody, Psi_R: Array) -> tuple[IntArray, IntArray]:
    """Choose the statically determinate dofs R among the boundary dofs, and interior dofs if those do not suffice.

    (1) pivoted QR of the rigid-body modes restricted to B, rotations scaled by the body length
    (2) if their rank is below n_r: the same over the interior dofs, for the motions that B leaves free

    Parameters
    ----------
    Psi_R
        Independent rigid-body modes, (n_dof, n_r).

    Returns
    -------
    r
        Determinate dofs, (n_r,), ascending.
    extra
        Dofs of R in the interior; empty if the interfaces hold the body.
    """
    if not Psi_R.shape[1]:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    scaled = _in_lengths(body, Psi_R)
    scaled /= np.abs(scaled).max(axis=0)
    n_r = scaled.shape[1]
    b = body.b
    Q, R, pivots = la.qr(scaled[b].T, pivoting=True) if len(b) else (np.eye(n_r), np.zeros((n_r, 0)), b)
    rank = int((np.abs(np.diag(R)) > HOLDS).sum())
    held = b[pivots[:rank]]
    extra = np.zeros(0, np.int64)
    if rank < n_r:
        i = body.i
        *_, pivots = la.qr((scaled[i] @ Q[:, rank:]).T, mode="economic", pivoting=True)
        extra = np.sort(i[pivots[: n_r - rank]])
    return np.sort(np.concatenate([held, extra])), extra


def _in_lengths(body: FEBody, Psi_R: Array) -> Array:
    """Return rigid-body modes with rotational dofs scaled to the translation at one body length."""
    scaled = Psi_R.copy()
    scaled[body.dofs[:, 1] >= 3] *= body.length
    return scaled


# motions without strain energy: which they are, how many, and where they are largest ---------------------------------
# An energy uᵀ K u is a sum of terms K_kk u_k² and of others that are no larger. For a motion without energy, rounding
# gives about eps times this sum instead of zero. A motion counts as free if its energy is below this rounding error,
# independent of the ratio between the softest and the stiffest part of the body.


WITHIN_ROUNDING = 30.0  #: ratio of energy to rounding error, below which a motion is free; free motions have 0.01 to 1
SUSPECT = 1e-6  #: ratio of energy to the sum of K_kk u_k², above which a direction is certainly not free


def rounding_of_energy(body: FEBody, u: Array) -> Array:
    """Return the rounding error of the strain energy of each column: eps times Σ |K_kk| u_k², (k,)."""
    return np.finfo(float).eps * dots(u, u, np.abs(body.K.diagonal()))


def free_motions(body: FEBody, X: Array, C: Array, S: Array, terms: Array, load: Array | None = None) -> Array:
    """Return the motions in the span of X C without strain energy, (n_dof, n_free).

    (1) eigenvectors v of S, scaled by the size of its terms; only those with small eigenvalues are suspect
    (2) a suspect motion u = X C v has no strain energy in the body if uᵀ K u is within its rounding
    (3) combinations of these motions are free if they have no energy in the load either. The load energy
        vᵀ Cᵀ K_load C v does not suffer from the rounding of K, so it is compared with the terms of S alone

    Parameters
    ----------
    X, C
        Columns, (n_dof, k), and independent combinations of them, (k, m).
    S
        (X C)ᵀ K (X C) + Cᵀ K_load C, (m, m).
    terms
        Sum of the terms K_kk x_k² of each column of X, or a dominant part of this sum, (k,).
    load
        K_load, the stiffness of neighbours over the columns of X, (k, k); None if there are none.
    """
    if load is not None:
        terms = terms + np.abs(np.diag(load))
    size = np.sqrt(C.T**2 @ terms)
    size = 1 / np.where(size > 0, size, 1.0)
    values, vectors = la.eigh((S + S.T) / 2 * np.outer(size, size))
    v = size[:, None] * vectors[:, values < SUSPECT]
    if not v.shape[1]:
        return np.zeros((body.n_dof, 0))
    u = of_this_process(combine(X, C @ v))
    is_free = without_energy(body, u)
    u, on_load = np.asarray(u[:, is_free]), C @ v[:, is_free]
    if load is None or not u.shape[1]:
        return u
    G = on_load.T @ load @ on_load
    values, vectors = la.eigh((G + G.T) / 2)
    return np.asarray(u @ vectors[:, values < WITHIN_ROUNDING * np.finfo(float).eps])


def without_energy(body: FEBody, u: Array) -> np.ndarray:
    """Return whether the strain energy of each motion is no more than rounding, (k,) bool."""
    return np.asarray(dots(u, body.K @ u) < WITHIN_ROUNDING * rounding_of_energy(body, u))


def mechanism_words(body: FEBody, u: Array) -> str:
    """Describe the number of non-rigid motions without energy, and where they are largest."""
    several = u.shape[1] > 1
    return (
        f"body {body.name!r}: {u.shape[1]} motion{'s' if several else ''} besides the rigid ones "
        f"cost{'' if several else 's'} no energy: a mechanism (or a wire whose bending is lost in the rounding of its "
        f"tension), largest at {moving_nodes(body, np.arange(body.n_dof), u)}; join the parts or support them"
    )


def moving_nodes(body: FEBody, rows: IntArray, Phi: Array) -> str:
    """Name the three nodes that move most in these motions over the given dofs, with their positions."""
    is_translation = (body.dofs[rows, 1] >= 0) & (body.dofs[rows, 1] < 3)
    chosen = is_translation if is_translation.any() else np.ones(len(rows), bool)
    size = np.bincount(body.dofs[rows[chosen], 0], (Phi[chosen] ** 2).sum(axis=1), minlength=len(body.nodes))
    order = np.argsort(-np.round(size / size.max(), 6), kind="stable")  # nodes with equal motion keep their order
    return node_list(order[: min(3, np.count_nonzero(size))].tolist(), body.nodes)
