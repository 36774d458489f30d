"""Rigid-body modes of a free body, computed in three ways that must give the same space (docs/theory.md §2)."""

import numpy as np
import scipy.linalg as la

from cms.errors import BodyError
from fe_models.body.couplings.submatrix import principal_block
from fe_models.body.fe_body import FEBody
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array, IntArray

__all__ = [
    "determinate_dofs",
    "determinate_partition",
    "geometric_rigid_modes",
    "independent_rigid_modes",
    "null_space_rigid_modes",
    "static_rigid_modes",
]

HOLDS = 1e-4  #: pivot above which a dof holds a motion well enough for a factorisation
#: tolerance for rigid-body modes restricted to some dofs, with rotations scaled by the body length
RANK_TOLERANCE = 1e-8


def geometric_rigid_modes(body: FEBody, *, origin: Array | None = None) -> Array:
    """Return rigid-body modes from node positions: u = d + theta × c; rotations are theta, multipliers are 0.

    Parameters
    ----------
    origin
        Reference point of the rotations, (3,) [m]; default: origin of the mesh.

    Returns
    -------
    Array
        (n_dof, 6); columns d_x d_y d_z [-] and theta_x theta_y theta_z [m].
    """
    return rigid_motion_of_dofs(body.nodes, body.dofs, np.zeros(3) if origin is None else origin)


def determinate_dofs(body: FEBody, candidates: IntArray) -> IntArray:
    """Choose six of the candidate dofs that just prevent rigid-body motion (the set R of docs/theory.md §1).

    The choice uses pivoted QR of the rigid-body modes restricted to the candidates, rotations scaled by the body
    length.

    Raises
    ------
    BodyError
        If the candidates leave a rigid-body motion free.
    """
    Psi_R = geometric_rigid_modes(body, origin=body.nodes.mean(axis=0))[candidates]
    Psi_R[:, 3:] /= body.length  # theta of one per body length, comparable to a unit translation
    Psi_R[body.dofs[candidates, 1] >= 3] *= body.length  # a rotational dof counts as the translation at that length
    _, R, pivots = la.qr(Psi_R.T, mode="economic", pivoting=True)
    pivot_sizes = np.abs(np.diag(R))
    rank = int((pivot_sizes > RANK_TOLERANCE * max(pivot_sizes.max(initial=0.0), 1.0)).sum())
    if rank < 6:
        raise BodyError(
            f"body {body.name!r}: {len(candidates)} dofs hold only {rank} of the 6 rigid-body motions; "
            "take an interface with six dofs, or more nodes that are not on one line"
        )
    return np.sort(candidates[pivots[:6]])


def independent_rigid_modes(body: FEBody) -> tuple[Array, IntArray]:
    """Return rigid-body modes about the mean of the nodes, without those that the dofs cannot make; none if held.

    Returns
    -------
    Psi_R
        (n_dof, n_r); n_r is 6 in space, 3 for a body with plane dofs, 1 for a row of masses; columns d [-], theta [m].
    components
        Index of each mode among d_x d_y d_z theta_x theta_y theta_z, (n_r,).

    Raises
    ------
    BodyError
        If the body has no displacement dofs.
    """
    if body.is_held:
        return np.zeros((body.n_dof, 0)), np.zeros(0, np.int64)
    Psi_R = geometric_rigid_modes(body, origin=body.nodes.mean(axis=0))
    scaled = _in_lengths(body, Psi_R)
    scaled[:, 3:] /= body.length or 1.0
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
        Those of R that are interior dofs; empty if the interfaces hold the body.
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
    """Return rigid-body modes in which a rotational dof counts as the translation at one body length."""
    scaled = Psi_R.copy()
    scaled[body.dofs[:, 1] >= 3] *= body.length or 1.0
    return scaled


def static_rigid_modes(body: FEBody, r: IntArray) -> Array:
    """Return rigid-body modes as static solutions for unit displacements of the determinate dofs r, (n_dof, 6).

    The interior part is -K_ff⁻¹ K_fr, where f are all dofs except r. This uses only the stiffness matrix.
    """
    from cms.linear_algebra.solvers.factorization import factorize

    f = np.setdiff1d(np.arange(body.n_dof), r)
    columns = body.K[:, r].toarray()
    Psi_R = np.zeros((body.n_dof, len(r)))
    Psi_R[r, np.arange(len(r))] = 1.0
    with factorize(principal_block(body.K, f), definite=not (body.dofs[:, 1] < 0).any()) as factorization:
        Psi_R[f] = -factorization.solve(columns[f])
    return Psi_R


def null_space_rigid_modes(body: FEBody) -> Array:
    """Return rigid-body modes as zero-frequency vibration modes of the free body, (n_dof, 6), M-orthonormal."""
    from cms.linear_algebra.solvers.eigen import eigenmodes

    return eigenmodes(body.K, body.M, n_modes=6).Phi
