"""Forces of a stiffness matrix in rigid-body motion, which are zero for a free body."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["FREE", "MOTIONS", "RigidForces", "rigid_forces"]

#: force of a rigid-body motion relative to |K| |Psi_R| (of the stiffest entry or of its own row) that counts as
#: rounding
FREE = 1e-6
#: share of a row, absolute and relative to the median share, at which a soft spring is detected
STANDS_OUT, MANY_TIMES = 1e-9, 1e4
#: share of the stiffest entry, and of the stiffest support, below which a force does not count as a support
ROUNDING, WEAKEST = 1e-11, 1e-8
MOTIONS = ("x", "y", "z", "a turn about x", "a turn about y", "a turn about z")


@dataclass(frozen=True, eq=False)
class RigidForces:
    """Forces K Psi_R of rigid-body motions about the mean of the nodes; rotations are scaled to the body size."""

    F: Array  #: forces K Psi_R, (n_dof, 6) [N/m]; zero for motions that the dofs cannot represent
    #: share of every row: |F| divided by the sum of |K_kl| s_l, where s is the size of the motion of a dof, (n_dof, 6)
    share: Array
    largest: Array  #: largest force over the stiffest entry, for each motion, (6,)
    energy: Array  #: Psi_Rᵀ K Psi_R, (6, 6) [N/m]
    mass: Array  #: Psi_Rᵀ M Psi_R, (6, 6) [kg]
    stiffest: float  #: largest entry of K [N/m]
    is_possible: np.ndarray  #: whether the dofs can represent each motion, (6,) bool

    def __post_init__(self) -> None:
        for name in ("F", "share", "largest", "energy", "mass"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def is_free(self) -> bool:
        """Whether no motion causes forces beyond rounding."""
        return not self.resists.any()

    @property
    def resists(self) -> np.ndarray:
        """Whether each motion causes forces, (6,) bool."""
        return np.asarray((self.largest > FREE) | self._resists.any(axis=0))

    @property
    def rows(self) -> IntArray:
        """Rows with forces in some motion, ascending."""
        return np.flatnonzero(self._resists.any(axis=1)).astype(np.int64)

    @property
    def _resists(self) -> np.ndarray:
        """Whether each row has a force in each motion, (n_dof, 6) bool.

        Translations do not depend on the digits of the node positions, so a soft spring shows as a row far above the
        others.
        """
        translations = self.share[:, :3]
        usual = np.median(translations, axis=0) if len(translations) else np.zeros(3)
        stands_out = (translations > STANDS_OUT) & (translations > MANY_TIMES * usual)
        return np.asarray((self.share > FREE) | np.hstack([stands_out, np.zeros_like(stands_out)]))

    @property
    def n_free(self) -> int:
        """Number of independent possible motions without forces beyond rounding, including combinations."""
        F = self.F[:, self.is_possible]
        values = np.linalg.svd(F, compute_uv=False)
        return int((values <= max(ROUNDING * self.stiffest, WEAKEST * values.max(initial=0.0))).sum())

    @property
    def place(self) -> tuple[int, int]:
        """Row and motion with the largest force."""
        row, motion = np.unravel_index(int(np.argmax(np.abs(self.F))), self.F.shape)
        return int(row), int(motion)

    @property
    def rigid_body_frequency(self) -> Array:
        """Frequency of the rigid body on its supports in each motion, (6,) [1 / time unit]."""
        mass = np.diag(self.mass)
        omega2 = np.diag(self.energy) / np.where(mass > 0, mass, np.inf)
        return np.asarray(np.sqrt(np.maximum(omega2, 0.0)) / (2 * np.pi))


def rigid_forces(K: sp.csc_array, M: sp.csc_array, nodes: Array, dofs: IntArray) -> RigidForces:
    """Compute the forces by which K resists rigid-body motion.

    A motion is left out if the body has no dof at all of a component that moves in it. A plane body, for example, has
    no motion out of its plane, and a row of masses along x only has the motion along x. A motion is not left out
    because some nodes lack dofs that others have.

    Parameters
    ----------
    K, M
        (n_dof, n_dof).
    nodes
        (n_nodes, 3) [m].
    dofs
        (node, component), (n_dof, 2).
    """
    size = float(np.linalg.norm(np.ptp(nodes, axis=0))) or 1.0
    used = np.unique(dofs[:, 0])
    center = nodes[used].mean(axis=0)
    Psi_R = rigid_motion_of_dofs(nodes, dofs, center)
    known = np.isin(np.arange(6), dofs[:, 1])
    has_rotations = known[3:].any()
    is_possible = np.zeros(6, dtype=bool)
    arms = np.abs(nodes[used] - center).max(axis=0)
    for k in range(3):
        is_possible[k] = known[k]
        # a rotation about k moves points along these two axes, each by the other component of the arm
        others = [c for c in range(3) if c != k]
        moves = [c for c in others if arms[3 - k - c] > 1e-9 * size]
        is_possible[3 + k] = (all(known[c] for c in moves) and bool(moves)) or (not moves and known[3 + k])
        is_possible[3 + k] &= known[3 + k] or not has_rotations
    Psi_R[:, 3:] /= size
    F = np.asarray(K @ Psi_R) * is_possible
    lever = np.where(dofs[:, 1] < 3, 1.0, 1 / size)
    extent = np.asarray(abs(K) @ lever)
    stiffest = float(np.abs(K.data).max(initial=0.0)) or 1.0
    return RigidForces(
        F=F,
        share=np.abs(F) / np.where(extent > 0, extent, 1.0)[:, None],
        largest=np.abs(F).max(axis=0, initial=0.0) / stiffest,
        energy=Psi_R.T @ F,
        mass=Psi_R.T @ (M @ Psi_R),
        stiffest=stiffest,
        is_possible=is_possible,
    )
