"""Derivatives of generalized-alpha steps: exact derivatives of the computed motion, including its time discretisation.

With S = (x, u, u_dot, a) after a step, x varied along displacements (docs/theory.md §9), a step with the increment xi
and the unknowns (xi, c_k w), c_k = beta h², is

    (1) c_k r(x_1, u_1, u_dot_1, w, p) = 0,   g(x_1, u_1, w, p) = 0
    (2) x_1 = x_0 (+) xi:  dx_1 = A dx_0 + T dxi,  A = exp(-xi_theta), T its right Jacobian, on rotations
    (3) a_1, u_1, u_dot_1 linear in xi and S_0

Direct method: the derivative of (1) is solved for the columns dxi of all parameters, and (2) and (3) give the next
state. Adjoint method: the transposed equations are solved backwards in time, with one right-hand side per output. Both
use the same matrices, so that their results agree to rounding errors.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.linear_algebra.lu_factors import solve_factored
from fe_models.foundation.arrays import Array
from floatframe.design.gradients.outputs import vector_of
from floatframe.design.gradients.parameters import Family, Neighbour
from floatframe.design.gradients.tangents import Point, PointTangents, in_blocks, tangents_at
from floatframe.engine.initial_conditions.initial import (
    assembled,
    checked,
    solve_accelerations,
    with_compatible_velocities,
)
from floatframe.engine.kernels.memory import Memory, memory_at
from floatframe.engine.kernels.work import new_work
from floatframe.engine.open_equations.configuration import Configurations
from floatframe.engine.open_equations.rows import Structure
from floatframe.errors import ConvergenceError, ModelError
from floatframe.integrators.generalized_alpha import GeneralizedAlpha
from floatframe.model.rotations import rotation_exp
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["ComputedMotion", "Step", "adjoint_gradient", "computed_motion", "direct_columns", "start_columns"]


@dataclass(frozen=True, eq=False)
class ComputedMotion:
    """The computed motion: a point and a memory after each step, beginning with the start."""

    method: GeneralizedAlpha
    h: float
    memories: tuple[Memory, ...]
    points: tuple[Point, ...]

    @property
    def c_k(self) -> float:
        """The factor beta h² of the increments."""
        return self.method.coefficients[2] * self.h**2


def computed_motion(
    system: System, method: GeneralizedAlpha, t_start: float, h: float, n_steps: int, state: State | None
) -> ComputedMotion:
    """Return the steps of a run, identical to those of `integrate`.

    Raises
    ------
    ConvergenceError
        If a step fails.
    """
    from floatframe.engine.compiling.system import compiled_system

    work = new_work(compiled_system(system).model)
    # results begin with the start; the steps begin with velocities shifted by O(h²)
    begun = method.start(system, t_start, state)
    memory = method.prepared(system, begun, h, t_start)
    memories, points = [memory], [Point(t_start, begun.state, begun.u_dot, begun.w, angle=begun.angle)]
    for k in range(n_steps):
        after, _, _, failure = method.advance(system, memory, work, t0=t_start, h=h, first=k, n_steps=1, every=2)
        t = t_start + (k + 1) * h
        if failure is not None:
            words = f"sensitivities: the step of {h:g} to t = {t:g} failed: {failure.words}"
            raise ConvergenceError(words, t=t - h, h=h, residual=failure.residual)
        points.append(Point(t, after.state, after.u_dot, after.w, memory.w, after.angle))
        memories.append(after)
        memory = after
    return ComputedMotion(method, h, tuple(memories), tuple(points))


def start_columns(
    family: Family, group: Configurations, own: Neighbour, motion: ComputedMotion, t_start: float, state: State | None
) -> tuple[Array, Array]:
    """Return derivatives by p of the start state S, (4 n_u, n_p), and of (x, u, u_dot, w), (3 n_u + n_w, n_p).

    The second is the state with which the results begin. Both are finite differences of the complete consistent start.
    """
    x_0 = vector_of(group, own.compiled, motion.points[0].state)
    S, shown = [], []
    for parameter in family.parameters:
        of_S, of_shown = [], []
        for each in parameter.around:
            begun = begun_beside(each, t_start, state)
            memory = motion.method.prepared(each.system, begun, motion.h, t_start)
            dx = group.difference(x_0, vector_of(group, each.compiled, memory.state))
            of_S.append(np.concatenate([dx, memory.state.u, memory.u_dot, memory.a]))
            dx = group.difference(x_0, vector_of(group, each.compiled, begun.state))
            of_shown.append(np.concatenate([dx, begun.state.u, begun.u_dot, begun.w]))
        S.append(parameter.derivative(of_S))
        shown.append(parameter.derivative(of_shown))
    return np.array(S).T, np.array(shown).T


def begun_beside(each: Neighbour, t: float, state: State | None) -> Memory:
    """Return the start of `GeneralizedAlpha` for a neighbouring system, without the checks that the system passed."""
    compiled, work = each.compiled, each.work
    given = compiled.placed if state is None else checked(compiled, state)
    work.state.time[...] = t
    closed = with_compatible_velocities(compiled, work, assembled(compiled, work, given))
    return memory_at(closed, *solve_accelerations(compiled, work, closed))


class ScaledSolver:
    """LU factors of a matrix with scaled rows and columns, so that units cost no accuracy, and one refinement step."""

    def __init__(self, matrix: Array, t: float) -> None:
        """Factorise the matrix; `ModelError` if it is singular."""
        self.matrix = matrix
        with np.errstate(divide="ignore"):
            self.rows = 1 / np.abs(matrix).max(axis=1)
            self.columns = 1 / np.abs(self.rows[:, None] * matrix).max(axis=0)
        if not (np.isfinite(self.rows).all() and np.isfinite(self.columns).all()):
            raise ModelError(f"sensitivities: the Newton matrix at t = {t:g} is singular")
        self.lu = la.lu_factor(self.rows[:, None] * matrix * self.columns)

    def solve(self, right: Array, *, is_transposed: bool = False) -> Array:
        """Return the solution of A x = right, or of Aᵀ x = right, with one refinement step."""
        matrix = self.matrix.T if is_transposed else self.matrix
        x = self.once(right, is_transposed)
        return x + self.once(right - matrix @ x, is_transposed)

    def once(self, right: Array, is_transposed: bool) -> Array:
        """Return the solution without refinement."""
        if is_transposed:
            return self.rows[:, None] * solve_factored(self.lu, self.columns[:, None] * right, is_transposed=True)
        return self.columns[:, None] * solve_factored(self.lu, self.rows[:, None] * right)


class Step:
    """One time step, linearised at its end."""

    def __init__(self, structure: Structure, own: Neighbour, group: Configurations, motion: ComputedMotion, k: int):
        """Linearise step k of a motion, from point k to point k + 1."""
        alpha_m, alpha_f, beta, gamma = motion.method.coefficients
        h, before, after = motion.h, motion.memories[k], motion.memories[k + 1]
        self.n, self.c_k = group.n_v, motion.c_k
        self.point = motion.points[k + 1]
        xi = h * before.state.u + h**2 * ((0.5 - beta) * before.a + beta * after.a)
        self.T, self.A = group.tangent(xi), group.by_bodies(xi, lambda theta: rotation_exp(-theta))
        m = (1 - alpha_m) / (1 - alpha_f)
        # coefficients of dxi, du_0, du_dot_0, da_0 in (3)
        self.of_a = 1 / (beta * h**2), -1 / (beta * h), 0.0, -(0.5 - beta) / beta
        self.of_u = linear((0.0, 1.0, 0.0, h * (1 - gamma)), gamma * h, self.of_a)
        self.of_u_dot = linear((0.0, 0.0, -alpha_f / (1 - alpha_f), alpha_m / (1 - alpha_f)), m, self.of_a)
        self.at: PointTangents = tangents_at(structure, own.compiled.model, own.work, self.point, self.c_k)
        by_xi = self.at.K @ self.T + self.of_u[0] * self.at.C + self.of_u_dot[0] * self.at.M
        rows = self.at.G_x @ self.T + self.of_u[0] * self.at.G_v
        self.solver = ScaledSolver(np.block([[by_xi, -self.at.J.T], [rows, self.at.V]]), self.point.t)

    def forward(self, S: Array, by_p: Array) -> tuple[Array, Array]:
        """Return dS_1, (4 n_u, n_p), and dw, (n_w, n_p), from dS_0 and the derivatives of residual and rows by p."""
        x, u, u_dot, a = np.split(S, 4)
        moved_x = self.A @ x
        u_known = self.of_u[1] * u + self.of_u[2] * u_dot + self.of_u[3] * a
        u_dot_known = self.of_u_dot[1] * u + self.of_u_dot[2] * u_dot + self.of_u_dot[3] * a
        at = self.at
        bodies = at.K @ moved_x + at.C @ u_known + at.M @ u_dot_known
        rows = at.G_x @ moved_x + at.G_v @ u_known
        z = self.solver.solve(-(np.vstack([bodies, rows]) + by_p))
        xi, mu = z[: self.n], z[self.n :]
        a_1 = self.of_a[0] * xi + self.of_a[1] * u + self.of_a[3] * a
        S_1 = [moved_x + self.T @ xi, self.of_u[0] * xi + u_known, self.of_u_dot[0] * xi + u_dot_known, a_1]
        return np.vstack(S_1), mu / self.c_k

    def backward(self, S_bar: Array, w_bar: Array) -> tuple[Array, Array]:
        """Return the adjoint of S_0, (4 n_u, n_out), and that of the residuals, (n_u + n_w, n_out).

        This is the transpose of `forward`, line by line.
        """
        x, u, u_dot, a = np.split(S_bar, 4)
        xi = self.T.T @ x + self.of_u[0] * u + self.of_u_dot[0] * u_dot + self.of_a[0] * a
        eta = -self.solver.solve(np.vstack([xi, w_bar / self.c_k]), is_transposed=True)
        bodies, rows = eta[: self.n], eta[self.n :]
        at = self.at
        moved_x = x + at.K.T @ bodies + at.G_x.T @ rows
        u_known = u + at.C.T @ bodies + at.G_v.T @ rows
        u_dot_known = u_dot + at.M.T @ bodies
        return np.vstack(
            [
                self.A.T @ moved_x,
                self.of_u[1] * u_known + self.of_u_dot[1] * u_dot_known + self.of_a[1] * a,
                self.of_u[2] * u_known + self.of_u_dot[2] * u_dot_known,
                self.of_u[3] * u_known + self.of_u_dot[3] * u_dot_known + self.of_a[3] * a,
            ]
        ), eta


def linear(own: tuple[float, ...], factor: float, of_a: tuple[float, ...]) -> tuple[float, ...]:
    """Return own + factor * of_a, coefficient by coefficient."""
    return tuple(x + factor * y for x, y in zip(own, of_a, strict=True))


def direct_columns(
    family: Family, structure: Structure, own: Neighbour, group: Configurations, motion: ComputedMotion,
    S: Array, shown: Array, keep: set[int],
) -> dict[int, Array]:  # fmt: skip
    """Return d(x, u, u_dot, w)/dp, (3 n_u + n_w, n_p), at the points to keep."""
    n = group.n_v
    kept = {0: shown} if 0 in keep else {}
    points = motion.points[1 : max(keep, default=0) + 1]
    for k, (_, by_p) in enumerate(in_blocks(family.parameters, points, motion.c_k)):
        S, w = Step(structure, own, group, motion, k).forward(S, by_p)
        if k + 1 in keep:
            kept[k + 1] = np.vstack([S[: 3 * n], w])
    return kept


def adjoint_gradient(
    family: Family, structure: Structure, own: Neighbour, group: Configurations, motion: ComputedMotion,
    S: Array, shown: Array, slopes: dict[int, Array],
) -> Array:  # fmt: skip
    """Return the gradient of outputs through the motion, (n_out, n_p).

    slopes: derivatives of the outputs by (x, u, u_dot, w) at point k, (n_out, 3 n_u + n_w).
    """
    n, n_w, n_out = group.n_v, len(structure.holds), len(next(iter(slopes.values())))
    S_bar, gradient = np.zeros((4 * n, n_out)), np.zeros((n_out, len(family.parameters)))
    last = max(slopes)
    points = motion.points[1 : last + 1][::-1]
    for k, (_, by_p) in zip(range(last, 0, -1), in_blocks(family.parameters, points, motion.c_k), strict=True):
        w_bar = np.zeros((n_w, n_out))
        if k in slopes:
            S_bar[: 3 * n] += slopes[k][:, : 3 * n].T
            w_bar = slopes[k][:, 3 * n :].T
        S_bar, eta = Step(structure, own, group, motion, k - 1).backward(S_bar, w_bar)
        gradient += eta.T @ by_p
    if 0 in slopes:
        gradient += slopes[0] @ shown
    return gradient + S_bar.T @ S
