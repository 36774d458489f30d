"""Constants of bodies about their centre of mass; the formulas are in `kernels.bodies`."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.initial_conditions.newton_equations import modal_matrix, stored_array
from floatframe.engine.kernels.model import C1, C2, MASS, S_AB, STIFFNESS, Model
from floatframe.errors import ModelError
from floatframe.model.rotations import tilde

__all__ = ["CentralBody", "central_bodies"]


@dataclass(frozen=True, eq=False)
class CentralBody:
    """Constants of a body for the structure-preserving schemes."""

    m: float
    S: Array  #: first moment divided by mass: undeformed centre of mass in the frame, (3,)
    C1: Array  #: derivative of S by q at zero deformation, (3, n)
    J0: Array  #: inertia about the frame origin, (3, 3)
    C2: Array  #: coupling of rotation and modes, (3, n)
    S_ab_T: Array  #: second-order inertia [k, a, b, l], (n, 9 n)
    M: Array  #: modal mass matrix, (n, n)
    K: Array  #: modal stiffness matrix, (n, n)

    @property
    def n(self) -> int:
        """Number of modes of the body."""
        return len(self.K)

    @property
    def mass_matrix(self) -> Array:
        """Mass matrix of (omega, q_dot) about the undeformed centre of mass, (3 + n, 3 + n)."""
        A = np.hstack([-tilde(self.S), self.C1])
        return np.asarray(np.block([[self.J0, self.C2], [self.C2.T, self.M]]) - self.m * A.T @ A)


def central_bodies(model: Model, names: tuple[str, ...], scheme: str) -> tuple[CentralBody, ...]:
    """Return the constants of all bodies; `ModelError` if a body has a mode without mass."""
    known: dict[int, CentralBody] = {}
    bodies = []
    for i, t in enumerate(int(kind) for kind in model.bodies.kind):
        if t not in known:
            known[t] = central_body(model, i)
            M = known[t].mass_matrix[3:, 3:]
            if len(M) and np.linalg.eigvalsh(M)[0] <= 1e-12 * np.abs(np.diag(M)).max():
                raise ModelError(
                    f"{scheme}: body {names[i]!r} has a mode without mass, which has no momentum; remove the mode, or "
                    "use generalized-alpha"
                )
        bodies.append(known[t])
    return tuple(bodies)


def central_body(model: Model, i: int) -> CentralBody:
    """Return the constants of one body."""
    t, n = int(model.bodies.kind[i]), int(model.bodies.n_q[i])
    m = float(model.body_types.mass[t])
    return CentralBody(
        m=m,
        S=model.body_types.S[t] / m,
        C1=stored_array(model, i, C1, 3, n) / m,
        J0=model.body_types.J0[t],
        C2=stored_array(model, i, C2, 3, n),
        S_ab_T=np.moveaxis(stored_array(model, i, S_AB, n, 3, 3, n), [0, 3], [3, 0]).reshape(n, 9 * n),
        M=modal_matrix(model, i, MASS),
        K=modal_matrix(model, i, STIFFNESS),
    )
