"""One step of the conserving, decaying and variational schemes, as `floatframe.integrators` describes them."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.structure_preserving.compiled import Filter, filter_of
from floatframe.integrators import EnergyDecaying, EnergyMomentum, Variational
from floatframe.model.rotations import cross, dot, rotated
from tests.floatframe.engine.structure_preserving.in_python.bodies import Body, BodyStep, Placed, moved, step_of, still
from tests.floatframe.engine.structure_preserving.in_python.constraints import Span
from tests.floatframe.engine.structure_preserving.in_python.markers import Load
from tests.floatframe.engine.structure_preserving.in_python.newton import (
    Solution,
    StepError,
    ends_of,
    remembered,
    solve_step,
    work_of,
)
from tests.floatframe.engine.structure_preserving.in_python.system import StepSystem

Method = EnergyDecaying | EnergyMomentum | Variational


@dataclass(frozen=True, eq=False)
class StepResult:
    """The bodies after a step, and what happened over it."""

    placed: list[Placed]
    f: Array  #: multipliers of the joints, (n_held,)
    work: tuple[float, float]  #: that entered; taken by dampers and friction
    n_iterations: int
    w: Array  #: what connections remember, (n_w,), see `Span`


def one_step(method: Method, ds: StepSystem, placed: list[Placed], span: Span, f: Array) -> StepResult:
    """Return the bodies, multipliers and work after a step; `StepError` if it fails."""
    if isinstance(method, Variational):
        return variational_step(method, ds, placed, span, f)
    return conserving_step(ds, placed, span, f, method.damping, method.tolerance, method.max_iterations)


def variational_step(method: Variational, ds: StepSystem, placed: list[Placed], span: Span, f: Array) -> StepResult:
    """(1), (2): return the bodies, multipliers and work after a step."""
    scheme = VariationalScheme()
    angles = span.angle, span.angle_rate
    begin = Span(span.t_0, span.t_1, span.t_0, span.w, *angles)
    solution = solve_step(ds, scheme, placed, begin, f, method.tolerance, method.max_iterations)
    given, taken = work_of(ds, scheme, placed, begin, solution)
    at_end = Span(span.t_0, span.t_1, span.t_1, remembered(ds, placed, span, solution), *angles)
    after, f_after = closed_velocities(ds, placed, at_end, solution)
    end = Solution(solution.x, f_after, solution.dz, solution.n_iterations)
    given_after, taken_after = work_of(ds, scheme, after, at_end, end)
    work = 0.5 * (given + given_after), 0.5 * (taken + taken_after)
    return StepResult(after, solution.f, work, solution.n_iterations, at_end.w)


@dataclass(frozen=True, eq=False)
class VariationalScheme:
    """(1) of one body, as `newton.Scheme`."""

    acts_along: bool = False

    def inertia(self, body: Body, place: Placed, x: Array, h: float) -> Array:
        """Return h times the right sides of (1) without loads, minus the momenta at the beginning."""
        d, theta = x[..., :3], x[..., 3:6]
        Pi_0, Y_0 = body.momenta(place.q, place.omega, place.q_dot)
        Pi, Y, force = interval(body, place, x, h)
        turning = Pi + 0.5 * cross(theta, Pi) + 0.25 * dot(theta, Pi)[..., None] * theta - Pi_0
        return np.concatenate(
            [body.m * (d - h * place.v), h * turning, h * (Y - Y_0) - 0.5 * h**2 * force], axis=-1
        )  # fmt: skip

    def force_step(self, place: Placed, x: Array) -> BodyStep:
        """Forces act where the step begins."""
        return still(place, x)

    def torque(self, place: Placed, x: Array, tau: Array) -> Array:
        """Rᵀ tau."""
        return rotated(place.R.T, tau)


def interval(body: Body, place: Placed, x: Array, h: float) -> tuple[Array, Array, Array]:
    """Return Pi and Y between two configurations, and the modal force there."""
    omega, q_dot = x[..., 3:6] / h, x[..., 6:] / h
    q = place.q + 0.5 * x[..., 6:]
    Pi, Y = body.momenta(q, omega, q_dot)
    return Pi, Y, body.inertia_force(q, q, (omega, q_dot), (omega, q_dot)) - q @ body.K.T - q_dot @ body.D.T


def closed_velocities(
    ds: StepSystem, placed: list[Placed], end: Span, solution: Solution
) -> tuple[list[Placed], Array]:
    """(2): return the bodies at the end of a step with the momenta that close the joints, and the multipliers."""
    h, model = end.h, ds.model
    zeros = [np.zeros_like(x) for x in solution.x]
    moved_to = [moved(place, x, zero[:3], zero[3:6], zero[6:])
                for place, x, zero in zip(placed, solution.x, zeros, strict=True)]  # fmt: skip
    steps = [still(place, x) for place, x in zip(moved_to, solution.x, strict=True)]
    at = dict(enumerate(steps))
    loads = [Load(body.n, (), float) for body in ds.bodies]
    nothing = np.zeros(ds.n_held)
    for i, load in enumerate(loads):
        ds.own_loads(i, steps[i], load, end)
    for c in ds.connections:
        f, dz = nothing[c.first : c.first + len(c.held)], np.zeros(len(c.states))
        ds.connection_loads(c, ends_of(ds, c, at, dict(enumerate(loads)), end), end, f, dz, is_middle=False)
    momenta, masses = [], []
    for body, place, after, x, load in zip(ds.bodies, placed, moved_to, solution.x, loads, strict=True):
        Pi, Y, force = interval(body, place, x, h)
        theta = x[3:6]
        turning = Pi - 0.5 * np.cross(theta, Pi) + 0.25 * (theta @ Pi) * theta + 0.5 * h * after.R.T @ load.torque
        modal = Y + 0.5 * h * (force + load.modal)
        momenta.append(np.concatenate([body.m * x[:3] / h + 0.5 * h * load.force, turning, modal]))
        masses.append(mass_matrix(body, after.q))
    n_u = int(model.bodies.u0[-1])
    G, rate = np.zeros((ds.n_held, n_u)), np.zeros(ds.n_held)
    for c in ds.connections:
        for j, k in enumerate(c.held, start=c.first):
            parts = {i: Load(ds.bodies[i].n, (), float) for i in c.bodies}
            ends = ends_of(ds, c, at, parts, end)
            ds.add_row(c, k, ends, end, np.array(1.0))
            for i, part in parts.items():
                own = np.concatenate([part.force, moved_to[i].R.T @ part.torque, part.modal])
                G[j, model.bodies.u0[i] : model.bodies.u0[i + 1]] = own
            rate[j] = ds.rate_in_time(k, ends, end.t_1)
    u, X = np.zeros(n_u), np.zeros((n_u, ds.n_held))
    for i, (M, p) in enumerate(zip(masses, momenta, strict=True)):
        rows = slice(int(model.bodies.u0[i]), int(model.bodies.u0[i + 1]))
        u[rows] = np.linalg.solve(M, p)
        X[rows] = np.linalg.solve(M, G[:, rows].T)
    held = [k for c in ds.connections for k in c.held]
    soft = np.diag(model.rows.soft[held])
    try:
        impulse = np.linalg.solve(G @ X + soft, -(rate + G @ u)) if ds.n_held else nothing
    except np.linalg.LinAlgError:
        raise StepError("the constraints on velocities depend on each other", np.inf) from None
    u = u + X @ impulse
    result = []
    for i, (place, x) in enumerate(zip(placed, solution.x, strict=True)):
        own = u[model.bodies.u0[i] : model.bodies.u0[i + 1]]
        result.append(moved(place, x, own[:3], own[3:6], own[6:]))
    return result, np.asarray(2 * impulse / h, dtype=float)


def mass_matrix(body: Body, q: Array) -> Array:
    """Return the matrix of (v, omega, q_dot) about the centre of mass, (6 + n, 6 + n)."""
    M = np.zeros((6 + body.n, 6 + body.n))
    M[:3, :3] = body.m * np.eye(3)
    M[3:, 3:] = body.mass_matrix_at(q)
    return M


@dataclass(frozen=True, eq=False)
class ConservingScheme:
    """Equations (1) to (4) of one body, as `newton.Scheme`; `filters` for bodies with dissipation."""

    filters: dict[int, Filter]
    acts_along: bool = True

    def rates(self, body: Body, place: Placed, x: Array, h: float) -> tuple[Array, Array]:
        """(1): return omega and q_dot at the end of a step, for stacks of increments."""
        theta, dq = x[..., 3:6], x[..., 6:]
        omega = 2 * theta / h - place.omega
        q_dot: Array = 2 * dq / h - place.q_dot
        made = self.filters.get(id(body))
        if made is not None:
            Pi_0, Y_0 = body.momenta(place.q, place.omega, place.q_dot)
            Pi_1, Y_1 = body.momenta(place.q + dq, omega, q_dot)
            rate = ((Y_1 - Y_0) - (Pi_1 - Pi_0) @ made.E) @ made.F.T
            omega, q_dot = omega + 2 * rate @ made.E.T, q_dot - 2 * rate
        return omega, q_dot

    def inertia(self, body: Body, place: Placed, x: Array, h: float) -> Array:
        """h/2 times the left sides of (2) to (4) without loads."""
        d, theta, dq = x[..., :3], x[..., 3:6], x[..., 6:]
        omega, q_dot = self.rates(body, place, x, h)
        Pi_0, Y_0 = body.momenta(place.q, place.omega, place.q_dot)
        Pi_1, Y_1 = body.momenta(place.q + dq, omega, q_dot)
        turning = Pi_1 + 0.5 * cross(theta, Pi_1) - Pi_0 + 0.5 * cross(theta, np.broadcast_to(Pi_0, theta.shape))
        parts = [body.m * (d - h * place.v), 0.5 * h * turning]
        q_mean = place.q + 0.5 * dq
        w_0 = (np.broadcast_to(place.omega, theta.shape), np.broadcast_to(place.q_dot, dq.shape))
        force = body.inertia_force(place.q, place.q + dq, w_0, (omega, q_dot)) - dq @ body.D.T / h
        made = self.filters.get(id(body))
        force = force - (q_mean if made is None else q_mean + dq @ made.X.T) @ body.K.T
        parts.append(0.5 * h * (Y_1 - Y_0) - 0.5 * h**2 * force)
        return np.concatenate(parts, axis=-1)

    def force_step(self, place: Placed, x: Array) -> BodyStep:
        """Forces act along the step."""
        return step_of(place, x)

    def torque(self, place: Placed, x: Array, tau: Array) -> Array:
        """(1 - tilde(theta)/2) R_0ᵀ tau: (3) times (1 - tilde(theta)/2) R_0ᵀ, which makes it polynomial."""
        tau = rotated(place.R.T, tau)
        return tau - 0.5 * cross(x[..., 3:6], tau)


def conserving_step(
    ds: StepSystem,
    placed: list[Placed],
    span: Span,
    f: Array,
    rho_inf: float,
    tolerance: float,
    max_iterations: int,
) -> StepResult:
    """Return the bodies, multipliers and work after a step of the conserving or decaying scheme."""
    h = span.h
    filters = {}
    if rho_inf < 1.0:
        filters = {id(body): filter_of(body, h, rho_inf) for body in set(ds.bodies) if body.n}
    scheme = ConservingScheme(filters)
    solution = solve_step(ds, scheme, placed, span, f, tolerance, max_iterations)
    after = []
    for body, place, x in zip(ds.bodies, placed, solution.x, strict=True):
        omega, q_dot = scheme.rates(body, place, x, h)
        after.append(moved(place, x, 2 * x[:3] / h - place.v, omega, q_dot))
    work, w = work_of(ds, scheme, placed, span, solution), remembered(ds, placed, span, solution)
    return StepResult(after, solution.f, work, solution.n_iterations, w)
