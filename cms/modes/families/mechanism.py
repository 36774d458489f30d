"""Motions without strain energy: which they are, how many, and where they are largest.

An energy uᵀ K u is a sum of terms K_kk u_k² and of others that are no larger. Rounding leaves about eps times their sum
instead of zero. A motion is free if its energy is below this rounding, however soft the body is compared with its
stiffest part.
"""

import numpy as np
import scipy.linalg as la

from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.tall.columns import combine, dots, of_this_process, squares
from fe_models.foundation.words import node_list

__all__ = ["free_motions", "mechanism_words", "moving_nodes", "rounding_of_energy", "without_energy"]

WITHIN_ROUNDING = 30.0  #: energy below which a motion is free, in units of its rounding; free motions have 0.01 to 1
SUSPECT = 1e-6  #: energy above which a direction is certainly not free, relative to the sum of K_kk u_k²


def rounding_of_energy(body: FEBody, u: Array) -> Array:
    """Size of the rounding in the strain energy of each column: eps times the sum of |K_kk| u_k², (k,)."""
    return np.finfo(float).eps * squares(np.abs(body.K.diagonal()), u)


def free_motions(body: FEBody, X: Array, C: Array, S: Array, terms: Array, load: Array | None = None) -> Array:
    """Return the motions in the span of X C without energy, (n_dof, n_free).

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
        Sum of the terms K_kk x_k² of each column of X, or a part of the sum that has its magnitude, (k,).
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
    """Return whether the strain energy of each motion is within its rounding, (k,) bool."""
    return np.asarray(dots(u, body.K @ u) < WITHIN_ROUNDING * rounding_of_energy(body, u))


def mechanism_words(body: FEBody, u: Array) -> str:
    """Describe the motions without energy besides the rigid ones: their number, and where they are largest."""
    several = u.shape[1] > 1
    return (
        f"body {body.name!r}: {u.shape[1]} motion{'s' if several else ''} besides the rigid ones "
        f"cost{'' if several else 's'} no energy: a mechanism (or a wire whose bending is lost in the rounding of its "
        f"tension), largest at {moving_nodes(body, np.arange(body.n_dof), u)}; join the parts or add what holds them"
    )


def moving_nodes(body: FEBody, rows: IntArray, Phi: Array) -> str:
    """Name the three nodes that move most in these motions over the given dofs, with their positions."""
    is_translation = (body.dofs[rows, 1] >= 0) & (body.dofs[rows, 1] < 3)
    chosen = is_translation if is_translation.any() else np.ones(len(rows), bool)
    size = np.bincount(body.dofs[rows[chosen], 0], (Phi[chosen] ** 2).sum(axis=1), minlength=len(body.nodes))
    order = np.argsort(-np.round(size / size.max(), 6), kind="stable")  # nodes with equal motion keep their order
    return node_list(order[: min(3, np.count_nonzero(size))].tolist(), body.nodes)
