"""Time integration shared by the planar reference beams: constant mass, internal force f(x), prescribed dofs.

Generalized-alpha (Chung & Hulbert) for M a + f(x) = p(t) over the free dofs; prescribed dofs follow given functions of
time with their rates. Nothing here knows of frames, modes or multipliers.
"""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

SMALL = 150  # unknowns up to which dense matrices are faster
Motion = Callable[[float], tuple[float, float, float]]  # t -> value, rate, second rate


@dataclass
class Problem:
    """A discretised planar structure."""

    M: sp.csc_array
    force: Callable[[np.ndarray], tuple[np.ndarray, sp.csc_array]]  # x -> internal force and its derivative
    x0: np.ndarray
    prescribed: dict[int, Motion] = field(default_factory=dict)
    load: Callable[[float], np.ndarray] | None = None  # t -> external force
    v0: np.ndarray | None = None
    damping: sp.csc_array | None = None


@dataclass
class Solution:
    """Motion at all steps."""

    t: np.ndarray
    x: np.ndarray  # (n_t, n)
    v: np.ndarray
    a: np.ndarray


def rotation(phase: Callable[[float], tuple[float, float, float]], radius: float, offset: float = 0.0):
    """Return the motions of x and y of a point that goes round the origin with the angle `phase`."""

    def along(shift: float) -> Motion:
        def motion(t):
            angle, rate, acceleration = phase(t)
            c, s = np.cos(angle + offset + shift), np.sin(angle + offset + shift)
            return radius * c, -radius * s * rate, -radius * (s * acceleration + c * rate**2)

        return motion

    return along(0.0), along(-np.pi / 2)


def of_dofs(free: np.ndarray):
    """Return how to take the part of a matrix over these dofs, and how to solve with it: dense where that is faster."""
    if len(free) <= SMALL:
        return lambda A: A.toarray()[np.ix_(free, free)], np.linalg.solve
    return lambda A: sp.csc_array(A[free][:, free]), lambda S, r: splu(sp.csc_array(S)).solve(r)


def integrate(problem: Problem, t_end: float, h: float, *, rho_inf: float = 0.9, tolerance: float = 1e-10) -> Solution:
    """Integrate from rest (or v0) at x0."""
    n = len(problem.x0)
    driven = np.array(sorted(problem.prescribed), dtype=int)
    free = np.setdiff1d(np.arange(n), driven)
    alpha_m, alpha_f = (2 * rho_inf - 1) / (rho_inf + 1), rho_inf / (rho_inf + 1)
    gamma = 0.5 + alpha_f - alpha_m
    beta = 0.25 * (gamma + 0.5) ** 2
    M, C = sp.csc_array(problem.M), problem.damping
    load = problem.load or (lambda t: np.zeros(n))

    def impose(t, x, v, a):
        for k in driven:
            x[k], v[k], a[k] = problem.prescribed[k](t)

    x = problem.x0.astype(float).copy()
    v = np.zeros(n) if problem.v0 is None else problem.v0.astype(float).copy()
    a = np.zeros(n)
    impose(0.0, x, v, a)
    f, _ = problem.force(x)
    rest = load(0.0) - f - M @ a - (C @ v if C is not None else 0.0)
    part, solve = of_dofs(free)
    a[free] = solve(part(M), rest[free])
    n_steps = round(t_end / h)
    out = Solution(np.arange(n_steps + 1) * h, *(np.zeros((n_steps + 1, n)) for _ in range(3)))
    out.x[0], out.v[0], out.a[0] = x, v, a
    M_ff = part(M)
    C_ff = None if C is None else part(C)
    f_last = f
    for k in range(n_steps):
        t = (k + 1) * h
        x_new = x + h * v + h**2 * (0.5 - beta) * a + h**2 * beta * a
        a_new = a.copy()
        v_new = v + h * a
        impose(t, x_new, v_new, a_new)
        p = (1 - alpha_f) * load(t) + alpha_f * load(t - h)
        for _ in range(30):
            f, K = problem.force(x_new)
            r = M @ ((1 - alpha_m) * a_new + alpha_m * a) + (1 - alpha_f) * f + alpha_f * f_last - p
            if C is not None:
                r = r + C @ ((1 - alpha_f) * v_new + alpha_f * v)
            S = (1 - alpha_m) / (beta * h**2) * M_ff + (1 - alpha_f) * part(K)
            if C_ff is not None:
                S = S + (1 - alpha_f) * gamma / (beta * h) * C_ff
            dx = -solve(S, r[free])
            x_new[free] += dx
            v_new[free] += gamma / (beta * h) * dx
            a_new[free] += dx / (beta * h**2)
            if np.abs(dx).max() < tolerance * max(1.0, np.abs(x_new).max()):
                break
        else:
            raise RuntimeError(f"no convergence at t = {t}: last correction {np.abs(dx).max()}")
        f_last, _ = problem.force(x_new)
        x, v, a = x_new, v_new, a_new
        out.x[k + 1], out.v[k + 1], out.a[k + 1] = x, v, a
    return out


def equilibrium(problem: Problem, load: np.ndarray, *, steps: int = 10, tolerance: float = 1e-11) -> np.ndarray:
    """Return x under a constant load, brought on in steps."""
    n = len(problem.x0)
    driven = np.array(sorted(problem.prescribed), dtype=int)
    free = np.setdiff1d(np.arange(n), driven)
    x = problem.x0.astype(float).copy()
    for k in driven:
        x[k] = problem.prescribed[k](0.0)[0]
    for step in range(1, steps + 1):
        for _ in range(60):
            f, K = problem.force(x)
            dx = splu(sp.csc_array(K[free][:, free])).solve((load * step / steps - f)[free])
            x[free] += dx
            if np.abs(dx).max() < tolerance * max(1.0, np.abs(x).max()):
                break
        else:
            raise RuntimeError("no equilibrium")
    return x
