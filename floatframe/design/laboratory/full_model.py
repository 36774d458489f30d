"""The full finite element model as a reference: the unreduced body in the multibody system.

The shapes are all displacements of the mesh, so that no static or vibration mode is missing, and the difference between
a case and this reference is the truncation of the case. The model still describes small deformation about a moving
frame, with the geometric stiffness of the unit loads; parts or an exact beam show where this becomes inaccurate.
"""

from dataclasses import dataclass

import numpy as np

from cms.modes.mode_set import ModeSet
from fe_models.body.fe_body import MULTIPLIER, FEBody
from fe_models.foundation.arrays import MOTION_COMPONENTS
from fe_models.foundation.records import checked_fields
from floatframe.errors import ModelError

__all__ = ["MOST_DOFS", "FullModel", "all_dofs"]

MOST_DOFS = 1200  #: largest number of dofs, because dense matrices of this size are factorised repeatedly


@dataclass(frozen=True)
@checked_fields(ModelError)
class FullModel:
    """Reference with the unreduced body, whose dofs are integrated by the integrator of the study.

    Parameters
    ----------
    most_dofs
        Largest number of dofs; larger models are refused, because the cost of dense matrices grows with its cube.
    """

    most_dofs: int = MOST_DOFS

    @property
    def description(self) -> str:
        """Description of the reference as text."""
        return "the full finite element model"


def all_dofs(body: FEBody, most_dofs: int = MOST_DOFS) -> ModeSet:
    """Return unit columns for all dofs of a coupled body, a complete mode set.

    The reference node of a distributing interface has no column, because it follows its members, C_r u_r + C_m u_m = 0
    (its multiplier rows of K); neither have multipliers.

    Raises
    ------
    ModelError
        If there are more than `most_dofs`.
    """
    is_multiplier = body.dofs[:, 1] == MULTIPLIER
    followers = [i.dofs for i in body.interfaces if i.kind == "distributing" and i.dofs is not None]
    is_free = ~is_multiplier
    for dofs in followers:
        is_free[dofs] = False
    free = np.flatnonzero(is_free)
    if len(free) > most_dofs:
        raise ModelError(
            f"study: reference: the full model of body {body.name!r} has {len(free)} dofs, more than {most_dofs}: its "
            "matrices are dense in the system. Take a coarser mesh for the study, allow more (most_dofs), or a case "
            "with many modes as reference"
        )
    V = np.zeros((body.n_dof, len(free)))
    V[free, np.arange(len(free))] = 1.0
    if followers:
        C = body.K[np.flatnonzero(is_multiplier), :].toarray()
        r = np.concatenate(followers)
        V[r] = -np.linalg.solve(C[:, r], C[:, free])
    labels = tuple(f"dof {body.numbering.called(n)} {MOTION_COMPONENTS[c]}" for n, c in body.dofs[free])
    options = {"columns": "every dof of the body"}
    return ModeSet("all dofs", V, labels, np.full(len(free), np.nan), options, ("dofs",) * len(free))
