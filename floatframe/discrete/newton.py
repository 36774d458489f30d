"""Newton's method for one step: the residuals of all bodies and joints, and their exact derivatives.

Unknowns are the increments x = (d, theta, dq) of the bodies and mu = h²/2 f, f the multipliers of the joints; equations
of motion are multiplied by h/2, so that the matrix stays well-conditioned as h falls. Residuals of a body, or of a
joint and its two bodies, are taken for a stack of complex arguments, one along each unknown: their imaginary parts
are the derivatives, exact to rounding.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from fe_models.foundation.arrays import Array, IntArray
from floatframe.discrete.bodies import BodyStep, CentralBody, Placed, step_of
from floatframe.discrete.constraints import Span, add_reaction
from floatframe.discrete.markers import BodyMarker, Load, MarkerStep, marker_step
from floatframe.discrete.system import Connection, DiscreteSystem

__all__ = ["Scheme", "Solution", "StepError", "generalised_force", "pair_of", "solve_step", "work_of"]

TINY = 1e-20  #: of the imaginary parts
SLOW = 0.1  #: ratio of corrections above which the derivatives are made anew
ROUNDOFF = 2e-15  #: of a position
DENSE_BELOW = 300  #: unknowns, from which on the matrix is sparse


class Scheme(Protocol):
    """The equations of one body over a step."""

    @property
    def acts_along(self) -> bool:
        """Whether forces act along the step; else where it begins."""

    def inertia(self, body: CentralBody, place: Placed, x: Array, h: float) -> Array:
        """Return h/2 times the change of momentum without loads, (..., 6 + n); modal forces of K and D included."""

    def force_step(self, place: Placed, x: Array) -> BodyStep:
        """Return where forces act."""

    def torque(self, place: Placed, x: Array, tau: Array) -> Array:
        """Return what a torque in ground axes adds to the rotational residual, (..., 3)."""


class StepError(Exception):
    """A step that could not be made; internal to the schemes."""

    def __init__(self, words: str, excess: float, connection: int = -1) -> None:
        super().__init__(words)
        self.excess = excess
        self.connection = connection


@dataclass(frozen=True, eq=False)
class Solution:
    """Increments and multipliers of a step."""

    x: list[Array]  #: of each body, (6 + n,)
    f: Array  #: (n_held,)
    n_iterations: int


def local(function: Callable[[Array], Array], z: Array, *, with_derivative: bool) -> tuple[Array, Array | None]:
    """Return function(z), (n,), and its derivative, (n, len(z)), if asked for."""
    if not with_derivative:
        return function(z[None])[0], None
    values = function(z + 1j * TINY * np.eye(len(z)))
    return values[0].real, values.imag.T / TINY


def generalised_force(scheme: Scheme, place: Placed, x: Array, load: Load) -> Array:
    """Return what a load adds to the residual, over -h²/2, (..., 6 + n)."""
    return np.concatenate([load.force, scheme.torque(place, x, load.torque), load.modal], axis=-1)


def empty_load(n: int, x: Array) -> Load:
    """Return a load of zero for a stack of increments."""
    return Load(n, x.shape[:-1], x.dtype.type)


def pair_of(
    connection: Connection, steps: tuple[BodyStep | None, BodyStep | None]
) -> tuple[MarkerStep, MarkerStep]:  # fmt: skip
    """Return the markers of a connection over a step."""
    return marker_step(connection.a, steps[0]), marker_step(connection.b, steps[1])


def body_residual(ds: DiscreteSystem, scheme: Scheme, i: int, place: Placed, span: Span, x: Array) -> Array:
    """Return the residual of body i without its joints, (..., 6 + n)."""
    load = empty_load(ds.bodies[i].n, x)
    ds.own_loads(i, scheme.force_step(place, x), load, span)
    inertia = scheme.inertia(ds.bodies[i], place, x, span.h)
    return inertia - 0.5 * span.h**2 * generalised_force(scheme, place, x, load)


def connection_residual(
    ds: DiscreteSystem, scheme: Scheme, connection: Connection, placed: list[Placed], span: Span, z: Array
) -> Array:
    """Return what a connection adds to its bodies, and its rows, for z = (x of A, x of B, mu), (..., n)."""
    ends: list[tuple[BodyMarker, Array | None]] = []
    first = 0
    for marker in (connection.a, connection.b):
        size = 6 + ds.bodies[marker.body].n if marker.body >= 0 else 0
        ends.append((marker, z[..., first : first + size] if size else None))
        first += size
    mu = z[..., first:]
    loads, where = [], []
    for marker, x in ends:
        loads.append(None if x is None else empty_load(ds.bodies[marker.body].n, x))
        where.append(None if x is None else scheme.force_step(placed[marker.body], x))
    pair = pair_of(connection, (where[0], where[1]))
    ds.connection_loads(connection, pair, (loads[0], loads[1]), span, 2 * mu / span.h**2)
    out = [
        -0.5 * span.h**2 * generalised_force(scheme, placed[marker.body], x, load)
        for (marker, x), load in zip(ends, loads, strict=True)
        if x is not None and load is not None
    ]
    if connection.held:
        if not scheme.acts_along:
            steps = [None if x is None else step_of(placed[marker.body], x) for marker, x in ends]
            pair = pair_of(connection, (steps[0], steps[1]))
        values = ds.values(connection, pair, span)
        out.append(np.stack(values, axis=-1) + ds.model.rows.soft[list(connection.held)] * mu)
    return np.concatenate(out, axis=-1)


def unknowns_of(ds: DiscreteSystem, connection: Connection) -> IntArray:
    """Return the numbers of the unknowns of a connection."""
    parts = [np.arange(ds.model.bodies.u0[m.body], ds.model.bodies.u0[m.body + 1]) for m in (connection.a, connection.b)
             if m.body >= 0]  # fmt: skip
    n_u = int(ds.model.bodies.u0[-1])
    return np.concatenate([*parts, n_u + connection.first + np.arange(len(connection.held))])


def assemble(
    ds: DiscreteSystem, scheme: Scheme, placed: list[Placed], span: Span, z: Array, *, with_derivative: bool
) -> tuple[Array, list[tuple[IntArray, Array]]]:
    """Return the residual of all unknowns, and the blocks of its derivative with their places."""
    residual, blocks = np.zeros(len(z)), []
    for i, place in enumerate(placed):
        at = np.arange(ds.model.bodies.u0[i], ds.model.bodies.u0[i + 1])
        value, derivative = local(
            partial(body_residual, ds, scheme, i, place, span),
            z[at], with_derivative=with_derivative,
        )  # fmt: skip
        residual[at] += value
        if derivative is not None:
            blocks.append((at, derivative))
    for connection in ds.connections:
        at = unknowns_of(ds, connection)
        value, derivative = local(
            partial(connection_residual, ds, scheme, connection, placed, span),
            z[at], with_derivative=with_derivative,
        )  # fmt: skip
        np.add.at(residual, at, value)
        if derivative is not None:
            blocks.append((at, derivative))
    return residual, blocks


def factorized(blocks: list[tuple[IntArray, Array]], n: int) -> Callable[[Array], Array]:
    """Return the solver of the matrix of these blocks; `RuntimeError` if it is singular."""
    if n < DENSE_BELOW:
        import scipy.linalg as la

        matrix = np.zeros((n, n))
        for at, block in blocks:
            matrix[np.ix_(at, at)] += block
        if not np.isfinite(matrix).all():
            raise RuntimeError("not finite")
        factors, pivots, info = la.lapack.dgetrf(matrix)
        if info != 0:
            raise RuntimeError("singular")
        return lambda b: np.asarray(la.lapack.dgetrs(factors, pivots, b)[0])
    rows = np.concatenate([np.repeat(at, len(at)) for at, _ in blocks])
    columns = np.concatenate([np.tile(at, len(at)) for at, _ in blocks])
    values = np.concatenate([block.ravel() for _, block in blocks])
    return splu(sp.csc_array((values, (rows, columns)), shape=(n, n))).solve


def solve_step(
    ds: DiscreteSystem, scheme: Scheme, placed: list[Placed], span: Span, f: Array, tolerance: float,
    max_iterations: int,
) -> Solution:  # fmt: skip
    """Return the increments of a step.

    Raises
    ------
    StepError
        If Newton's method does not converge or its matrix is singular.
    """
    h, n_u = span.h, int(ds.model.bodies.u0[-1])
    weight, floor = np.zeros(n_u), 0.0
    z = np.zeros(n_u + ds.n_held)
    for i, (body, place) in enumerate(zip(ds.bodies, placed, strict=True)):
        u = slice(int(ds.model.bodies.u0[i]), int(ds.model.bodies.u0[i + 1]))
        z[u] = h * np.concatenate([place.v, place.omega, place.q_dot])
        modal = np.diag(body.M) + 0.25 * h**2 * np.diag(body.K)
        weight[u] = np.concatenate([np.full(3, body.m), np.diag(body.J0), modal])
        floor += body.m * (ds.length + np.abs(place.c).sum()) ** 2
    z[n_u:] = 0.5 * h**2 * f
    fall = 0.5 * h**2 * np.linalg.norm(ds.model.gravity) * np.sqrt(sum(body.m for body in ds.bodies))
    last, solver, excess = np.inf, None, np.inf
    for iteration in range(max_iterations):
        residual, blocks = assemble(ds, scheme, placed, span, z, with_derivative=solver is None)
        if blocks:
            try:
                solver = factorized(blocks, len(z))
            except RuntimeError:
                raise StepError("the matrix of Newton's method is singular", excess) from None
        assert solver is not None
        change = solver(-residual)
        z = z + change
        norm = float(np.sqrt(weight @ change[:n_u] ** 2))
        size = float(np.sqrt(weight @ z[:n_u] ** 2))
        if not np.isfinite(norm):
            raise StepError("Newton's method diverged", np.inf)
        allowed = tolerance * (size + fall) + ROUNDOFF * np.sqrt(floor)
        excess = norm / allowed
        if norm <= allowed or (norm <= 1e3 * allowed and norm > 0.5 * last and iteration > 2):
            x = [z[ds.model.bodies.u0[i] : ds.model.bodies.u0[i + 1]] for i in range(len(placed))]
            return Solution(x, 2 * z[n_u:] / h**2, iteration + 1)
        if norm > SLOW * last:
            solver = None
        last = norm
    raise StepError(f"Newton's method did not converge in {max_iterations} iterations", excess)


def work_of(
    ds: DiscreteSystem, scheme: Scheme, placed: list[Placed], span: Span, solution: Solution
) -> tuple[float, float]:
    """Return the work that entered over a step, by forces and prescribed motions, and that taken by dampers.

    Work of a prescribed motion is that of its multiplier.
    """
    given, taken = 0.0, 0.0
    steps = [scheme.force_step(place, x) for place, x in zip(placed, solution.x, strict=True)]
    for i, body in enumerate(ds.bodies):
        load = Load(body.n, (), float)
        given += float(ds.own_loads(i, steps[i], load, span).given)
        dq = solution.x[i][6:]
        taken += float(dq @ body.D @ dq) / span.h
    for connection in ds.connections:
        pair = pair_of(connection, tuple(steps[m.body] if m.body >= 0 else None
                                         for m in (connection.a, connection.b)))  # type: ignore[arg-type]  # fmt: skip
        sizes = [ds.bodies[m.body].n if m.body >= 0 else 0 for m in (connection.a, connection.b)]
        f = solution.f[connection.first : connection.first + len(connection.held)]
        loads = (Load(sizes[0], (), float), Load(sizes[1], (), float))
        part = ds.connection_loads(connection, pair, loads, span, f)
        given, taken = given + float(part.given), taken + float(part.taken)
        driven = f * (ds.model.rows.motion[list(connection.held)] >= 0)
        if driven.any():
            loads = (Load(sizes[0], (), float), Load(sizes[1], (), float))
            for j, k in enumerate(connection.held):
                add_reaction(ds.model, k, pair, loads, span, driven[j])
            for load, marker in zip(loads, (connection.a, connection.b), strict=True):
                if marker.body >= 0:
                    given += float(load.work(steps[marker.body]))
    return given, taken
