"""Mass, damping and stiffness matrices of the whole system at one state, computed from the Newton matrix.

Small motions are described in axes that rotate with omega, in which the steady motion does not change. Every body
rotates with these axes. In addition, a body such as a wheel, whose inertia and forces do not depend on its angle, may
spin with a constant sigma.

    xi    position of the frame origin and rotation, in axes that coincide with the body axes now and rotate with omega;
          modal coordinates
    nu    change of the velocities (v_G and omega_B in these axes, q_dot):         nu  = xi_dot + Omega xi
    eta   change of the accelerations (v_G_dot in these axes, ...):                eta = nu_dot + Omega' nu

with Omega = diag(omega~, omega~, 0) and Omega' = diag(omega~, -sigma~, 0) for every body, because the time derivative
of components in body axes is d/dt - sigma × in these axes. Without spin, these axes are the body axes. The equations
of motion become

    M eta + C nu + K xi - Jᵀ dw = F s            bodies
    G_x xi + G_v nu + V dw + E s + E' s' = 0     rows: V = 0 and G_v = 0 for joint constraints

(docs/theory.md §10). Rows with V are laws of a wrench, such as a moment
about a free axis or the tension of a spring; they are solved for the wrench. Let Z be a basis of the wrenches that the
laws leave undetermined, V_f Z = 0, and r the left side of the equations of the bodies without Jᵀ Z lam. Then

    dw = -V_f⁺ (G_f xi + G_vf nu + E_f s + E'_f s') + Z lam,   Jᵀ Z lam = r,

where r depends only on motions, so that wrenches are linear in xi, nu, eta and s.

States z of elements and user forces are among the unknowns w, each with its rate. They enter the equations like inputs,
with their columns of V in place of E. Their rates z' = -(G_x xi + G_v nu + V dw) follow from the rows of the rates,
like outputs.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.initial_conditions.newton_equations import by_velocities, linearized
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work
from floatframe.errors import ModelError
from floatframe.model.joints.rows import is_held, is_held_position, is_held_velocity
from floatframe.model.rotations import tilde

__all__ = ["ROUNDING", "Inputs", "Tangents", "Wrenches", "held_rows", "settled", "tangents", "turning_matrices"]

CANCELLED = 1e-10  #: size of a sum, relative to its terms, below which it is a rounding error
ROUNDING = 1e-13  #: rounding error of an entry of M, C or K, relative to the terms of its sum
RANK = 1e-10  #: singular value, relative to the largest, below which a row is redundant
SPINLESS = 1e-12  #: spin, relative to the angular velocity, below which it is a rounding error


@dataclass(frozen=True, eq=False)
class Inputs:
    """Coefficients of the inputs s in the equations."""

    F: Array  #: generalised forces on the bodies for unit inputs, body axes, (n_u, n_s)
    E: Array  #: coefficients of s in the rows, (n_w, n_s)
    E_rate: Array  #: coefficients of the rates s' in the rows, (n_w, n_s)

    def beside(self, others: "Inputs") -> "Inputs":
        """Return these inputs followed by others."""
        return Inputs(*(np.hstack([getattr(each, name) for each in (self, others)]) for name in ("F", "E", "E_rate")))


@dataclass(frozen=True, eq=False)
class Tangents:
    """Dense matrices of small motions in body axes, after elimination of the laws of wrenches."""

    M: Array  #: mass matrix, (n_u, n_u)
    C: Array  #: damping and gyroscopic matrix, (n_u, n_u)
    K: Array  #: stiffness matrix, (n_u, n_u)
    G: Array  #: Jacobian of the position constraints of joints, (n_held, n_u)
    J: Array  #: transposed map from wrenches to body forces, (n_w, n_u)
    G_x: Array  #: derivatives of all rows by positions, (n_w, n_u)
    G_v: Array  #: derivatives of all rows by velocities, (n_w, n_u)
    G_a: Array  #: derivatives of wrench laws by accelerations, zero for other rows, (n_w, n_u)
    V: Array  #: derivatives of all rows by wrenches, (n_w, n_w)
    holds: NDArray[np.bool_]  #: whether a row constrains a position, (n_w,)
    rolls: NDArray[np.bool_]  #: whether a row constrains a velocity, (n_w,)
    free: NDArray[np.bool_]  #: whether a row is a wrench law, (n_w,)
    states: IntArray  #: rows of the values of states; the row of the rate follows each, (n_states,)
    soft: Array  #: compliance of constraints that share reactions, zero for other rows, (n_w,)
    by_rows: Array  #: map V_f⁺ from wrench laws to wrenches, (n_w, n_free)

    def body_forces(self, inputs: Inputs) -> tuple[Array, Array]:
        """Return body forces due to inputs and to their rates, with eliminated rows, (n_u, n_s) each."""
        to_bodies = self.J.T @ self.by_rows
        free = self.free
        return inputs.F - to_bodies @ inputs.E[free], -to_bodies @ inputs.E_rate[free]

    def open_wrenches(self) -> tuple[Array, Array]:
        """Return Z, (n_w, n_open), and (Jᵀ Z)⁺, (n_open, n_u); redundant reactions are shared by their compliance.

        Raises
        ------
        ModelError
            If reactions are not unique, and the system does not define how they share the load.
        """
        unknown = ~self.of_states
        V = self.V[np.ix_(self.free, unknown)]
        scale = np.maximum(np.abs(V).max(axis=0, initial=0.0), 1.0)
        own = la.null_space(V / scale, rcond=RANK) / scale[:, None] if len(V) else np.eye(int(unknown.sum()))
        Z = np.zeros((len(self.V), own.shape[1]))
        Z[unknown] = own
        if not Z.shape[1]:
            return Z, np.zeros((0, self.J.shape[1]))
        Z /= np.linalg.norm(Z, axis=0)
        JZ = self.J.T @ Z
        size = np.linalg.norm(JZ, axis=0)
        if (size <= RANK * size.max()).any():  # a multiplier without effect
            size = np.maximum(size, RANK * size.max())
        left, values, right = la.svd(JZ / size, full_matrices=False)
        known = values > RANK * values[0]
        back = (right[known].T / values[known]) @ left[:, known].T / size[:, None]
        if known.all():
            return Z, back
        repeated = la.null_space(JZ / size, rcond=RANK) / size[:, None]
        sharing = (self.soft > 0) & self.holds
        weights = self.V[sharing] / np.sqrt(self.soft[sharing])[:, None]  # sqrt(soft) times the multipliers
        by_share = weights @ Z @ repeated
        if np.linalg.matrix_rank(by_share) < repeated.shape[1]:
            raise ModelError(
                "reactions of redundant constraints are not unique: remove these constraints, or set "
                'redundant = "minimum-norm" in the system'
            )
        return Z, back - repeated @ np.linalg.lstsq(by_share, weights @ Z @ back, rcond=None)[0]

    def wrenches(self, inputs: Inputs, Omega: Array, Omega_t: Array) -> "Wrenches":
        """Return the coefficients of xi, xi', xi'', s and s' in the wrench change dw."""
        free, D = self.free, self.full(Omega, Omega_t)
        force, force_rate = self.body_forces(inputs)
        Z, back = self.open_wrenches()
        Q = Z @ back
        G_x, G_v, G_a = self.G_x[free], self.G_v[free], self.G_a[free]
        E, E_rate = inputs.E[free], inputs.E_rate[free]
        of_states = np.zeros((len(self.V), E.shape[1]))
        if len(self.states):  # states are the last inputs
            of_states[self.states, E.shape[1] - len(self.states) + np.arange(len(self.states))] = 1.0
        return Wrenches(
            x=sum_of_products(
                (Q, D[0]), (-self.by_rows, G_x), (-self.by_rows, G_v @ Omega), (-self.by_rows, G_a @ Omega_t @ Omega)
            ),
            v=sum_of_products((Q, D[1]), (-self.by_rows, G_v), (-self.by_rows, G_a @ (Omega + Omega_t))),
            a=sum_of_products((Q, D[2]), (-self.by_rows, G_a)),
            s=of_states + sum_of_products((-Q, force), (-self.by_rows, E)),
            s_rate=sum_of_products((-Q, force_rate), (-self.by_rows, E_rate)),
        )

    @property
    def of_states(self) -> NDArray[np.bool_]:
        """Whether each row is the value, rate or algorithmic rate of a state, (n_w,)."""
        return rows_of_states(self.states, len(self.V))

    @property
    def by_states(self) -> Inputs:
        """Coefficients of states in the equations."""
        zero = np.zeros((len(self.V), len(self.states)))
        return Inputs(np.zeros((self.J.shape[1], len(self.states))), self.V[:, self.states], zero)

    def rates_of_states(self, Omega: Array) -> tuple[Array, Array, Array]:
        """Return derivatives of z' by xi and xi', (n_states, n_u), and by wrenches and states, (n_states, n_w)."""
        rows = self.states + 1
        by_wrench = -self.V[rows]
        by_wrench[:, rows] = 0.0
        return -(self.G_x + self.G_v @ Omega)[rows], -self.G_v[rows], by_wrench

    def full(self, Omega: Array, Omega_t: Array) -> tuple[Array, Array, Array]:
        """Return the matrices of xi, xi' and xi'' in the equations of the bodies."""
        by_rate = self.C + self.M @ (Omega + Omega_t)
        return self.K + self.C @ Omega + self.M @ Omega_t @ Omega, by_rate, self.M


@dataclass(frozen=True, eq=False)
class Wrenches:
    """Coefficients of the wrench change dw = x xi + v xi' + a xi'' + s s + s_rate s'."""

    x: Array  #: coefficients of xi, (n_w, n_u)
    v: Array  #: coefficients of xi', (n_w, n_u)
    a: Array  #: coefficients of xi'', (n_w, n_u)
    s: Array  #: coefficients of s, (n_w, n_s)
    s_rate: Array  #: coefficients of s', (n_w, n_s)


def settled(result: Array, *products: tuple[Array, Array], error: float = CANCELLED) -> Array:
    """Return a sum of products A B in which rounding errors of cancelled terms are set to zero.

    error: largest magnitude of such an entry, relative to the sum of the magnitudes of its terms.
    """
    size = sum(np.abs(A) @ np.abs(B) for A, B in products)
    return np.where(np.abs(result) <= error * size, 0.0, result)


def sum_of_products(*products: tuple[Array, Array]) -> Array:
    """Return Σ A B without rounding errors of cancelled terms, see `settled`."""
    return settled(np.asarray(sum(A @ B for A, B in products)), *products)


def held_rows(model: Model) -> np.ndarray:
    """Return whether each row constrains a distance or an angle, (n_w,) bool; other rows are wrench laws."""
    return is_held(model.rows.kind)


def tangents(model: Model, work: Work) -> Tangents:
    """Return M, C, K, G at the iterate in `work`, whose wrenches give the geometric part of K."""
    by_position = linearized(model, work, 0.0, 0.0, 1.0)
    C_of_bodies, G_of_velocities = by_velocities(model, work, by_position)
    by_acceleration = linearized(model, work, 1.0, 0.0, 0.0)
    M = la.block_diag(*by_acceleration.H)
    K = la.block_diag(*by_position.H)
    C = la.block_diag(*C_of_bodies)
    G, G_v = by_position.G.toarray(), G_of_velocities.toarray()
    J, V = by_position.J.toarray(), by_position.V.toarray()
    holds, rolls = is_held_position(model.rows.kind), is_held_velocity(model.rows.kind)
    states = np.asarray(model.states.row)
    of_states = rows_of_states(states, len(V))
    free = ~holds & ~rolls & ~of_states
    G_a = np.where(free[:, None], by_acceleration.G.toarray(), 0.0)
    by_rows = np.zeros((len(V), int(free.sum())))
    if free.any():
        by_rows[~of_states] = np.linalg.pinv(V[np.ix_(free, ~of_states)])
        # dw = -V⁺ (G_x xi + G_v nu); reactions of joint constraints do no work in allowed motions
        to_bodies = J.T @ by_rows
        K += to_bodies @ G[free]
        C += to_bodies @ G_v[free]
        M += to_bodies @ G_a[free]
    soft = np.asarray(model.rows.soft)
    return Tangents(M, C, K, G[holds], J, G, G_v, G_a, V, holds, rolls, free, states, soft, by_rows)


def rows_of_states(states: IntArray, n_w: int) -> NDArray[np.bool_]:
    """Return whether each row is the value, rate or algorithmic rate of a state, (n_w,)."""
    found = np.zeros(n_w, dtype=bool)
    for k in range(3):
        found[states + k] = True
    return found


def turning_matrices(model: Model, work: Work, omega: Array) -> tuple[Array, Array]:
    """Return Omega and Omega' for the velocities in `work`, for axes rotating with omega (ground axes), (n_u, n_u)."""
    n_u = int(model.bodies.u0[-1])
    Omega, Omega_t = np.zeros((n_u, n_u)), np.zeros((n_u, n_u))
    for i, u0 in enumerate(model.bodies.u0[:-1]):
        turning = work.state.R[i].T @ omega
        v, turn = slice(u0, u0 + 3), slice(u0 + 3, u0 + 6)
        spin = work.state.u[turn] - turning
        if np.abs(spin).max() <= SPINLESS * np.abs(turning).max():
            spin = np.zeros(3)
        Omega[v, v] = Omega[turn, turn] = Omega_t[v, v] = tilde(turning)
        Omega_t[turn, turn] = -tilde(spin)
    return Omega, Omega_t
