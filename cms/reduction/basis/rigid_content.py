"""Rigid-body motion in the span of columns, found from the rigid-body vectors themselves (docs/theory.md §3).

No ratio of energies decides, so the slowest elastic shape may be arbitrarily slow compared to the stiffest shape.
"""

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array

__all__ = ["IN_SPAN", "elastic_directions", "orthonormal_motions"]

#: squared W-length of the remainder of a unit rigid-body motion, below which the span contains the motion
IN_SPAN = 1e-6
NO_INERTIA = 1e-12  #: eigenvalue of the scaled rigid mass matrix, below which a rigid-body motion has no inertia


def orthonormal_motions(rigid_mass: Array, omega2: float) -> Array:
    """Return S, (n_r, k), that makes rigid-body motions R S orthonormal in W = K + omega² M, where K R = 0.

    Motions without inertia have zero W-length, so k is smaller than n_r by their number.

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
