"""Body reference frames: the condition that tells elastic displacement from rigid-body motion (THEORY §4).

A frame is a condition Wᵀ u = 0 of six rows. Columns v become v - Psi_R (Wᵀ Psi_R)⁻¹ Wᵀ v: the same deformation, seen
from the frame. K is blind to it, M is not.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.arrays import Array, IntArray
from cms.errors import BodyError
from cms.fe_body import FEBody
from cms.reduced_body import BodyFrame
from cms.rigid_modes import determinate_dofs, geometric_rigid_modes

__all__ = ["Frame", "NodalFrame", "TisserandFrame"]


@dataclass(frozen=True)
class NodalFrame:
    """The frame is attached to six dofs that do not deform: those of an interface, or chosen among all boundary dofs.

    Its origin is the reference point of the interface (the centre of mass where none is named), axes as the mesh.
    """

    at: str | None = None  #: name of the interface; None: six determinate dofs by pivoted QR
    origin: tuple[float, float, float] | None = None  #: in mesh coordinates [m], instead of the default


@dataclass(frozen=True)
class TisserandFrame:
    """Mean-axis frame: Psi_Rᵀ M u = 0, least relative kinetic energy; origin at the undeformed centre of mass."""

    origin: tuple[float, float, float] | None = None  #: in mesh coordinates [m], instead of the default


Frame = NodalFrame | TisserandFrame


@dataclass(frozen=True, eq=False)
class FrameCondition:
    """A frame made ready for one body."""

    frame: BodyFrame
    rigid_part: Callable[[Array], Array]  #: columns (n_dof, k) -> C (6, k): what to take off as Psi_R C
    Psi_R: Array  #: rigid-body modes about the centre of mass, (n_dof, 6)
    M_Psi_R: Array  #: (n_dof, 6)

    def remove_rigid_part(self, columns: Array) -> Array:
        """Return columns - Psi_R C, which satisfy the condition of the frame, (n_dof, k)."""
        return columns - self.Psi_R @ self.rigid_part(columns)


def frame_condition(body: FEBody, frame: Frame) -> FrameCondition:
    """Make the frame ready for a body: the dofs or the mass matrix it rests on, its origin.

    Raises
    ------
    BodyError
        If the named interface does not hold the body, or the body has no mass or no inertia.
    """
    Psi_0 = geometric_rigid_modes(body)
    rigid_mass = Psi_0.T @ (body.M @ Psi_0)
    mass = rigid_mass[0, 0]
    if not mass > 0:
        raise BodyError(f"body {body.name!r}: its mass is {mass:g}; expected a positive mass")
    # first moment from the coupling of translation and rotation: ∫ u·(theta × c) = theta·(c × u)
    center = np.array([rigid_mass[1, 5], rigid_mass[2, 3], rigid_mass[0, 4]]) / mass
    Psi_R = geometric_rigid_modes(body, origin=center)
    M_Psi_R = body.M @ Psi_R
    if isinstance(frame, TisserandFrame):
        origin = center if frame.origin is None else np.asarray(frame.origin, dtype=float)
        factor = _cholesky_of_inertia(body, Psi_R.T @ M_Psi_R)
        return FrameCondition(
            BodyFrame("tisserand", origin), lambda columns: la.cho_solve(factor, M_Psi_R.T @ columns), Psi_R, M_Psi_R
        )
    r = _nodal_dofs(body, frame)
    default = center if frame.at is None else body.interface(frame.at).reference
    origin = default if frame.origin is None else np.asarray(frame.origin, dtype=float)
    lu = la.lu_factor(Psi_R[r])
    return FrameCondition(
        BodyFrame("nodal", origin, at=frame.at or ""), lambda columns: la.lu_solve(lu, columns[r]), Psi_R, M_Psi_R
    )


def _nodal_dofs(body: FEBody, frame: NodalFrame) -> IntArray:
    candidates = body.b if frame.at is None else body.interface(frame.at).dofs
    if candidates is None or len(candidates) == 0:
        raise BodyError(
            f"body {body.name!r}: a nodal frame needs boundary dofs; couple an interface or take a Tisserand frame"
        )
    return determinate_dofs(body, np.asarray(candidates))


def _cholesky_of_inertia(body: FEBody, rigid_mass: Array) -> tuple[Array, bool]:
    scale = np.sqrt(np.abs(np.diag(rigid_mass)))
    if (scale == 0).any() or np.linalg.eigvalsh(rigid_mass / np.outer(scale, scale))[0] < 1e-10:
        raise BodyError(
            f"body {body.name!r}: has no moment of inertia about some axis; a Tisserand frame needs all "
            "three, take a nodal frame"
        )
    return la.cho_factor(rigid_mass)
