"""A variational integrator: the motion that makes the sum of discrete Lagrangians stationary.

Evaluated in `floatframe.engine.structure_preserving.kernels.steps`.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.structure_preserving.bodies import BodyStep, CentralBody, Placed, moved, still
from floatframe.engine.structure_preserving.constraints import Span
from floatframe.engine.structure_preserving.kernels.records import VARIATIONAL
from floatframe.engine.structure_preserving.markers import Load
from floatframe.engine.structure_preserving.newton import Solution, StepError, ends_of, remembered, solve_step, work_of
from floatframe.engine.structure_preserving.system import DiscreteSystem
from floatframe.errors import ModelError
from floatframe.integrators.carry import Carry
from floatframe.integrators.discrete_run import DiscreteScheme, StepResult, check_options
from floatframe.model.rotations import cross, dot, turned
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Variational"]


@dataclass(frozen=True)
class Variational(DiscreteScheme):
    """Symplectic, momentum exact, energy bounded without drift, joints closed in positions and velocities, order two.

    Coordinates of the centre of mass c, R_GB, q (discrete/bodies.py). Between two configurations with
    R' = R cay(theta), by the midpoint rule in q and the trapezoidal rule in the potential V of gravity and springs,

        L_d = h (m |d/h|²/2 + T(theta/h, dq/h; mean q) - mean(q)ᵀ K mean(q)/2) - h (V + V')/2
        d = c' - c,  dq = q' - q,  Pi = J omega + B q_dot and Y = Bᵀ omega + M q_dot at theta/h, dq/h, mean q

    (1) m v + h/2 F = m d/h,   Pi_0 + h/2 Rᵀ tau = (1 + tilde(theta)/2 + theta thetaᵀ/4) Pi
        Y_0 + h/2 Q = Y - h/2 (1/2 wᵀ M,k w - K mean(q) - D dq/h),   g(t') = 0
    (2) the same at the end, Pi_0' = (1 - tilde(theta)/2 + theta thetaᵀ/4) Pi + h/2 R'ᵀ tau', ... with G u' = -g_t

    Momenta with index 0 are those of the results, velocities follow from them. The joints act like forces at both ends,
    with one multiplier that closes positions and one that closes velocities (RATTLE). Discrete Euler-Poincare
    equations and the Cayley map: [1]_; constraints: [2]_; dampers enter by the discrete Lagrange-d'Alembert principle.
    The modal stiffness stands in the implicit midpoint, so that stiff modes do not bound h; stiff spring-dampers do.

    Friction by the normal force of a joint is refused.

    References
    ----------
    .. [1] Bou-Rabee & Marsden (2009), Foundations of Computational Mathematics 9, 197-219.
    .. [2] Leyendecker, Marsden & Ortiz (2008), Journal of Applied Mathematics and Mechanics (ZAMM) 88, 677-708.
    """

    tolerance: float = 1e-11  #: largest last correction over the increments of the step
    max_iterations: int = 25

    def __post_init__(self) -> None:
        check_options(self)

    def start(self, system: System, t: float, state: State | None = None, before: Carry | None = None) -> Carry:
        """Return the memory at the beginning, from a consistent state."""
        for force in system.forces:
            if getattr(force, "friction_coefficient", 0.0) > 0:
                raise ModelError(
                    f"Variational: force {getattr(force, 'name', '')!r} has friction by the normal force, which this "
                    "scheme does not know; use energy-momentum or generalized-alpha"
                )
        return super().start(system, t, state, before)

    @property
    def equations(self) -> int:
        """Kind of equations: `VARIATIONAL`."""
        return VARIATIONAL

    def one_step(self, ds: DiscreteSystem, placed: list[Placed], span: Span, f: Array) -> StepResult:
        """(1), (2): return the bodies, multipliers and work after a step."""
        scheme = VariationalScheme()
        angles = span.angle, span.angle_rate
        begin = Span(span.t_0, span.t_1, span.t_0, span.w, *angles)
        solution = solve_step(ds, scheme, placed, begin, f, self.tolerance, self.max_iterations)
        given, taken = work_of(ds, scheme, placed, begin, solution)
        at_end = Span(span.t_0, span.t_1, span.t_1, remembered(ds, placed, span, solution), *angles)
        after, f_after = closed_velocities(ds, placed, at_end, solution)
        end = Solution(solution.x, f_after, solution.dz, solution.n_iterations)
        given_after, taken_after = work_of(ds, scheme, after, at_end, end)
        work = 0.5 * (given + given_after), 0.5 * (taken + taken_after)
        return StepResult(after, solution.f, work, solution.n_iterations, at_end.w)


@dataclass(frozen=True, eq=False)
class VariationalScheme:
    """(1) of one body, as `discrete.newton.Scheme`."""

    acts_along: bool = False

    def inertia(self, body: CentralBody, place: Placed, x: Array, h: float) -> Array:
        """H times the right sides of (1) without loads, minus the momenta at the beginning."""
        d, theta = x[..., :3], x[..., 3:6]
        Pi_0, Y_0 = body.momenta(place.q, place.omega, place.q_dot)
        Pi, Y, force = interval(body, place, x, h)
        turning = Pi + 0.5 * cross(theta, Pi) + 0.25 * dot(theta, Pi)[..., None] * theta - Pi_0
        return np.concatenate(
            [body.m * (d - h * place.v), h * turning, h * (Y - Y_0) - 0.5 * h**2 * force], axis=-1
        )  # fmt: skip

    def force_step(self, place: Placed, x: Array) -> BodyStep:
        """Forces act at the start of the step."""
        return still(place, x)

    def torque(self, place: Placed, x: Array, tau: Array) -> Array:
        """Rᵀ tau."""
        return turned(place.R.T, tau)


def interval(body: CentralBody, place: Placed, x: Array, h: float) -> tuple[Array, Array, Array]:
    """Return Pi and Y between two configurations, and the modal force there."""
    omega, q_dot = x[..., 3:6] / h, x[..., 6:] / h
    q = place.q + 0.5 * x[..., 6:]
    Pi, Y = body.momenta(q, omega, q_dot)
    return Pi, Y, body.inertia_force(q, q, (omega, q_dot), (omega, q_dot)) - q @ body.K.T - q_dot @ body.D.T


def closed_velocities(
    ds: DiscreteSystem, placed: list[Placed], end: Span, solution: Solution
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


def mass_matrix(body: CentralBody, q: Array) -> Array:
    """Return the matrix of (v, omega, q_dot) about the centre of mass, (6 + n, 6 + n)."""
    M = np.zeros((6 + body.n, 6 + body.n))
    M[:3, :3] = body.m * np.eye(3)
    M[3:, 3:] = body.mass_matrix(q)
    return M
