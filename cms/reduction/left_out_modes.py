"""Left-out shapes of a reduced body: directions beside its modes, and the forces on them in a motion.

Let V be the free modes in the span of a mode set, scaled to unit strain energy, and X the columns beside them in the
enlarged space of `error_estimates`, Vᵀ K X = 0: corrections of the modes, residual responses to loads at the
interfaces, to spin and to load cases, guard modes or random columns.

(1) Left-out shapes W = X T, Wᵀ K W = 1.
(2) The eigenvectors of [V W]ᵀ M [V W] are the vibration shapes; their rows of W are Y.
(3) Let q(t) be the modal coordinates of a motion without W. Its residual is the force y = Wᵀ f - Wᵀ M Phi q'' on W,
    with the loads f of interfaces, spin and load cases, and zero on the modes. Rigid motions have no mass in common
    with W, so that gravity and accelerations of the frame cause no force.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.body.left_out_modes import LeftOutModes
from cms.body.reduced_body import BodyFrame
from cms.linear_algebra.independent import DisplacementColumns
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.recovery.load_columns import SPIN, LoadColumns, loads_of_model
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import dots, gram, inner

__all__ = ["MotionLoads", "left_out_modes", "orthonormal"]

INDEPENDENT = 1e-10  #: smallest eigenvalue of the scaled Gram matrix of independent columns
EXACT = 1e-7  #: part of a static response outside V in the norm of strain energy, below which it is rounding


@dataclass(frozen=True, eq=False)
class MotionLoads:
    """Unit loads of a motion: gravity, spin, wrenches at interfaces, load cases."""

    columns: LoadColumns
    F: Array  #: (n_dof, n_loads)

    @classmethod
    def of_model(cls, body: FEBody, frame: BodyFrame) -> "MotionLoads":
        """Return the loads of a body in axes of its frame."""
        return cls(*loads_of_model(body, frame))

    @property
    def is_case(self) -> np.ndarray:
        """Whether each load is a load case, (n_loads,) bool."""
        return np.array([name.startswith("load case ") for name in self.columns.names], dtype=bool)

    @property
    def is_spin(self) -> np.ndarray:
        """Whether each load is that of a spin, (n_loads,) bool."""
        return np.array([name in SPIN for name in self.columns.names], dtype=bool)

    @property
    def beside_interfaces(self) -> Array:
        """The loads of spin and the load cases, (n_dof, k)."""
        return self.F[:, self.is_spin | self.is_case]


def left_out_modes(basis: FreeBasis, X: DisplacementColumns, Phi: Array, loads: MotionLoads) -> LeftOutModes | None:
    """Return the left-out shapes of a reduced body; None if nothing is left out.

    Parameters
    ----------
    basis
        The free modes in the span of the mode set.
    X
        Columns beside the set, K-orthogonal to it.
    Phi
        Modes of the reduced body, (n_dof, n_q).
    loads
        Loads in the frame of the reduced body.
    """
    T = orthonormal(X)  # (1)
    if not T.shape[1]:
        return None
    beside = (inner(basis.Phi, X.MX) / np.sqrt(basis.omega2)[:, None]) @ T
    own = np.where(basis.is_massive, 1 / basis.omega2, 0.0)
    mass, Y = la.eigh(np.block([[np.diag(own), beside], [beside.T, T.T @ gram(X.X, X.MX) @ T]]))  # (2)
    mass, Y = np.maximum(mass[::-1], 0.0), Y[:, ::-1]
    F, n_left = loads.F, T.shape[1]
    y = inner(F, X.X) @ T  # (3)
    energy = (inner(F, basis.Phi) ** 2 / basis.omega2).sum(axis=1)
    y[(y**2).sum(axis=1) <= EXACT**2 * energy] = 0.0
    spin = y[loads.is_spin] if loads.is_spin.any() else np.zeros((6, n_left))
    interfaces = y[loads.columns.is_interface].reshape(-1, 6, n_left).transpose(1, 0, 2)
    return LeftOutModes(mass, Y[len(own) :], -inner(Phi, X.MX) @ T, interfaces, spin, y[loads.is_case])


def orthonormal(X: DisplacementColumns) -> Array:
    """Return T for which the columns X T have unit strain energy and are K-orthogonal; dependent ones are left out."""
    size = 1 / np.sqrt(np.maximum(dots(X.X, X.KX), np.finfo(float).tiny))
    energies, T = la.eigh(gram(X.X, X.KX) * np.outer(size, size))
    is_independent = energies > INDEPENDENT
    return np.asarray(size[:, None] * T[:, is_independent] / np.sqrt(energies[is_independent]))
