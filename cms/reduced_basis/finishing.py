"""The finishing step every mode set passes: rank, body frame, M-orthonormal shapes (docs/theory.md §3)."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.errors import BodyError, ModeSetError
from cms.families.fixed_interface import moving_nodes
from cms.mode_set import ModeSet
from cms.reduced_basis.frames import FrameCondition
from cms.reduced_basis.independent import Columns, gram, independent_columns
from cms.reduced_body.source_columns import SourceColumns, source_columns
from cms.solvers.orientation import orientation
from cms.solvers.sparse_product import SymmetricProduct
from cms.solvers.tall import combine
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array

__all__ = ["FinishedBasis", "finish"]

RIGID_ENERGY = 1e-6  #: squared W-length of a unit column after its rigid part is taken off, if nothing else is in it
MASSLESS = 1e-12  #: modal mass times omega_1² of a shape of unit W-length, below which it is static
ZERO_ENERGY = 1e-8  #: omega² in units of omega_1², below which a shape costs no energy
ORTHONORMAL_DEFECT = 1e-9  #: largest defect of Phi.T M Phi - 1 that is accepted


@dataclass(frozen=True, eq=False)
class FinishedBasis:
    """M-orthonormal, K-diagonal elastic shapes in the chosen frame, and where they came from."""

    Phi: Array  #: (n_dof, n_q)
    M: Array  #: Phi.T M Phi, (n_q, n_q): identity, zero rows for massless static shapes
    K: Array  #: Phi.T K Phi, (n_q, n_q), diagonal
    columns: SourceColumns  #: the columns of the mode set and their parts in the energy of each shape
    dropped: tuple[str, ...]  #: labels of redundant columns
    n_rigid: int  #: independent rigid-body motions the columns contained
    free_omega2: Array  #: squared elastic frequencies of the unsupported reduced body, ascending


def finish(body: FEBody, modes: ModeSet, condition: FrameCondition) -> FinishedBasis:
    """Orthonormalise a mode set in a body frame.

    (1) W-orthonormal columns Q of the set, W = K + omega_1² M; the redundant ones are dropped and named
    (2) Q' = Q - Psi_R C: rigid part taken off by the frame; Qᵀ K Q stays
    (3) the null space of Q'ᵀ W Q' is the rigid-body content: out
    (4) K z = omega² M z over what is left; Phi = Q' z

    Raises
    ------
    ModeSetError
        If nothing elastic is left, or the columns are too ill-conditioned.
    BodyError
        If a shape other than a rigid-body motion costs no energy: the body is a mechanism.
    """
    where = f"mode set {modes.name!r} of body {body.name!r}"
    V = modes.columns
    columns = Columns(V, SymmetricProduct(body.K) @ V, SymmetricProduct(body.M) @ V, np.eye(V.shape[1]))
    K_V = gram(V, columns.KX)
    omega2_1 = first_elastic(where, columns, condition)
    Q, redundant = independent_columns(columns, body, omega2_1)  # (1)
    del columns
    G_K = gram(Q.X, Q.KX)
    free_omega2 = free_elastic(Q, G_K, condition, omega2_1)

    C = condition.rigid_part(Q.X)  # (2)
    Q_frame = Q.X - condition.Psi_R @ C
    G_M = gram(Q_frame, Q.MX - condition.M_Psi_R @ C)

    Z, is_massive, n_rigid = elastic_eigenvectors(G_K, G_M, omega2_1)  # (3), (4)
    if Z.shape[1] == 0:
        raise ModeSetError(f"{where}: its {V.shape[1]} columns hold only rigid-body motion; add modes or interfaces")
    omega2 = np.einsum("kq,kl,lq->q", Z, G_K, Z)
    is_free = is_massive & (omega2 < ZERO_ENERGY * omega2_1)
    if is_free.any():
        moving = moving_nodes(body, np.arange(body.n_dof), Q_frame @ Z[:, is_free])
        raise BodyError(
            f"body {body.name!r}: {int(is_free.sum())} motions besides the rigid ones cost no energy: a "
            f"mechanism, largest at {moving}; join the parts or add what holds them"
        )
    defect = np.abs(Z.T @ G_M @ Z - np.diag(is_massive.astype(float))).max()
    if defect > ORTHONORMAL_DEFECT:
        raise ModeSetError(
            f"{where}: shapes are M-orthonormal to {defect:.1e} only, expected {ORTHONORMAL_DEFECT:.0e}; "
            "its columns are too ill-conditioned"
        )
    Phi = combine(Q_frame, Z)
    turn = orientation(Phi, omega2)
    Z, Phi = Z @ turn, combine(Phi, turn)
    A = Q.T @ Z
    return FinishedBasis(
        Phi=Phi,
        M=np.diag(is_massive.astype(float)),
        K=np.diag(omega2),
        columns=source_columns(modes.labels, modes.groups, A, K_V @ A),
        dropped=tuple(modes.labels[k] for k in redundant),
        n_rigid=n_rigid,
        free_omega2=free_omega2,
    )


def first_elastic(where: str, columns: Columns, condition: FrameCondition) -> float:
    """Estimate omega_1² of the free body: the least Rayleigh quotient of a column without its rigid part [1/s²].

    Each is an upper bound; the smallest is near enough to set the scale of a norm.
    """
    rigid = condition.Psi_R.T @ columns.MX
    mass = np.einsum("nk,nk->k", columns.X, columns.MX)
    elastic_mass = mass - np.einsum("rk,rk->k", rigid, np.linalg.solve(condition.Psi_R.T @ condition.M_Psi_R, rigid))
    stiffness = np.einsum("nk,nk->k", columns.X, columns.KX)
    is_elastic = elastic_mass > 1e-9 * mass
    if not is_elastic.any():
        raise ModeSetError(f"{where}: its columns hold only rigid-body motion; add modes or interfaces")
    return float((stiffness[is_elastic] / elastic_mass[is_elastic]).min())


def elastic_eigenvectors(G_K: Array, G_M: Array, omega2_1: float) -> tuple[Array, Array, int]:
    """Solve K z = omega² M z without its common null space (rigid-body motion).

    Returns
    -------
    Z
        Coefficients by ascending omega², M-normalised (W-normalised where there is no mass), (k, n_q).
    is_massive
        (n_q,) bool.
    n_rigid
        Dimension of the common null space.
    """
    energy, directions = la.eigh(G_K + omega2_1 * G_M)
    is_elastic = energy > RIGID_ENERGY * energy.max(initial=0.0)
    basis = directions[:, is_elastic] / np.sqrt(energy[is_elastic])
    # K + omega_1² M = 1 in this basis, so an eigenvalue mu of M gives omega² = (1 - omega_1² mu) / mu
    mu, Y = la.eigh(basis.T @ G_M @ basis)
    mu, Z = mu[::-1], (basis @ Y)[:, ::-1]
    is_massive = mu * omega2_1 > MASSLESS
    Z[:, is_massive] /= np.sqrt(mu[is_massive])
    # once more in nearly diagonal form: relative accuracy also for the stiff end of the spectrum
    massive = Z[:, is_massive]
    if massive.shape[1]:
        _, Y = la.eigh(massive.T @ G_K @ massive, massive.T @ G_M @ massive)
        Z[:, is_massive] = massive @ Y
    return Z, is_massive, int((~is_elastic).sum())


def free_elastic(Q: Columns, G_K: Array, condition: FrameCondition, omega2_1: float) -> Array:
    """Squared elastic frequencies of the unsupported reduced body, ascending [1/s²]: its pencil in mean axes.

    The mean-axis mass QᵀMQ - Yᵀ (Psi_RᵀMPsi_R)⁻¹ Y, Y = Psi_RᵀMQ, from Gram matrices alone.
    """
    Y = condition.M_Psi_R.T @ Q.X
    rigid_mass = condition.Psi_R.T @ condition.M_Psi_R
    scale = np.sqrt(np.diag(rigid_mass))
    if not scale.all() or np.linalg.cond(rigid_mass / np.outer(scale, scale)) > 1e12:
        return np.zeros(0)  # a body without inertia about some axis has no mean axes
    G_M = gram(Q.X, Q.MX) - Y.T @ np.linalg.solve(rigid_mass, Y)
    Z, is_massive, _ = elastic_eigenvectors(G_K, (G_M + G_M.T) / 2, omega2_1)
    return np.sort(np.einsum("kq,kl,lq->q", Z, G_K, Z)[is_massive])
