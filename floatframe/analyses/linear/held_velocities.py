"""Velocity constraints (rolling without slip) in the equations for small motions.

With xi = N z, which satisfies the position constraints, the velocity constraints are

    A z' + B z = 0,   A = G_v N,   B = (G_x + G_v Omega) N

of first order. With A = U diag(sigma) Tᵀ and A S = 0, z = S y + T eta. eta is the displacement of the system in the
directions in which it may not slip. It is a state; only y, the directions in which the system rolls, have
accelerations:

    eta' = -E y - F eta,   [E F] = diag(1/sigma) Uᵀ B [S T],   eta'' = -E y' + F E y + F F eta

This is inserted into M z'' + C z' + K z = F, which is multiplied by Sᵀ, so that the constraint forces Aᵀ lam vanish.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from floatframe.analyses.system_matrices import Inputs, Tangents
from floatframe.errors import ModelError

__all__ = ["Rolling", "rolled", "rolling"]

RANK = 1e-10  #: singular value of the scaled rows below which a row is redundant
SAME = 1e-8  #: difference of two velocity constraints, relative to their terms, below which they are equal


@dataclass(frozen=True, eq=False)
class Rolling:
    """The motions that velocity constraints permit."""

    S: Array  #: motions by y, (n_z, n_y)
    T: Array  #: motions by eta, (n_z, n_eta)
    by_y: Array  #: rates of eta by y: E, (n_eta, n_y)
    by_eta: Array  #: rates of eta by eta: F, (n_eta, n_eta)

    def places(self, n_states: int) -> Array:
        """Return the matrix from (y, eta, states) to (z, states)."""
        return la.block_diag(np.hstack([self.S, self.T]), np.eye(n_states))


def rolling(parts: Tangents, Omega: Array, N: Array, inputs: Inputs) -> Rolling | None:
    """Return how velocity constraints split the motions N z; None if there are no such constraints.

    Raises
    ------
    ModelError
        If an input moves a rolling part, or velocity constraints depend on states or wrenches.
    """
    rows = parts.rolls
    if not rows.any():
        return None
    if inputs.E[rows].any() or inputs.E_rate[rows].any() or parts.V[rows].any():
        raise ModelError(
            "linearize: a velocity constraint that depends on an input, a state or a wrench is not supported; remove "
            "the input, or give the element a state instead of its multiplier"
        )
    A = parts.G_v[rows] @ N
    B = (parts.G_x[rows] + parts.G_v[rows] @ Omega) @ N
    size = np.linalg.norm(A, axis=1)
    if not (size > 0).all():
        raise ModelError("linearize: an element constrains a velocity that no motion changes")
    left, values, right = la.svd(A / size[:, None])
    rank = int((values > RANK * values[0]).sum())
    known = left[:, :rank].T @ (B / size[:, None])
    repeated = left[:, rank:].T @ (B / size[:, None])
    terms = (np.abs(parts.G_x[rows]) + np.abs(parts.G_v[rows]) @ np.abs(Omega)) @ np.abs(N) / size[:, None]
    if np.abs(repeated).max(initial=0.0) > SAME * terms.max(initial=0.0):
        raise ModelError(
            "linearize: rolling joints contradict each other: their velocity constraints are redundant, but "
            "lead to different positions"
        )
    S, T = right[rank:].T, right[:rank].T
    known = known / values[:rank, None]
    return Rolling(S, T, known @ S, known @ T)


def rolled(parts: dict[str, Array], roll: Rolling, n_states: int) -> dict[str, Array]:
    """Return matrices for (y, eta, states) from matrices for (z, states), see the module docstring."""
    one, zero = np.eye(n_states), np.zeros
    n_z, n_y = roll.S.shape
    n_eta = roll.T.shape[1]
    n = n_y + n_eta + n_states

    def motions(by_y: Array, by_eta: Array, by_states: Array) -> Array:
        """Return the matrix from (y, eta, states) to (z, states)."""
        of_z = np.hstack([by_y, by_eta, zero((n_z, n_states))])
        return np.vstack([of_z, np.hstack([zero((n_states, n_y + n_eta)), by_states])])

    T, none = roll.T, zero((n_z, n_eta))
    A_0 = roll.places(n_states)  # (z, states) = A_0 x
    A_1 = motions(roll.S, none, one)  # rates = A_1 x' + B_1 x
    B_1 = motions(-T @ roll.by_y, -T @ roll.by_eta, 0 * one)
    A_2 = motions(roll.S, none, one)  # second rates = A_2 x'' + C_2 x' + B_2 x
    C_2 = motions(-T @ roll.by_y, none, 0 * one)
    B_2 = motions(T @ roll.by_eta @ roll.by_y, T @ roll.by_eta @ roll.by_eta, 0 * one)
    left = la.block_diag(roll.S.T, one)
    found: dict[str, Array] = {}

    def by_x(second: Array, first: Array, zeroth: Array) -> tuple[Array, Array, Array]:
        return second @ A_2, second @ C_2 + first @ A_1, second @ B_2 + first @ B_1 + zeroth @ A_0

    def with_eta(rows: Array, own: Array) -> Array:
        """Insert the rows of eta between the rows of y and those of the states."""
        return np.vstack([rows[:n_y], own, rows[n_y:]])

    M, C, K = by_x(*(left @ parts[name] for name in "MCK"))
    found["M"] = with_eta(M, zero((n_eta, n)))
    found["C"] = with_eta(C, np.hstack([zero((n_eta, n_y)), np.eye(n_eta), zero((n_eta, n_states))]))
    found["K"] = with_eta(K, np.hstack([roll.by_y, roll.by_eta, zero((n_eta, n_states))]))
    found["L_acceleration"], found["L_rate"], found["L"] = by_x(parts["L_acceleration"], parts["L_rate"], parts["L"])
    for suffix in ("", "_rate", "_acceleration"):
        B = left @ parts[f"B{suffix}"]
        found[f"B{suffix}"] = with_eta(B, zero((n_eta, B.shape[1])))
        found[f"D{suffix}"] = parts[f"D{suffix}"]
    found["N"] = parts["N"] @ A_0
    return found
