"""What the stiffness of a body says to rigid-body motion: nothing, if it is free."""

from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["FREE", "MOTIONS", "RigidForces", "rigid_forces"]

FREE = 1e-6  #: force of a rigid-body motion over |K| |Psi_R|, of the stiffest entry or of its own row, that is rounding
STANDS_OUT, MANY_TIMES = 1e-9, 1e4  #: share of a row, beside the median of all, by which a soft spring shows
ROUNDING, WEAKEST = 1e-11, 1e-8  #: of the stiffest entry, of the stiffest support: what holds a body at least
MOTIONS = ("x", "y", "z", "a turn about x", "a turn about y", "a turn about z")


@dataclass(frozen=True, eq=False)
class RigidForces:
    """Forces K Psi_R of rigid-body motions about the mean of the nodes, rotations over the size of the body."""

    F: Array  #: K Psi_R, zero for motions that the dofs of the body cannot make, (n_dof, 6) [N/m]
    share: Array  #: of every row: |F| over the sum of |K_kl| s_l, s the size of motion of a dof, (n_dof, 6)
    largest: Array  #: largest force over the stiffest entry, (6,)
    energy: Array  #: Psi_Rᵀ K Psi_R, (6, 6) [N/m]
    mass: Array  #: Psi_Rᵀ M Psi_R, (6, 6) [kg]
    stiffest: float  #: largest entry of K [N/m]
    is_possible: np.ndarray  #: whether the dofs of the body can make the motion, (6,) bool

    def __post_init__(self) -> None:
        for name in ("F", "share", "largest", "energy", "mass"):
            object.__setattr__(self, name, frozen(getattr(self, name)))

    @property
    def is_free(self) -> bool:
        """Whether no motion is answered by more than rounding."""
        return not self.is_answered.any()

    @property
    def is_answered(self) -> np.ndarray:
        """Whether a motion is answered by forces, (6,) bool."""
        return np.asarray((self.largest > FREE) | self._answers.any(axis=0))

    @property
    def rows(self) -> IntArray:
        """Rows that answer some motion, ascending."""
        return np.flatnonzero(self._answers.any(axis=1)).astype(np.int64)

    @property
    def _answers(self) -> np.ndarray:
        """Which row answers which motion, (n_dof, 6) bool.

        Translations do not depend on the digits of the nodes: there a soft spring shows as a row far above the others.
        """
        translations = self.share[:, :3]
        usual = np.median(translations, axis=0) if len(translations) else np.zeros(3)
        stands_out = (translations > STANDS_OUT) & (translations > MANY_TIMES * usual)
        return np.asarray((self.share > FREE) | np.hstack([stands_out, np.zeros_like(stands_out)]))

    @property
    def n_free(self) -> int:
        """Number of independent possible motions that are answered by rounding alone, combinations among them."""
        F = self.F[:, self.is_possible]
        values = np.linalg.svd(F, compute_uv=False)
        return int((values <= max(ROUNDING * self.stiffest, WEAKEST * values.max(initial=0.0))).sum())

    @property
    def place(self) -> tuple[int, int]:
        """Row and motion of the largest force."""
        row, motion = np.unravel_index(int(np.argmax(np.abs(self.F))), self.F.shape)
        return int(row), int(motion)

    @property
    def swing(self) -> Array:
        """Frequency at which the body would swing in each motion if it moved rigidly, (6,) [1 / time unit]."""
        mass = np.diag(self.mass)
        omega2 = np.diag(self.energy) / np.where(mass > 0, mass, np.inf)
        return np.asarray(np.sqrt(np.maximum(omega2, 0.0)) / (2 * np.pi))


def rigid_forces(K: sp.csc_array, M: sp.csc_array, nodes: Array, dofs: IntArray) -> RigidForces:
    """Find what K answers to rigid-body motion.

    A motion is left out where the body lacks all dofs of a component that moves in it: a plane body knows no motion
    out of its plane, a row of masses along x none but that along x. Nodes that lack dofs which others have do not
    excuse a motion.

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
        others = [c for c in range(3) if c != k]  # a turn about k moves points along these, by their other arm
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
