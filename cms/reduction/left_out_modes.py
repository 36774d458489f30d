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
from cms.linear_algebra.independent import DisplacementColumns, Products
from cms.modes.families.families import Families
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.recovery.load_columns import SPIN, loads_of_model
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import dots, gram, inner, subtract

__all__ = ["left_out_modes", "orthonormal"]

INDEPENDENT = 1e-10  #: smallest eigenvalue of the scaled Gram matrix of independent columns
EXACT = 1e-7  #: part of a static response outside V, or outside V and X, in the norm of strain energy: rounding below


def left_out_modes(
    families: Families, basis: FreeBasis, X: DisplacementColumns, Phi: Array, frame: BodyFrame
) -> LeftOutModes | None:
    """Return the left-out shapes of a reduced body; None for a held body, or if nothing is left out.

    Parameters
    ----------
    families
        Families of the body, open: their factorisation serves the loads of (1).
    basis
        The free modes in the span of the mode set.
    X
        Columns beside the set, K-orthogonal to it.
    Phi
        Modes of the reduced body, (n_dof, n_q).
    frame
        Frame of the reduced body.
    """
    body = families.body
    if body.is_held:
        return None
    loads, F = loads_of_model(body, frame)
    is_case = np.array([name.startswith("load case ") for name in loads.names], dtype=bool)
    is_spin = np.array([name in SPIN for name in loads.names], dtype=bool)
    T_X = orthonormal(X)
    U = residual(families, basis, X, T_X, F[:, is_spin | is_case])  # (1)
    T_U = orthonormal(U)
    T = la.block_diag(T_X, T_U)  # (2)
    if not T.shape[1]:
        return None

    def over(columns: Array, field: str) -> Array:
        """Return the products of columns with W or M W, (k, n_left)."""
        return np.asarray(np.hstack([inner(columns, getattr(block, field)) for block in (X, U)]) @ T)

    beside = over(basis.Phi, "MX") / np.sqrt(basis.omega2)[:, None]
    own = np.where(basis.is_massive, 1 / basis.omega2, 0.0)
    across = inner(X.X, U.MX)
    of_W = T.T @ np.block([[gram(X.X, X.MX), across], [across.T, gram(U.X, U.MX)]]) @ T
    mass, Y = la.eigh(np.block([[np.diag(own), beside], [beside.T, of_W]]))  # (3)
    mass, Y = np.maximum(mass[::-1], 0.0), Y[:, ::-1]
    y, n_left = over(F, "X"), T.shape[1]  # (4)
    energy = (inner(F, basis.Phi) ** 2 / basis.omega2).sum(axis=1)
    y[(y**2).sum(axis=1) <= EXACT**2 * energy] = 0.0
    spin = y[is_spin] if is_spin.any() else np.zeros((6, n_left))
    interfaces = y[loads.is_interface].reshape(-1, 6, n_left).transpose(1, 0, 2)
    return LeftOutModes(mass, Y[len(own) :], -over(Phi, "MX"), interfaces, spin, y[is_case])


def residual(families: Families, basis: FreeBasis, X: DisplacementColumns, T: Array, F: Array) -> DisplacementColumns:
    """Return the static responses to load columns without their parts in the modes and in the columns X T."""
    U, products = families.flexibility(F), Products.of_body(families.body)
    before = dots(U, products.K @ U)
    for _ in range(2):  # the second pass removes rounding
        subtract(U, basis.Phi, inner(basis.Phi, products.K @ U) / basis.omega2[:, None])
        subtract(U, X.X, T @ (T.T @ inner(X.KX, U)))
    found = products.beside(U)
    return found[np.flatnonzero(dots(U, found.KX) > EXACT**2 * before)]


def orthonormal(X: DisplacementColumns) -> Array:
    """Return T for which the columns X T have unit strain energy and are K-orthogonal; dependent ones are left out."""
    size = 1 / np.sqrt(np.maximum(dots(X.X, X.KX), np.finfo(float).tiny))
    energies, T = la.eigh(gram(X.X, X.KX) * np.outer(size, size))
    is_independent = energies > INDEPENDENT
    return np.asarray(size[:, None] * T[:, is_independent] / np.sqrt(energies[is_independent]))
