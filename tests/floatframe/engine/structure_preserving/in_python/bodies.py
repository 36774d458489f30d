"""Bodies about their centre of mass, and one step of a body.

Formulas: `floatframe.engine.structure_preserving.kernels.bodies`.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.initial_conditions.newton_equations import modal_matrix, stored_array
from floatframe.engine.kernels.model import C3, DAMPING, K_TRANSLATION, S_AB, Model
from floatframe.engine.structure_preserving.bodies import CentralBody
from floatframe.model.rotations import cross, dot, rotated, rotation_matrix, tilde
from floatframe.model.state import State
from tests.floatframe.engine.structure_preserving.in_python.rotation import cayley, cayley_parameters


@dataclass(frozen=True, eq=False)
class Body(CentralBody):
    """Constants of a body, and what follows from them where it is deformed."""

    K_t: Array | None  #: second derivative of S by q [l, a, k], (n, 3 n); None if zero
    J_k: Array  #: derivative of the inertia by q_k, 3C_k + 3C_kᵀ, (n, 3, 3)
    S_ab: Array  #: second-order inertia [l, a, b, k], (n, 9 n)
    D: Array  #: modal damping matrix, (n, n)

    def center(self, q: Array) -> Array:
        """Return s(q), from the frame origin to the centre of mass, body axes, (..., 3)."""
        return self.S + 0.5 * rotated(self.C1 + self.shapes(q), q)

    def shapes(self, q: Array) -> Array:
        """Return 1C(q) = ds/dq, (..., 3, n)."""
        return self.C1 if self.K_t is None else self.C1 + bent(self.K_t, q, 3)

    def drift(self, q: Array, omega: Array, q_dot: Array) -> Array:
        """Return a, the velocity of the centre of mass against the frame origin, body axes, (..., 3)."""
        return cross(omega, self.center(q)) + rotated(self.shapes(q), q_dot)

    def products(self, q: Array) -> Array:
        """Return V_ab,k = Σ_l S_ab,kl q_l, (..., 3, 3, n)."""
        return (q @ self.S_ab).reshape(*q.shape[:-1], 3, 3, self.n)

    def inertia(self, q: Array, V: Array) -> Array:
        """Return J(q), (..., 3, 3), for V = products(q)."""
        P = (V @ q[..., None, :, None])[..., 0]
        trace = P[..., 0, 0] + P[..., 1, 1] + P[..., 2, 2]
        linear = np.tensordot(q, self.J_k, axes=(-1, 0))
        return self.J0 + linear + trace[..., None, None] * np.eye(3) - 0.5 * (P + np.swapaxes(P, -1, -2))

    def coupling(self, V: Array) -> Array:
        """Return B(q), (..., 3, n)."""
        return self.C2 + moments(V)

    def momenta(self, q: Array, omega: Array, q_dot: Array) -> tuple[Array, Array]:
        """Return Pi, (..., 3), and Y, (..., n)."""
        V = self.products(q)
        B, s, C = self.coupling(V), self.center(q), self.shapes(q)
        a = self.m * (cross(omega, s) + rotated(C, q_dot))
        Pi = rotated(self.inertia(q, V), omega) + rotated(B, q_dot) - cross(s, a)
        return Pi, rotated(np.swapaxes(B, -1, -2), omega) + q_dot @ self.M - rotated(np.swapaxes(C, -1, -2), a)

    def mass_matrix_at(self, q: Array) -> Array:
        """Return M_c(q), (3 + n, 3 + n), for one q."""
        V, s = self.products(q), tilde(self.center(q))
        B = self.coupling(V)
        M = np.block([[self.inertia(q, V), B], [B.T, self.M]])
        A = np.hstack([-s, self.shapes(q)])
        return np.asarray(M - self.m * A.T @ A)

    def inertia_force(self, q_0: Array, q_1: Array, w_0: tuple[Array, Array], w_1: tuple[Array, Array]) -> Array:
        """Return N_k, (..., n): 1/2 w_0ᵀ M_c,k w_1 between two configurations; w = (omega, q_dot)."""
        if self.n == 0:
            return np.zeros(np.broadcast_shapes(q_0.shape, q_1.shape))
        omega_0, omega_1 = w_0[0], w_1[0]
        q = 0.5 * (q_0 + q_1)
        V, C = self.products(q), self.shapes(q)
        first = np.tensordot(omega_0, self.J_k, axes=(-1, 1))  # (..., n, 3)
        total = (first @ omega_1[..., None])[..., 0]
        trace = V[..., 0, 0, :] + V[..., 1, 1, :] + V[..., 2, 2, :]
        both = V + np.swapaxes(V, -3, -2)
        total = total + 2 * dot(omega_0, omega_1)[..., None] * trace
        total = total - np.einsum("...a,...abk,...b->...k", omega_0, both, omega_1)
        for (omega, rate), (other, other_rate) in ((w_0, w_1), (w_1, w_0)):
            change = moments((other_rate @ self.S_ab_T).reshape(*other_rate.shape[:-1], 3, 3, self.n))
            total = total + np.einsum("...a,...ak->...k", omega, change)
            # the mean of one a, times the derivative of the other by q_k: omega × 1C_k + (K_t q_dot)_k
            a = 0.5 * self.m * (self.drift(q_0, omega, rate) + self.drift(q_1, omega, rate))
            total = total - rotated(np.swapaxes(C, -1, -2), cross(a, other))
            if self.K_t is not None:
                total = total - rotated(np.swapaxes(bent(self.K_t, other_rate, 3), -1, -2), a)
        return 0.5 * total


def step_bodies(model: Model, bodies: tuple[CentralBody, ...]) -> tuple[Body, ...]:
    """Return bodies with their functions, one for each type."""
    made: dict[int, Body] = {}
    for i, body in enumerate(bodies):
        if id(body) not in made:
            made[id(body)] = step_body(model, i, body)
    return tuple(made[id(body)] for body in bodies)


def step_body(model: Model, i: int, body: CentralBody) -> Body:
    """Return body i with its functions."""
    n, is_bent = body.n, body.n > 0 and bool(model.body_types.has_unit_loads[model.bodies.kind[i]])
    C3_k = np.moveaxis(stored_array(model, i, C3, 3, 3, n), 2, 0)
    return Body(
        **vars(body),
        K_t=stored_array(model, i, K_TRANSLATION, n, 3 * n) / body.m if is_bent else None,
        J_k=C3_k + np.swapaxes(C3_k, 1, 2),
        S_ab=stored_array(model, i, S_AB, n, 9 * n),
        D=modal_matrix(model, i, DAMPING),
    )


def bent(K: Array, x: Array, n_rows: int) -> Array:
    """Return Σ_l K [l, a, k] x_l, (..., n_rows, n), for K, (n, n_rows n)."""
    return (x @ K).reshape(*x.shape[:-1], n_rows, -1)


def moments(V: Array) -> Array:
    """Return epsilon_abc V_cb,k, (..., 3, n)."""
    rows = [V[..., 2, 1, :] - V[..., 1, 2, :], V[..., 0, 2, :] - V[..., 2, 0, :], V[..., 1, 0, :] - V[..., 0, 1, :]]
    return np.stack(rows, axis=-2)


@dataclass(frozen=True, eq=False)
class Placed:
    """A body at one time."""

    c: Array  #: centre of mass, ground axes, (3,)
    p: Array  #: Euler parameters, (4,)
    R: Array  #: (3, 3)
    q: Array
    v: Array  #: velocity of the centre of mass, ground axes, (3,)
    omega: Array  #: body axes, (3,)
    q_dot: Array


def placed_bodies(bodies: tuple[Body, ...], model: Model, state: State) -> list[Placed]:
    """Return the bodies of a state, by their centres of mass."""
    placed = []
    for i, body in enumerate(bodies):
        R = rotation_matrix(state.p[i])
        u = state.u[model.bodies.u0[i] : model.bodies.u0[i + 1]]
        q, q_dot, omega = state.q[model.bodies.q0[i] : model.bodies.q0[i + 1]], u[6:], u[3:6]
        c = state.r[i] + R @ body.center(q)
        v = u[:3] + R @ body.drift(q, omega, q_dot)
        placed.append(Placed(c, state.p[i], R, q, v, omega, q_dot))
    return placed


def state_of(bodies: tuple[Body, ...], placed: list[Placed]) -> State:
    """Return the state of placed bodies."""
    r, u = [], []
    for body, place in zip(bodies, placed, strict=True):
        r.append(place.c - place.R @ body.center(place.q))
        v = place.v - place.R @ body.drift(place.q, place.omega, place.q_dot)
        u.append(np.concatenate([v, place.omega, place.q_dot]))
    q = np.concatenate([*(place.q for place in placed), np.zeros(0)])
    return State(np.array(r), np.array([place.p for place in placed]), q, np.concatenate(u))


@dataclass(frozen=True, eq=False)
class BodyStep:
    """A body between two configurations, (stacks of) the increments d, theta, dq.

    The schemes' forces act along the way between `R_0`, `q_0` and `R_1`, `q_1`; a variational scheme takes forces at
    one configuration, for which both are the same and the increments are those of the motion through it.
    """

    c_0: Array
    c_1: Array
    R_0: Array
    R_1: Array
    q_0: Array
    q_1: Array
    R_m: Array  #: R_0 (1 + tilde(theta)/2); R_0 at one configuration
    d: Array  #: displacement of the centre of mass, ground axes, (..., 3)
    theta_G: Array  # noqa: N815  #: Cayley vector of the rotation, ground axes, (..., 3)
    dq: Array  #: (..., n)


def step_of(place: Placed, x: Array) -> BodyStep:
    """Return the step of a body by x = (d, theta, dq), (..., 6 + n)."""
    d, theta, dq = x[..., :3], x[..., 3:6], x[..., 6:]
    turning = cayley(theta)
    half = np.stack([e + 0.5 * cross(theta, np.broadcast_to(e, theta.shape)) for e in np.eye(3)], axis=-1)
    return BodyStep(
        c_0=place.c,
        c_1=place.c + d,
        R_0=place.R,
        R_1=place.R @ turning,
        q_0=place.q,
        q_1=place.q + dq,
        R_m=place.R @ half,
        d=d,
        theta_G=theta @ place.R.T,
        dq=dq,
    )


def still(place: Placed, x: Array) -> BodyStep:
    """Return the configuration of a placed body as both ends of a step, with increments x, (..., 6 + n).

    Its angular velocity is that of the momentum of the interval, (1 + theta²/4) theta/h (exactly, for turns about a
    principal axis).
    """
    d, theta, dq = x[..., :3], x[..., 3:6], x[..., 6:]
    turn = (1 + 0.25 * dot(theta, theta))[..., None] * theta
    return BodyStep(place.c, place.c, place.R, place.R, place.q, place.q, place.R, d, turn @ place.R.T, dq)


def moved(place: Placed, x: Array, v: Array, omega: Array, q_dot: Array) -> Placed:
    """Return a body after a step x, (6 + n,), with given velocities."""
    p = cayley_parameters(place.p, x[3:6])
    return Placed(place.c + x[:3], p, rotation_matrix(p), place.q + x[6:], v, omega, q_dot)
