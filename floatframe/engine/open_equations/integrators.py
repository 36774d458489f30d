"""Example integrators that use the open equations: Radau IIA and Rattle."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.open_equations.system_equations import Equations
from floatframe.errors import ConvergenceError, ModelError

__all__ = ["radau", "rattle"]


# an example of an integrator based on the open equations: Radau IIA with three stages, fifth order --------------------
# For the index-two form M a = f + Gᵀ lam, G v = g_1 [1]_, with stages i at t + c_i h and coefficients A of the method:
#
# v_i = v + h Σ A_ij a_j,   x_i = x (+) D_i,   D_i = h Σ A_ij T(D_j)⁻¹ v_j       (Munthe-Kaas' local coordinates [2]_)
#
# The unknowns are the accelerations and multipliers of the stages. The last stage is the end of the step.
#
# References
# ----------
# .. [1] Hairer, Lubich & Roche (1989), The numerical solution of differential-algebraic systems by Runge-Kutta methods.
# .. [2] Munthe-Kaas (1999), Applied Numerical Mathematics 29, 115-127.


ROOT = np.sqrt(6.0)
C = np.array([(4 - ROOT) / 10, (4 + ROOT) / 10, 1.0])
A = np.linalg.solve(np.vander(C, 3, increasing=True).T, (np.vander(C, 4, increasing=True)[:, 1:] / [1, 2, 3]).T).T


def radau(eq: Equations, x: Array, v: Array, times: Array, *, tolerance: float = 1e-11) -> tuple[Array, Array, Array]:
    """Return x, v, lam at all times, (n_t, n_x), (n_t, n_v), (n_t, n_lam), from consistent initial x and v.

    Raises
    ------
    ModelError
        If an element can end a run (`stops`).
    ConvergenceError
        If Newton's method fails in a step.
    """
    eq.require_no_stops("radau")
    a, lam = eq.accelerations(times[0], x, v)
    kept = [(x, v, lam)]
    for t, h in zip(times[:-1], np.diff(times), strict=True):
        stages = np.concatenate([np.tile(a, 3), np.tile(lam, 3)])
        inverse = np.linalg.inv(stage_matrix(eq, t, x, v, a, lam, h))
        for _ in range(25):
            rows, ends = stage_rows(eq, t, h, x, v, stages)
            change = inverse @ rows
            stages = stages - change
            if np.abs(change).max() <= tolerance * max(np.abs(stages).max(), 1.0):
                break
        else:
            raise ConvergenceError("radau: Newton's method failed", t=t, h=h, residual=float(np.abs(change).max()))
        x, v = ends
        # this a and lam have the same order as x and v; the a and lam of the stages have order three
        a, lam = eq.accelerations(t + h, x, v)
        kept.append((x, v, lam))
    return tuple(np.array(part) for part in zip(*kept, strict=True))  # type: ignore[return-value]


def stage_rows(eq: Equations, t: float, h: float, x: Array, v: Array, stages: Array) -> tuple[Array, tuple]:
    """Return the residuals of all stages, then their constraints, and x and v of the last stage."""
    a, lam = np.split(stages, [3 * eq.n_v])
    a, lam = a.reshape(3, eq.n_v), lam.reshape(3, eq.n_lam)
    v_i, group = v + h * A @ a, eq.configurations
    D = h * A @ v_i
    for _ in range(12):  # D is found by fixed-point iteration: it depends on itself, as rotations do not commute
        D, before = h * A @ np.array([group.inverse_tangent(d) @ w for d, w in zip(D, v_i, strict=True)]), D
        if np.abs(D - before).max() <= 1e-15 * max(np.abs(D).max(), 1.0):
            break
    x_i = [group.normalized(group.retract(x, d)) for d in D]
    at = list(zip(t + C * h, x_i, v_i, a, lam, strict=True))
    rows = [eq.residual(*stage) for stage in at] + [eq.velocity_defect(*stage[:3]) for stage in at]
    return np.concatenate(rows), (x_i[2], v_i[2])


def stage_matrix(eq: Equations, t: float, x: Array, v: Array, a: Array, lam: Array, h: float) -> Array:
    """Return the Newton matrix of the stages; all stages use derivatives near the middle of the step."""
    t, x, v = t + h / 2, eq.configurations.retract(x, h / 2 * v + h**2 / 8 * a), v + h / 2 * a
    by, G = eq.tangents(t, x, v, a, lam), eq.jacobian(t, x)
    bodies = np.kron(np.eye(3), by.by_a) + h * np.kron(A, by.by_v) + h**2 * np.kron(A @ A, by.by_x)
    none = np.zeros((3 * eq.n_lam, 3 * eq.n_lam))
    return np.block([[bodies, -np.kron(np.eye(3), G.T)], [h * np.kron(A, G), none]])


# an example of an integrator based on the open equations: RATTLE, symplectic, second order ----------------------------
# For systems with constant mass matrix and forces that do not depend on velocities: bodies that translate, or rotate in
# a plane about their centres of mass (which must be the origins of rigid bodies), and springs [1]_:
#
#     (1) half a kick:  M v_h = M v + h/2 (f(x) + Gᵀ lam),   x_1 = x (+) h v_h,   with lam such that g(x_1) = 0
#     (2) half a kick:  M v_1 = M v_h + h/2 (f(x_1) + G_1ᵀ mu),   with mu such that G_1 v_1 = 0
#
# References
# ----------
# .. [1] Andersen (1983), Journal of Computational Physics 52, 24-34.


def rattle(eq: Equations, x: Array, v: Array, times: Array, *, tolerance: float = 1e-13) -> tuple[Array, Array]:
    """Return x and v at all times, (n_t, n_x) and (n_t, n_v), from consistent initial x and v.

    Raises
    ------
    ModelError
        If an element can end a run (`stops`), or if, during the motion, the mass matrix changes with the configuration
        or the forces with the velocity.
    ConvergenceError
        If the constraints cannot be satisfied.
    """
    eq.require_no_stops("rattle")
    M, group, kept = eq.mass(x), eq.configurations, [(x, v)]
    for t, h in zip(times[:-1], np.diff(times), strict=True):
        G, f, lam = eq.jacobian(t, x), eq.force(t, x, v), np.zeros(eq.n_lam)
        for _ in range(30):  # (1)
            v_h = v + np.linalg.solve(M, 0.5 * h * (f + G.T @ lam))
            x_1 = group.normalized(group.retract(x, h * v_h))
            gap, G_1 = eq.constraint(t + h, x_1), eq.jacobian(t + h, x_1)
            if np.abs(gap).max(initial=0.0) <= tolerance * eq.compiled.length:
                break
            lam = lam - np.linalg.solve(0.5 * h**2 * G_1 @ np.linalg.solve(M, G.T), gap)
        else:
            raise ConvergenceError("rattle: the constraints stay open", t=t, h=h, residual=float(np.abs(gap).max()))
        free = v_h + np.linalg.solve(M, 0.5 * h * eq.force(t + h, x_1, v_h))  # (2)
        mu = np.linalg.solve(G_1 @ np.linalg.solve(M, G_1.T), eq.velocity_right(t + h, x_1) - G_1 @ free)
        x, v = x_1, free + np.linalg.solve(M, G_1.T @ mu)
        kept.append((x, v))
    gyroscopic = eq.force(times[-1], x, v) - eq.force(times[-1], x, np.zeros_like(v))
    if np.abs(eq.mass(x) - M).max() > 1e-9 * np.abs(M).max() or np.abs(gyroscopic).max() > 1e-9 * np.abs(f).max():
        raise ModelError("rattle: expected a constant mass matrix and forces that do not depend on velocities")
    return tuple(np.array(part) for part in zip(*kept, strict=True))  # type: ignore[return-value]
