"""The equations of one reduced body as plain arrays and functions, for other programs (docs/theory.md §5-7).

With velocities (v, omega, q_dot), where v is that of the frame origin in body axes, and loads (f, tau, h) of §6,

    M(q) (a, alpha, q_ddot) + k_omega(omega, q, q_dot) + k_e(q, q_dot) = (f, tau, h),

where a is the acceleration of the frame origin in body axes minus gravity. The formulas of §6 are written in NumPy,
independently of the kernels; tests compare both.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.engine.compiling.stiffening import stiffened_shape_moments
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.rotations import rotation_matrix, tilde

__all__ = ["BodyEquations", "body_equations"]


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class BodyEquations:
    """Invariants of a body about its frame origin and the terms of its equations of motion, all in body axes.

    Parameters
    ----------
    m
        Mass [kg].
    S
        First moment, (3,) [kg m].
    J0
        Inertia about the frame origin, undeformed, (3, 3) [kg m²].
    C1
        1C = ∫ phi_a,k, (3, n) [kg^(1/2) with M-orthonormal shapes].
    C2
        2C = ∫ c × phi_k, (3, n).
    C3
        3C_k = ∫ (c·phi_k 1 - phi_k cᵀ), (n, 3, 3)
    C4
        4C_kl = ∫ phi_l × phi_k, (n, n, 3).
    S_ab
        ∫ phi_a,k phi_b,l, (3, 3, n, n); for a stiffened body including K_ab and K_r (§7).
    M
        Modal mass M*, (n, n).
    K
        Modal stiffness K*, (n, n).
    D
        Modal damping D*, (n, n).
    K_t
        Geometric stiffness for unit accelerations, (3, n, n); zero unless stiffened.
    K_r
        Geometric stiffness for unit angular accelerations, (3, n, n); zero unless stiffened.
    """

    m: float
    S: Array
    J0: Array
    C1: Array
    C2: Array
    C3: Array
    C4: Array
    S_ab: Array
    M: Array
    K: Array
    D: Array
    K_t: Array
    K_r: Array

    @property
    def n_q(self) -> int:
        """Number of modes of the body."""
        return len(self.K)

    def first_moment(self, q: Array) -> Array:
        """Return the first moment s(q) = S + 1C q + 1/2 qᵀ K_t q, (3,) [kg m]."""
        return np.asarray(self.S + self.C1 @ q + 0.5 * np.einsum("k,akl,l->a", q, self.K_t, q))

    def first_moment_rate(self, q: Array) -> Array:
        """Return the derivative of the first moment, 1C(q) = ds/dq, (3, n)."""
        return np.asarray(self.C1 + self.K_t @ q)

    def coupling(self, q: Array) -> Array:
        """Return B(q), the coupling of rotation and modes, (3, n): 2C_k + Σ 4C_kl q_l, plus K_r q if stiffened."""
        W = np.einsum("abkl,l->abk", self.S_ab, q)
        return np.asarray(self.C2 + np.stack([W[2, 1] - W[1, 2], W[0, 2] - W[2, 0], W[1, 0] - W[0, 1]]))

    def inertia_rates(self, q: Array) -> Array:
        """Return D_k(q) = 3C_k + Σ_l 5C_lk q_l, (n, 3, 3), where dJ/dq_k = D_k + D_kᵀ."""
        return np.asarray(self.C3 + self.trace_less(q))

    def inertia(self, q: Array) -> Array:
        """Return the inertia J(q) about the frame origin, (3, 3) [kg m²]."""
        G = np.einsum("k,kab->ab", q, self.C3 + 0.5 * self.trace_less(q))
        return np.asarray(self.J0 + G + G.T)

    def trace_less(self, q: Array) -> Array:
        """Return Σ_l 5C_lk q_l = tr(W_k) 1 - W_k, (n, 3, 3)."""
        W = np.einsum("abkl,l->kab", self.S_ab, q)
        return np.asarray(np.trace(W, axis1=1, axis2=2)[:, None, None] * np.eye(3) - W)

    def mass_matrix(self, q: Array, theta: Array | None = None) -> Array:
        """Return the symmetric mass matrix M(theta, q) for velocities (v, omega, q_dot), (6 + n, 6 + n).

        theta: Euler parameters of the frame, (4,), if v is in ground axes. Without them, v is in body axes, and the
        matrix does not depend on the orientation of the body.
        """
        s, B, C1 = self.first_moment(q), self.coupling(q), self.first_moment_rate(q)
        M = np.block(
            [
                [self.m * np.eye(3), -tilde(s), C1],
                [tilde(s), self.inertia(q), B],
                [C1.T, B.T, self.M],
            ]
        )
        if theta is None:
            return np.asarray(M)
        turn = np.eye(6 + self.n_q)
        turn[:3, :3] = rotation_matrix(theta)
        return np.asarray(turn @ M @ turn.T)

    def quadratic_velocity(self, omega: Array, q: Array, q_dot: Array) -> Array:
        """Return the inertia forces k_omega at zero accelerations in body axes, (6 + n,) [N, N m, N].

        omega × (omega × s) + 2 omega × 1C(q) q_dot + q_dotᵀ K_t q_dot; omega × J omega + 2 Σ q_dot_k D_k omega +
        q_dotᵀ K_r q_dot; 2 Σ_l 4C_kl·omega q_dot_l - omegaᵀ D_k omega.
        """
        s, J, D = self.first_moment(q), self.inertia(q), self.inertia_rates(q)
        along = self.first_moment_rate(q) @ q_dot
        f = np.cross(omega, np.cross(omega, s) + 2 * along) + np.einsum("k,akl,l->a", q_dot, self.K_t, q_dot)
        tau = np.cross(omega, J @ omega) + 2 * np.einsum("k,kab,b->a", q_dot, D, omega)
        tau = tau + np.einsum("k,akl,l->a", q_dot, self.K_r, q_dot)
        h = 2 * np.einsum("kla,a,l->k", self.C4, omega, q_dot) - np.einsum("a,kab,b->k", omega, D, omega)
        return np.concatenate([f, tau, h])

    def elastic(self, q: Array, q_dot: Array) -> Array:
        """Return the elastic and damping forces k_e = (0, 0, K q + D q_dot), (6 + n,) [N, N m, N]."""
        return np.concatenate([np.zeros(6), self.K @ q + self.D @ q_dot])

    def arrays(self) -> dict[str, Array]:
        """Return all arrays by name, for `np.savez(path, **arrays)` or `scipy.io.savemat(path, arrays)`."""
        return {name: np.array(getattr(self, name)) for name in self.__dataclass_fields__}


def body_equations(body: ReducedBody | FlexibleBody, *, stiffening: bool | Literal["auto"] = "auto") -> BodyEquations:
    """Return the equations of a reduced body as arrays and functions.

    Parameters
    ----------
    body
        A reduced body, in the frame of its file; or a flexible body of a system, in the frame in which the engine
        computes it (mean axes if it is stiffened), with its own `stiffening`.
    stiffening
        For a reduced body: whether to use its geometric stiffness; "auto": if it has one.

    Raises
    ------
    ModelError
        If stiffening is requested for a body without geometric stiffness.
    """
    if isinstance(body, FlexibleBody):
        return body_equations(body.moved, stiffening=body.is_stiffened)
    if stiffening is True and body.geometric is None:
        raise ModelError(
            f"body_equations: stiffening is requested, but reduced body {body.name!r} holds no geometric stiffness"
        )
    n = body.n_q
    moments = body.moments.left_out if body.moments.missing else body.moments
    S_ab, K_t, K_r = np.array(moments.S_kl), np.zeros((3, n, n)), np.zeros((3, n, n))
    if stiffening is not False and body.geometric is not None and n:
        S_ab = stiffened_shape_moments(moments.S_kl, body.geometric)
        K_t, K_r = np.array(body.geometric.translation), np.array(body.geometric.rotation)
    return BodyEquations(
        moments.m, np.array(moments.S), np.array(moments.J0), np.array(moments.C1), np.array(moments.C2),
        np.array(moments.C3), np.array(moments.C4), S_ab, np.array(body.M), np.array(body.K), np.array(body.D), K_t,
        K_r,
    )  # fmt: skip
