"""Left-out shapes of a reduced body: directions beside its modes, and the forces on them in a motion.

Let V be the free modes in the span of a mode set, scaled to unit strain energy, and X the columns beside them in the
enlarged space of `error_estimates`, Vᵀ K X = 0: corrections of the modes, residual responses to loads at the
interfaces, random columns.

(1) The static responses to spin and load cases join X, without their parts in V and X.
(2) Left-out shapes W = X T, Wᵀ K W = 1.
(3) The eigenvectors of [V W]ᵀ M [V W] are the vibration shapes; their rows of W are Y.
(4) Let q(t) be the modal coordinates of a motion without W. Its residual is the force y = Wᵀ f - Wᵀ M Phi q'' on W,
    with the loads f of interfaces, spin and load cases, and zero on the modes. Rigid motions have no mass in common
    with W, so that gravity and accelerations of the frame cause no force.
"""

import numpy as np
import scipy.linalg as la

from cms.body.left_out_modes import LeftOutModes
from cms.body.reduced_body import BodyFrame
from cms.linear_algebra.independent import Products
from cms.modes.families.families import Families
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.recovery.load_columns import SPIN, loads_of_model
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import dots, gram, inner, subtract

__all__ = ["left_out_modes"]

INDEPENDENT = 1e-10  #: smallest eigenvalue of the scaled Gram matrix of independent columns
EXACT = 1e-7  #: part of a static response outside V, or outside V and X, in the norm of strain energy: rounding below


def left_out_modes(families: Families, basis: FreeBasis, X: Array, Phi: Array, frame: BodyFrame) -> LeftOutModes | None:
    """Return the left-out shapes of a reduced body; None for a held body, or if nothing is left out.

    Parameters
    ----------
    families
        Families of the body, open: their factorisation serves the loads of (1).
    basis
        The free modes in the span of the mode set.
    X
        Columns beside the set, K-orthogonal to it, (n_dof, n_X).
    Phi
        Modes of the reduced body, (n_dof, n_q).
    frame
        Frame of the reduced body.
    """
    body = families.body
    if body.is_held:
        return None
    products = Products.of_body(body)
    loads, F = loads_of_model(body, frame)
    is_case = np.array([name.startswith("load case ") for name in loads.names], dtype=bool)
    is_spin = np.array([name in SPIN for name in loads.names], dtype=bool)
    W, K_W = orthonormal(X, products)
    U = residual(families, basis, W, K_W, F[:, is_spin | is_case], products)  # (1)
    more, _ = orthonormal(U, products)
    W = np.hstack([W, more])  # (2)
    if not W.shape[1]:
        return None
    M_W = products.M @ W
    beside = inner(basis.Phi, M_W) / np.sqrt(basis.omega2)[:, None]
    own = np.where(basis.is_massive, 1 / basis.omega2, 0.0)
    mass, Y = la.eigh(np.block([[np.diag(own), beside], [beside.T, gram(W, M_W)]]))  # (3)
    mass, Y = np.maximum(mass[::-1], 0.0), Y[:, ::-1]
    y, n_left = inner(F, W), W.shape[1]  # (4)
    energy = (inner(F, basis.Phi) ** 2 / basis.omega2).sum(axis=1)
    y[(y**2).sum(axis=1) <= EXACT**2 * energy] = 0.0
    spin = y[is_spin] if is_spin.any() else np.zeros((6, n_left))
    interfaces = y[loads.is_interface].reshape(-1, 6, n_left).transpose(1, 0, 2)
    return LeftOutModes(mass, Y[len(own) :], -inner(Phi, M_W), interfaces, spin, y[is_case])


def residual(families: Families, basis: FreeBasis, W: Array, K_W: Array, F: Array, products: Products) -> Array:
    """Return the static responses to load columns without their parts in the modes and in W, (n_dof, k)."""
    U = families.flexibility(F)
    before = dots(U, products.K @ U)
    for _ in range(2):  # the second pass removes rounding
        subtract(U, basis.Phi, inner(basis.Phi, products.K @ U) / basis.omega2[:, None])
        subtract(U, W, inner(K_W, U))
    return U[:, dots(U, products.K @ U) > EXACT**2 * before]


def orthonormal(X: Array, products: Products) -> tuple[Array, Array]:
    """Return K-orthonormal columns W in the span of X, without dependent ones, and K W, (n_dof, n_W) each."""
    K_X = products.K @ X
    size = 1 / np.sqrt(np.maximum(dots(X, K_X), np.finfo(float).tiny))
    energies, T = la.eigh(gram(X, K_X) * np.outer(size, size))
    is_independent = energies > INDEPENDENT
    T = size[:, None] * T[:, is_independent] / np.sqrt(energies[is_independent])
    return X @ T, K_X @ T
