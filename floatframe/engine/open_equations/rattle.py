"""An example of an integrator based on the open equations: RATTLE, symplectic, second order.

For systems with constant mass matrix and forces that do not depend on velocities: bodies that translate, or rotate in a
plane about their centres of mass (which must be the origins of rigid bodies), and springs [1]_:

    (1) half a kick:  M v_h = M v + h/2 (f(x) + Gᵀ lam),   x_1 = x (+) h v_h,   with lam such that g(x_1) = 0
    (2) half a kick:  M v_1 = M v_h + h/2 (f(x_1) + G_1ᵀ mu),   with mu such that G_1 v_1 = 0

References
----------
.. [1] Andersen (1983), Journal of Computational Physics 52, 24-34.
"""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.open_equations.system_equations import Equations
from floatframe.errors import ConvergenceError, ModelError

__all__ = ["rattle"]


def rattle(eq: Equations, x: Array, v: Array, times: Array, *, tolerance: float = 1e-13) -> tuple[Array, Array]:
    """Return x and v at all times, (n_t, n_x) and (n_t, n_v), from consistent x, v at the first.

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
