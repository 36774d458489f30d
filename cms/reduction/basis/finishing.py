"""The finishing step of every mode set: rank, body frame, M-orthonormal shapes (docs/theory.md §3)."""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.body.source_columns import SourceColumns, source_columns
from cms.errors import BodyError, ModeSetError
from cms.linear_algebra.elastic_pencil import elastic_eigenvectors, turn_to_diagonal
from cms.linear_algebra.independent import (
    Basis,
    Products,
    gram_in_blocks,
    independent_basis,
    orthonormal_basis,
    within,
)
from cms.linear_algebra.solvers.eigen import orientation, turn_in_place
from cms.modes.families.rigid_modes import mechanism_words, rounding_of_energy, without_energy
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.frames import FrameCondition
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import combine, combined, copied, dots, in_memory, inner, subtract

__all__ = ["IN_SPAN", "FinishedBasis", "elastic_directions", "finish", "orthonormal_motions"]


#: ratio of a shape's energy from a Gram matrix to its rounding error, below which it is computed from the shape
SUSPECT_ENERGY = 1e3
#: rounding error in PhiᵀMPhi, below which shapes are formed directly from the columns of the set
TRUSTED_ROUNDING = 1e-11
ORTHONORMAL_DEFECT = 1e-9  #: largest accepted entry of Phi.T M Phi - 1, unless rounding of M is larger
LOST_MASS = 1e-6  #: largest accepted rounding error of a modal mass due to M, relative to the modal mass
LOST_STIFFNESS = 1e-2  #: largest accepted relative rounding error of a modal stiffness; half as much in frequency
MARGIN = 10.0  #: factor from the rounding errors of modal masses to those of their products


@dataclass(frozen=True, eq=False)
class FinishedBasis:
    """M-orthonormal, K-diagonal elastic shapes in the chosen frame, and their origin."""

    Phi: Array  #: shapes, (n_dof, n_q); `SpreadColumns` if the columns of the mode set are distributed
    M: Array  #: Phi.T M Phi, (n_q, n_q): identity, zero rows for massless static shapes
    K: Array  #: Phi.T K Phi, (n_q, n_q), diagonal
    columns: SourceColumns  #: columns of the mode set, and their shares in the energy of each shape
    dropped: tuple[str, ...]  #: labels of redundant columns
    n_rigid: int  #: number of independent rigid-body motions in the span of the columns
    free_omega2: Array  #: squared elastic frequencies of the unsupported reduced body, ascending
    A: Array | None = None  #: shapes as combinations of the columns of the mode set, (n_columns, n_q); None if unknown


def finish(body: FEBody, modes: ModeSet, condition: FrameCondition) -> FinishedBasis:
    """Orthonormalise a mode set in a body frame.

    (1) make W-orthonormal columns Q of the set, W = K + omega_1² M; drop and name redundant columns
    (2) Q' = Q - Psi_R C removes the rigid part according to the frame; Qᵀ K Q does not change
    (3) remove the rigid-body motions that lie in the span of Q (`elastic_directions`)
    (4) solve K z = omega² M z in the remaining space; Phi = Q' z

    Raises
    ------
    ModeSetError
        If no elastic shape is left, or the columns are too ill-conditioned.
    BodyError
        If a shape other than a rigid-body motion has no strain energy, so that the body is a mechanism.
    """
    where = f"mode set {modes.name!r} of body {body.name!r}"
    V, products = modes.columns, Products.of_body(body)
    V_K, V_M = gram_in_blocks(V, products.K), gram_in_blocks(V, products.M)
    omega2_1 = first_elastic(where, body, V, V_K, V_M, condition)
    Q, redundant = independent_basis(V, V_K, V_M, products, body, omega2_1)  # (1)
    try:
        found = elastic_pencil(where, body, Q, products, condition, omega2_1)
    except ModeSetError:
        if Q.is_formed:
            raise
        found = None
    if found is None or (not Q.is_formed and found.rounding > TRUSTED_ROUNDING):
        Q = orthonormal_basis(Q.combine(np.eye(Q.Z.shape[1])), Q.T, products, omega2_1)
        found = elastic_pencil(where, body, Q, products, condition, omega2_1)
    X, Z, is_massive, omega2 = found.X, found.Z, found.is_massive, dots(found.Z, Q.G_K @ found.Z)
    defect, Phi = found.defect, combined(X, Q.Z @ Z)
    if max(defect, found.rounding) > ORTHONORMAL_DEFECT:
        again, defect = normalised_again(Phi, is_massive, products)
        Z, Phi = Z @ again, combined(Phi, again)
        G_K, own = gram_in_blocks(Phi, products.K), np.ix_(is_massive, is_massive)
        turn = np.eye(len(again))
        turn[own] = turn_to_diagonal(G_K[own])  # correcting the mass couples stiff modes
        Z, Phi, omega2 = Z @ turn, combined(Phi, turn), dots(turn, G_K @ turn)
    rounding = rounding_of_energy(body, Phi)
    is_suspect = is_massive & (omega2 < SUSPECT_ENERGY * rounding)
    suspect = in_memory(Phi[:, is_suspect])
    free = suspect[:, without_energy(body, suspect)]
    if free.shape[1]:
        raise BodyError(mechanism_words(body, free))
    of_mass = np.finfo(float).eps * dots(Phi, Phi, np.abs(body.M.diagonal()))[is_massive].max(initial=0.0)
    of_stiffness = (rounding / np.maximum(omega2, np.finfo(float).tiny))[is_massive].max(initial=0.0)
    for lost, most, words in ((of_mass, LOST_MASS, "mass"), (of_stiffness, LOST_STIFFNESS, "stiffness")):
        if lost > most:
            raise BodyError(
                f"{where}: the {words} of a shape has a relative rounding error of {lost:.1e}, expected {most:.0e}: "
                "the matrix has much larger terms, as for torsion and bending of a thin wire across the mesh axes; "
                "rotate the mesh so that the wire lies along an axis, or make it thicker"
            )
    if defect > max(ORTHONORMAL_DEFECT, MARGIN * of_mass):
        raise ModeSetError(
            f"{where}: shapes are M-orthonormal only to {defect:.1e}, expected {ORTHONORMAL_DEFECT:.0e}; "
            "its columns are too ill-conditioned"
        )
    turn = orientation(Phi, omega2)
    turn_in_place(Phi, turn)
    A = Q.T @ (Z @ turn)
    if Q.is_formed:  # the terms of VᵀKV A cancel where columns are nearly dependent
        forces = np.hstack([inner(V, products.K @ Phi[:, k : k + 16]) for k in range(0, A.shape[1], 16)])
    else:
        forces = np.asarray(V_K @ A)
    return FinishedBasis(
        Phi=Phi,
        M=np.diag(is_massive.astype(float)),
        K=np.diag(omega2),
        columns=source_columns(modes.labels, modes.groups, A, forces),
        dropped=tuple(modes.labels[k] for k in redundant),
        n_rigid=found.elastic.shape[0] - found.elastic.shape[1],
        free_omega2=found.free_omega2,
        A=A,
    )


def normalised_again(Phi: Array, is_massive: np.ndarray, products: Products) -> tuple[Array, float]:
    """Return the small matrix that makes the computed shapes M-orthonormal, and the remaining defect.

    For a shape of light nodes, the modal mass from the Gram matrix of the columns is a small difference of large terms;
    computed from the shape itself, it is a sum of small terms. Shapes are orthonormalised by ascending frequency
    (Gram-Schmidt), so each is corrected only by slower shapes, whose stiffness is small compared to its own.
    """
    T = np.eye(len(is_massive))
    for _ in range(2):
        G_M = gram_in_blocks(combine(Phi, T), products.M)
        size = np.sqrt(np.where(is_massive, np.diag(G_M), 1.0))
        own = np.ix_(is_massive, is_massive)
        U = la.cholesky((G_M / np.outer(size, size))[own])
        step = np.diag(1 / size)
        step[own] = step[own] @ la.solve_triangular(U, np.eye(len(U)))
        T = T @ step
    G_M = gram_in_blocks(combine(Phi, T), products.M)
    own = np.ix_(is_massive, is_massive)
    return T, float(np.abs(G_M[own] - np.eye(int(is_massive.sum()))).max(initial=0.0))


@dataclass(frozen=True, eq=False)
class ElasticPencil:
    """Elastic shapes relative to the frame, as small matrices: steps (2) to (4) of `finish`."""

    #: columns of the basis Q without their rigid part, (n_dof, l); the shapes are X Q.Z Z
    X: Array
    Z: Array  #: shapes as combinations of the basis, (k, n_q)
    elastic: Array  #: directions of the basis without rigid-body motions, (k, n_q)
    is_massive: np.ndarray  #: whether each shape has mass, (n_q,) bool
    free_omega2: Array  #: squared elastic frequencies of the unsupported reduced body, ascending [1/s²]
    defect: float  #: largest entry of Zᵀ G_M Z - 1
    rounding: float  #: estimated rounding error of PhiᵀMPhi - 1 due to rounding of G_M


def elastic_pencil(
    where: str, body: FEBody, Q: Basis, products: Products, condition: FrameCondition, omega2_1: float
) -> ElasticPencil:
    """Return the elastic shapes in the span of a W-orthonormal basis.

    Raises
    ------
    ModeSetError
        If no elastic shape is left, or the columns are too ill-conditioned.
    """
    elastic = elastic_part(body, Q, condition, omega2_1)  # (3)
    if elastic.shape[1] == 0:
        raise ModeSetError(f"{where}: its columns hold only rigid-body motion; add modes or interfaces")
    try:
        free_omega2 = free_elastic(Q, elastic, condition, omega2_1)
    except np.linalg.LinAlgError as error:
        raise ModeSetError(f"{where}: its columns are too ill-conditioned: {error}") from error
    X = Q.X if Q.is_formed else copied(Q.X)  # (2)
    subtract(X, condition.Psi_R, condition.rigid_part(Q.X))
    X_M = gram_in_blocks(X, products.M)
    G_M = within(X_M, Q.Z)
    try:
        Y, is_massive = elastic_eigenvectors(within(Q.G_K, elastic), within(G_M, elastic), omega2_1)  # (4)
    except np.linalg.LinAlgError as error:
        raise ModeSetError(f"{where}: its columns are too ill-conditioned in this frame: {error}") from error
    Z = elastic @ Y
    defect = np.abs(Z.T @ G_M @ Z - np.diag(is_massive.astype(float))).max()
    lengths = np.sqrt(np.maximum(np.diag(X_M), 0.0)) @ np.abs(Q.Z @ Z)
    return ElasticPencil(
        X, Z, elastic, is_massive, free_omega2, defect, float(np.finfo(float).eps * (lengths**2).max())
    )


def first_elastic(where: str, body: FEBody, V: Array, G_K: Array, G_M: Array, condition: FrameCondition) -> float:
    """Estimate omega_1² of the free body: the smallest Rayleigh quotient of a column without its rigid part [1/s²].

    Each quotient is an upper bound. The smallest is accurate enough to scale a norm. Columns whose energy is rounding,
    such as those of parts without a connection, are left out. The result is rounded to a power of two, so that the norm
    is the same in every frame: otherwise rounding would decide which of two nearly dependent columns is redundant.
    """
    rigid = inner(condition.M_Psi_R, V)
    stiffness, mass = np.diag(G_K), np.diag(G_M)
    elastic_mass = mass - np.einsum("rk,rk->k", rigid, np.linalg.solve(condition.Psi_R.T @ condition.M_Psi_R, rigid))
    is_elastic = elastic_mass > 1e-9 * mass
    if not is_elastic.any():
        raise ModeSetError(f"{where}: its columns hold only rigid-body motion; add modes or interfaces")
    rounding = rounding_of_energy(body, V)
    is_certain = is_elastic & (stiffness > SUSPECT_ENERGY * rounding)
    if not is_certain.any():
        is_certain, stiffness = is_elastic, np.maximum(stiffness, rounding)
    smallest = (stiffness[is_certain] / elastic_mass[is_certain]).min()
    return float(np.exp2(np.round(np.log2(smallest))))


def elastic_part(body: FEBody, Q: Basis, condition: FrameCondition, omega2_1: float) -> Array:
    """Return the directions of W-orthonormal columns without rigid-body motion, (k, k - n_rigid)."""
    S = orthonormal_motions(condition.Psi_R.T @ condition.M_Psi_R, omega2_1)
    C = omega2_1 * Q.inner(condition.M_Psi_R @ S)
    E = condition.Psi_R @ S - in_memory(Q.combine(C))
    return elastic_directions(C, E.T @ (body.K @ E) + omega2_1 * (E.T @ (body.M @ E)))


def free_elastic(Q: Basis, elastic: Array, condition: FrameCondition, omega2_1: float) -> Array:
    """Return squared elastic frequencies of the unsupported reduced body, ascending [1/s²], from its mean-axis pencil.

    The mean-axis mass QᵀMQ - Yᵀ (Psi_RᵀMPsi_R)⁻¹ Y with Y = Psi_RᵀMQ follows from Gram matrices alone.
    """
    Y = Q.inner(condition.M_Psi_R).T
    rigid_mass = condition.Psi_R.T @ condition.M_Psi_R
    scale = np.sqrt(np.diag(rigid_mass))
    if len(scale) and (not scale.all() or np.linalg.cond(rigid_mass / np.outer(scale, scale)) > 1e12):
        return np.zeros(0)  # without inertia about some axis, a body has no mean axes
    G_M = Q.G_M - Y.T @ np.linalg.solve(rigid_mass, Y)
    A_K = within(Q.G_K, elastic)
    Z, is_massive = elastic_eigenvectors(A_K, within(G_M, elastic), omega2_1)
    return np.sort(dots(Z, A_K @ Z)[is_massive])


# rigid-body motion in the span of columns, found from the rigid-body vectors themselves (docs/theory.md §3) -----------
# Ratios of energies play no role, so the slowest elastic shape may be arbitrarily slow compared to the stiffest shape.


#: squared W-length of the remainder of a unit rigid-body motion, below which the span contains the motion
IN_SPAN = 1e-6
NO_INERTIA = 1e-12  #: eigenvalue of the scaled rigid mass matrix below which a rigid-body motion has no inertia


def orthonormal_motions(rigid_mass: Array, omega2: float) -> Array:
    """Return S, (n_r, k), that makes rigid-body motions R S orthonormal in W = K + omega² M, where K R = 0.

    Motions without inertia have zero W-length and are omitted, so k may be smaller than n_r.

    Parameters
    ----------
    rigid_mass
        Rᵀ M R, (n_r, n_r).
    omega2
        omega_1² in W [1/s²].
    """
    if not rigid_mass.size:
        return np.zeros((0, 0))
    size = np.sqrt(np.maximum(np.diag(rigid_mass), 0.0))
    has_size = size > 0
    unit = np.where(has_size, 1 / np.where(has_size, size, 1.0), 0.0)
    values, vectors = la.eigh(rigid_mass * np.outer(unit, unit))
    kept = values > NO_INERTIA
    return np.asarray(unit[:, None] * vectors[:, kept] / np.sqrt(values[kept] * omega2))


def elastic_directions(C: Array, rest: Array) -> Array:
    """Return an orthonormal basis of a span without the rigid-body motions that it contains, (k, k - n_held).

    (1) a motion R v of unit length is contained if its remainder outside the span is small: |rest v|_W² < `IN_SPAN`
    (2) the result is the orthogonal complement of the contained motions, C v

    Parameters
    ----------
    C
        Coefficients Qᵀ W R of W-orthonormal rigid-body motions R in a W-orthonormal basis Q of the span, (k, n_r).
    rest
        Gram matrix of the remainders, Eᵀ W E with E = R - Q C, computed from E itself, (n_r, n_r).
    """
    k = C.shape[0]
    if not C.size:
        return np.eye(k)
    values, vectors = la.eigh((rest + rest.T) / 2)
    held = C @ vectors[:, values < IN_SPAN]  # (1)
    if not held.shape[1]:
        return np.eye(k)
    return np.asarray(la.qr(held)[0][:, held.shape[1] :])  # (2)
