"""Equilibria at rest differentiated: the equations of balance, whose solution they are, once more.

[K  -Jᵀ] [dx]     [dr/dp]
[G   V ] [dw] = - [dg/dp]        direct: one right side a parameter; adjoint: the transposed, one an output
"""

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from floatframe.design.gradients.tangents import PointTangents
from floatframe.errors import ModelError

__all__ = ["equilibrium_adjoint", "equilibrium_columns", "equilibrium_matrix"]

SINGULAR = 1e-12  #: smallest singular value of the scaled matrix, below which the equilibrium is not unique


def equilibrium_matrix(at: PointTangents, name: str) -> Array:
    """Return the matrix, (n_u + n_w, n_u + n_w).

    Raises
    ------
    ModelError
        If something moves at no cost, so that the equilibrium is one of many.
    """
    matrix = np.block([[at.K, -at.J.T], [at.G_x, at.V]])
    scaled = matrix.copy()
    for _ in range(5):  # rows and columns of one size, so that units do not decide
        scaled /= np.sqrt(np.maximum(np.abs(scaled).max(axis=1, keepdims=True), np.finfo(float).tiny))
        scaled /= np.sqrt(np.maximum(np.abs(scaled).max(axis=0, keepdims=True), np.finfo(float).tiny))
    values = la.svdvals(scaled)
    if values[-1] <= SINGULAR * values[0]:
        raise ModelError(
            f"sensitivities: system {name!r}: its equilibrium is one of many (something can move at no cost), and has "
            "no derivative; hold it by a spring or a joint"
        )
    return np.asarray(matrix)


def equilibrium_columns(matrix: Array, by_p: Array) -> Array:
    """Return d(x, w)/dp, (n_u + n_w, n_p)."""
    return np.asarray(la.solve(matrix, -by_p))


def equilibrium_adjoint(matrix: Array, slopes: Array, by_p: Array) -> Array:
    """Return the gradient of outputs with derivatives `slopes` by (x, w), (n_out, n_u + n_w): (n_out, n_p)."""
    return np.asarray(-la.solve(matrix.T, slopes.T).T @ by_p)
