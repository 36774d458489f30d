"""An example of an integrator based on the open equations: Radau IIA with three stages, fifth order.

For the index-two form M a = f + Gᵀ lam, G v = g_1 [1]_, with stages i at t + c_i h and coefficients A of the method:

    v_i = v + h Σ A_ij a_j,   x_i = x (+) D_i,   D_i = h Σ A_ij T(D_j)⁻¹ v_j       (Munthe-Kaas' local coordinates [2]_)

The unknowns are the accelerations and multipliers of the stages. The last stage is the end of the step.

References
----------
.. [1] Hairer, Lubich & Roche (1989), The numerical solution of differential-algebraic systems by Runge-Kutta methods.
.. [2] Munthe-Kaas (1999), Applied Numerical Mathematics 29, 115-127.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.open_equations.system_equations import Equations
from floatframe.errors import ConvergenceError

__all__ = ["radau"]

ROOT = np.sqrt(6.0)
C = np.array([(4 - ROOT) / 10, (4 + ROOT) / 10, 1.0])
A = np.linalg.solve(np.vander(C, 3, increasing=True).T, (np.vander(C, 4, increasing=True)[:, 1:] / [1, 2, 3]).T).T


def radau(eq: Equations, x: Array, v: Array, times: Array, *, tolerance: float = 1e-11) -> tuple[Array, Array, Array]:
    """Return x, v, lam at all times, (n_t, n_x), (n_t, n_v), (n_t, n_lam), from consistent x, v at the first.

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
        # these have the same order as x and v; those of the stages have order three
        a, lam = eq.accelerations(t + h, x, v)
        kept.append((x, v, lam))
    return tuple(np.array(part) for part in zip(*kept, strict=True))  # type: ignore[return-value]


def stage_rows(eq: Equations, t: float, h: float, x: Array, v: Array, stages: Array) -> tuple[Array, tuple]:
    """Return the residuals of all stages followed by their constraints, and x, v of the last stage."""
    a, lam = np.split(stages, [3 * eq.n_v])
    a, lam = a.reshape(3, eq.n_v), lam.reshape(3, eq.n_lam)
    v_i, group = v + h * A @ a, eq.configurations
    D = h * A @ v_i
    for _ in range(12):  # D is the fixed point of its own small equation, because rotations do not commute
        D, before = h * A @ np.array([group.inverse_tangent(d) @ w for d, w in zip(D, v_i, strict=True)]), D
        if np.abs(D - before).max() <= 1e-15 * max(np.abs(D).max(), 1.0):
            break
    x_i = [group.normalized(group.retract(x, d)) for d in D]
    at = list(zip(t + C * h, x_i, v_i, a, lam, strict=True))
    rows = [eq.residual(*stage) for stage in at] + [eq.velocity_defect(*stage[:3]) for stage in at]
    return np.concatenate(rows), (x_i[2], v_i[2])


def stage_matrix(eq: Equations, t: float, x: Array, v: Array, a: Array, lam: Array, h: float) -> Array:
    """Return the Newton matrix of the stages, with derivatives near the middle of the step for all stages."""
    t, x, v = t + h / 2, eq.configurations.retract(x, h / 2 * v + h**2 / 8 * a), v + h / 2 * a
    by, G = eq.tangents(t, x, v, a, lam), eq.jacobian(t, x)
    bodies = np.kron(np.eye(3), by.by_a) + h * np.kron(A, by.by_v) + h**2 * np.kron(A @ A, by.by_x)
    none = np.zeros((3 * eq.n_lam, 3 * eq.n_lam))
    return np.block([[bodies, -np.kron(np.eye(3), G.T)], [h * np.kron(A, G), none]])
