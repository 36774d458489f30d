"""Exact elimination of driven interfaces: static motions that follow the bases, and modes with fixed bases.

    M x_ddot + C x_dot + K x = f + Gᵀ lam,   G x = R s

(1) N: a basis of the motions that hold the bases, G N = 0
(2) x = T s + N y with G T = R and NᵀK T = 0: T carries the structure statically
(3) modes of (NᵀK N, NᵀM N), of unit mass: V = N Z, without mass: V_0, of unit stiffness
(4) eta_ddot + C_m eta_dot + omega² eta = -VᵀM T s_ddot - VᵀC T s_dot + Vᵀf
(5) what the bases exert: Tᵀ(M x_ddot + C x_dot + K x - f), force and moment about their points
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.linear_algebra.elastic_pencil import elastic_eigenvectors
from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError

__all__ = ["Held", "held_by_bases"]

RANK = 1e-9  #: singular value of the scaled rows, relative to the largest, that counts as zero
FOLLOWS = 1e-8  #: largest relative error with which the structure follows the bases
FREE = 1e-12  #: energy of a motion with fixed bases, relative to the largest, below which the motion is free


@dataclass(frozen=True, eq=False)
class Held:
    """Motions of a structure on bases."""

    T: Array  #: static motions that follow the bases, (n_x, n_s)
    V: Array  #: modes with the bases held, of unit mass, (n_x, n_m)
    omega: Array  #: angular frequencies of the modes, ascending, (n_m,)
    V_0: Array  #: shapes without mass, of unit stiffness, (n_x, n_0)


def held_by_bases(where: str, M: Array, K: Array, G: Array, R: Array, scale: Array, rigid: Array | None = None) -> Held:
    """Return the motions of a structure whose rows G x follow the motions s of bases, G x = R s.

    Parameters
    ----------
    where
        What it is, for messages.
    M, K
        (n_x, n_x), symmetric.
    G, R
        (n_g, n_x), (n_g, n_s).
    scale
        Size of x that is one and the same motion of the structure, (n_x,): it tells small entries of G from rounding.
    rigid
        T where it is known, (n_x, n_s): one base carries everything rigidly.

    Raises
    ------
    ModelError
        If the structure cannot follow the bases, or they do not hold it.
    """
    S = scale
    size = np.linalg.norm(G * S, axis=1)
    rows = 1 / np.where(size > 0, size, 1.0)
    _, values, right = la.svd(rows[:, None] * G * S)
    rank = int((values > RANK * values[0]).sum()) if len(values) and values[0] > 0 else 0
    N = S[:, None] * right[rank:].T  # (1)
    K_N, M_N = symmetric(N.T @ K @ N), symmetric(N.T @ M @ N)
    require_held(where, K_N, N)
    if rigid is None:
        T_0 = S[:, None] * la.lstsq(rows[:, None] * G * S, rows[:, None] * R, cond=RANK)[0]
        require_followed(where, G @ T_0, R)
        T = T_0 - N @ la.solve(K_N, N.T @ (K @ T_0), assume_a="pos") if N.shape[1] else T_0  # (2)
    else:
        T = rigid
    if not N.shape[1]:
        return Held(T, N, np.zeros(0), N)
    try:
        Z, is_massive = elastic_eigenvectors(K_N, M_N, scale_of(K_N, M_N))  # (3)
    except np.linalg.LinAlgError as error:
        raise ModelError(f"{where}: no modes with its bases held: {error}") from error
    omega2 = np.einsum("kq,kl,lq->q", Z, K_N, Z)
    order = np.lexsort((omega2, np.logical_not(is_massive)))
    Z, omega2, is_massive = Z[:, order], omega2[order], is_massive[order]
    V, static = N @ Z, np.logical_not(is_massive)
    return Held(T, V[:, is_massive], np.sqrt(omega2[is_massive]), V[:, static] / np.sqrt(omega2[static]))


def require_held(where: str, K_N: Array, N: Array) -> None:
    """Raise `ModelError` if a motion with fixed bases has no energy."""
    if not len(K_N):
        return
    size = np.sqrt(np.maximum(np.diag(K_N), np.finfo(float).tiny))
    energy = la.eigvalsh(K_N / np.outer(size, size))
    free = int((energy <= FREE * max(energy[-1], np.finfo(float).tiny)).sum())
    if free:
        raise ModelError(
            f"{where}: its bases do not hold it: {free} motion{'s' if free > 1 else ''} without energy "
            f"remain{'' if free > 1 else 's'} "
            "while they stand still; give a base an interface with rotations, or one more interface"
        )


def require_followed(where: str, followed: Array, wanted: Array) -> None:
    """Raise `ModelError` if static motions do not follow the bases."""
    defect = float(np.abs(followed - wanted).max() / np.abs(wanted).max())
    if defect > FOLLOWS:
        raise ModelError(
            f"{where}: its modes cannot follow motions of the bases against each other (by {defect:.1e} of them): it "
            "lacks static modes of the held interfaces. Reduce the body with a set that has one for each of their dofs "
            "(craig-bampton, guyan, rubin), or hold all of them with one base"
        )


def scale_of(K: Array, M: Array) -> float:
    """Return the smallest positive K_kk / M_kk; 1 if there is none."""
    k, m = np.diag(K), np.diag(M)
    both = (k > 0) & (m > 0)
    return float((k[both] / m[both]).min()) if both.any() else 1.0


def symmetric(matrix: Array) -> Array:
    """Return the symmetric part of a matrix that is symmetric except for rounding errors."""
    return np.asarray((matrix + matrix.T) / 2)
