"""Optimal rest-to-rest moves of an arm, by collocation of its generated equations.

The equations of motion are used in the generated form, a residual of positions, rates, accelerations and forces; no
mass matrix is inverted. In each of N intervals of length h, the accelerations a_i at the three Gauss-Legendre points
are unknowns, and with Butcher's A, b, c

    v_i = v_0 + h Σ A_ij a_j,   z_i = z_0 + h c_i v_0 + h² Σ (A A)_ij a_j,   residual(z_i, v_i, a_i, B u_i) = 0
    v_1 = v_0 + h Σ b_i a_i,    z_1 = z_0 + h v_0 + h² Σ (b A)_i a_i

(order six for z and v). The torques u are linear within each interval, and zero at the beginning of the first and the
end of the last one. The objective is the sum of u² and of the squared second differences of u, both relative to the
largest torque:

    Σ |u_k / u_max|² h + s⁴ Σ |(u_k+1 - 2 u_k + u_k-1) / (h² u_max)|² h

Source: Betts (2010).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.extras import extra_module
from floatframe.design.generation.generate import generate
from floatframe.engine.tree.recursive import relative_model
from floatframe.errors import ConvergenceError, ModelError
from floatframe.model.functions.tables import between, linear_table
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.system import System

__all__ = ["OptimalMove", "casadi_function", "optimal_move"]

ROOT = np.sqrt(15.0)
A = np.array([
    [5 / 36, 2 / 9 - ROOT / 15, 5 / 36 - ROOT / 30],
    [5 / 36 + ROOT / 24, 2 / 9, 5 / 36 - ROOT / 24],
    [5 / 36 + ROOT / 30, 2 / 9 + ROOT / 15, 5 / 36],
])  # fmt: skip
B = np.array([5 / 18, 4 / 9, 5 / 18])
C = np.array([0.5 - ROOT / 10, 0.5, 0.5 + ROOT / 10])
SMOOTHING = 0.05  #: s, weight of the second differences of torques [s]


@dataclass(frozen=True, eq=False)
class OptimalMove:
    """An optimal move, at the ends of the intervals."""

    names: tuple[str, ...]  #: names of the positions
    driven: tuple[str, ...]  #: coordinates that have a motor
    t: Array  #: times of the solution, (n_t,) [s]
    z: Array  #: positions at these times, (n_t, n_z)
    z_dot: Array  #: rates at these times, (n_t, n_z)
    torque: Array  #: torques of the motors, (n_t, n_u) [N m]
    cost: float
    iterations: int

    def torque_function(self, name: str) -> TimeFunction:
        """Return the torque of a motor as a function of time, piecewise linear and zero after the move."""
        return linear_table(self.t, self.torque[:, self.driven.index(name)])

    def aim(self, name: str) -> TimeFunction:
        """Return a position as a function of time: cubics through values and rates, at rest outside the move."""
        x, v = (rows[:, self.names.index(name)] for rows in (self.z, self.z_dot))
        h = np.diff(self.t)
        slope = np.diff(x) / h
        cubics = [x[:-1], v[:-1], (3 * slope - 2 * v[:-1] - v[1:]) / h, (v[:-1] + v[1:] - 2 * slope) / h**2]
        return between(self.t, np.column_stack(cubics), (x[0],), (x[-1],))


def casadi_function(system: System) -> Callable[..., Any]:
    """Return generated equations of a system as a `casadi.Function`, see `generate`."""
    extra_module("casadi", extra="casadi", purpose="optimal moves")
    code = generate(system, what="residual", language="casadi", name="generated_residual")
    space: dict = {}
    exec(code.files[f"{code.name}.py"], space)
    made: Callable[..., Any] = space[code.name]()
    return made


def optimal_move(
    system: System,
    target: dict[str, float],
    duration: float,
    *,
    torque: Sequence[float],
    n_intervals: int = 60,
    tolerance: float = 1e-9,
) -> OptimalMove:
    """Return the move of least effort of a tree without gravity, from rest in the assembled position to rest elsewhere.

    Parameters
    ----------
    system
        The tree; its modes are undeformed at both ends.
    target
        Final values of coordinates, by name ("shoulder/angle"); each of them needs a motor.
    duration
        Duration of the move [s].
    torque
        Largest torque of each motor [N m].
    n_intervals
        Number of intervals of the collocation.
    tolerance
        Tolerance of the optimiser.

    Raises
    ------
    ModelError
        If a name does not exist or a number is out of its range.
    ConvergenceError
        If no move is found, for example because the motors are too weak.
    """
    model = relative_model(system)
    names, driven, limit = model.names, tuple(target), np.array(torque, dtype=float)
    missing = [name for name in driven if name not in names]
    if missing or not driven:
        raise ModelError(f"optimal_move: target: expected some of {', '.join(names)}, got {', '.join(missing)}")
    if limit.shape != (len(driven),) or not (limit > 0).all() or not duration > 0 or n_intervals < 2:
        raise ModelError("optimal_move: expected a torque above 0 for each motor, a duration above 0, 2 intervals")
    if model.n_z != model.n_rates:
        raise ModelError("optimal_move: expected coordinates with as many positions as rates (no Euler parameters)")
    casadi = extra_module("casadi", extra="casadi", purpose="optimal moves")
    residual = casadi_function(system)
    n, n_u, h = model.n_z, len(driven), duration / n_intervals
    begin, end = model.positions()[0], model.positions()[0]
    for name, value in target.items():
        end[names.index(name)] = value
    at_motor = np.zeros((n, n_u))
    at_motor[[names.index(name) for name in driven], range(n_u)] = 1.0

    z, v = casadi.SX.sym("z", n), casadi.SX.sym("v", n)
    a = [casadi.SX.sym(f"a{i}", n) for i in range(3)]
    u0, u1 = casadi.SX.sym("u0", n_u), casadi.SX.sym("u1", n_u)
    AA, bA = A @ A, B @ A
    rest = []
    for i in range(3):
        z_i = z + h * C[i] * v + h**2 * sum(AA[i, j] * a[j] for j in range(3))
        v_i = v + h * sum(A[i, j] * a[j] for j in range(3))
        force = at_motor @ ((u0 + C[i] * (u1 - u0)) * limit)
        rest.append(residual(z_i, v_i, a[i], force))
    z_end = z + h * v + h**2 * sum(bA[j] * a[j] for j in range(3))
    v_end = v + h * sum(B[j] * a[j] for j in range(3))
    interval = casadi.Function("interval", [z, v, *a, u0, u1], [casadi.vertcat(*rest), z_end, v_end])

    Z, V = casadi.MX.sym("Z", n, n_intervals + 1), casadi.MX.sym("V", n, n_intervals + 1)
    accelerations = [casadi.MX.sym(f"A{i}", n, n_intervals) for i in range(3)]
    U = casadi.MX.sym("U", n_u, n_intervals + 1)
    all_of_them = interval.map(n_intervals)
    rest_of, z_of, v_of = all_of_them(Z[:, :-1], V[:, :-1], *accelerations, U[:, :-1], U[:, 1:])
    held = casadi.vertcat(
        casadi.vec(rest_of), casadi.vec(z_of - Z[:, 1:]), casadi.vec(v_of - V[:, 1:]),
        Z[:, 0] - begin, V[:, 0], Z[:, -1] - end, V[:, -1], U[:, 0], U[:, 1], U[:, -2], U[:, -1],
    )  # fmt: skip
    bend = (U[:, 2:] - 2 * U[:, 1:-1] + U[:, :-2]) / h**2
    cost = h * casadi.sumsqr(U) + SMOOTHING**4 * h * casadi.sumsqr(bend)
    parts = [Z, V, *accelerations, U]
    unknowns = casadi.vertcat(*(casadi.vec(part) for part in parts))
    options = {"print_time": False, "ipopt": {"print_level": 0, "sb": "yes", "tol": tolerance, "max_iter": 200}}
    solver = casadi.nlpsol("move", "ipopt", {"x": unknowns, "f": cost, "g": held}, options)

    s = np.linspace(0.0, 1.0, n_intervals + 1)  # initial guess: quintics from rest to rest
    guess = begin[:, None] + (end - begin)[:, None] * (10 * s**3 - 15 * s**4 + 6 * s**5)
    first = np.concatenate([guess.ravel(order="F"), np.zeros(unknowns.numel() - guess.size)])
    free = unknowns.numel() - U.numel()
    bound = np.concatenate([np.full(free, np.inf), np.ones(U.numel())])
    found = solver(x0=first, lbx=-bound, ubx=bound, lbg=0.0, ubg=0.0)
    told = solver.stats()
    if not told["success"]:
        raise ConvergenceError(
            f"optimal_move: no move of {duration:g} s was found ({told['return_status']}); allow more time or torque",
            t=0.0, h=h, residual=float("nan"),
        )  # fmt: skip
    x = np.array(found["x"]).ravel()
    sizes = np.cumsum([0, *(part.numel() for part in parts)])
    z_found, v_found = (x[sizes[k] : sizes[k + 1]].reshape(-1, n) for k in range(2))
    u_found = x[sizes[-2] :].reshape(-1, n_u) * limit
    return OptimalMove(
        names, driven, duration * s, z_found, v_found, u_found, float(found["f"]), int(told["iter_count"])
    )
