"""Newton's method for one step: the residuals of all bodies and joints, and their exact derivatives.

Unknowns are the increments x = (d, theta, dq) of the bodies and mu = h²/2 f, f the multipliers of the joints; equations
of motion are multiplied by h/2, so that the matrix stays well-conditioned as h falls. Residuals of a body, or of a
connection and its bodies, are taken for a stack of complex arguments, one along each unknown: their imaginary parts
are the derivatives, exact to rounding.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from typing import Protocol

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import splu

from cms.linear_algebra.lu_factors import solve_factored
from fe_models.foundation.arrays import Array, IntArray
from tests.floatframe.engine.structure_preserving.in_python.bodies import Body, BodyStep, Placed, step_of
from tests.floatframe.engine.structure_preserving.in_python.constraints import Span
from tests.floatframe.engine.structure_preserving.in_python.deformed_lines import slid
from tests.floatframe.engine.structure_preserving.in_python.markers import Load, marker_step
from tests.floatframe.engine.structure_preserving.in_python.system import Ends, StepConnection, StepSystem

TINY = 1e-20  #: of the imaginary parts
SLOW = 0.1  #: ratio of successive corrections above which the derivatives are renewed
ROUNDOFF = 2e-15  #: of a position
DENSE_BELOW = 300  #: number of unknowns above which the matrix is sparse


class Scheme(Protocol):
    """The equations of one body over a step."""

    @property
    def acts_along(self) -> bool:
        """Whether forces act along the step; otherwise they act at its start."""

    def inertia(self, body: Body, place: Placed, x: Array, h: float) -> Array:
        """Return h/2 times the change of momentum without loads, (..., 6 + n); modal forces of K and D included."""

    def force_step(self, place: Placed, x: Array) -> BodyStep:
        """Return the configuration in which forces act."""

    def torque(self, place: Placed, x: Array, tau: Array) -> Array:
        """Return the contribution of a torque in ground axes to the rotational residual, (..., 3)."""


class StepError(Exception):
    """A step that failed; internal to the schemes."""

    def __init__(self, words: str, excess: float, connection: int = -1) -> None:
        super().__init__(words)
        self.excess = excess
        self.connection = connection


@dataclass(frozen=True, eq=False)
class Solution:
    """Increments, multipliers and changes of states of a step."""

    x: list[Array]  #: of each body, (6 + n,)
    f: Array  #: (n_held,)
    dz: Array  #: changes of states, (n_states,)
    n_iterations: int


def local(function: Callable[[Array], Array], z: Array, *, with_derivative: bool) -> tuple[Array, Array | None]:
    """Return function(z), (n,), and its derivative, (n, len(z)), if requested."""
    if not with_derivative:
        return function(z[None])[0], None
    values = function(z + 1j * TINY * np.eye(len(z)))
    return values[0].real, values.imag.T / TINY


def generalised_force(scheme: Scheme, place: Placed, x: Array, load: Load) -> Array:
    """Return the contribution of a load to the residual, divided by -h²/2, (..., 6 + n)."""
    return np.concatenate([load.force, scheme.torque(place, x, load.torque), load.modal], axis=-1)


def empty_load(n: int, x: Array) -> Load:
    """Return a load of zero for a stack of increments."""
    return Load(n, x.shape[:-1], x.dtype.type)


def ends_of(
    ds: StepSystem, connection: StepConnection, steps: dict[int, BodyStep], loads: dict[int, Load], span: Span
) -> Ends:
    """Return the markers of a connection over a step, and the loads on their bodies, by the numbers of bodies."""
    markers = [marker_step(marker, steps.get(marker.body)) for marker in connection.ends]
    slide = None
    if connection.line is not None:
        sliding = connection.ends[0]
        markers[0], slide = slid(ds.model, connection.line, sliding, steps[sliding.body], markers[1], span)
    return Ends(markers, [loads.get(marker.body) for marker in connection.ends], slide)


def body_residual(ds: StepSystem, scheme: Scheme, i: int, place: Placed, span: Span, x: Array) -> Array:
    """Return the residual of body i without its joints, (..., 6 + n)."""
    load = empty_load(ds.bodies[i].n, x)
    ds.own_loads(i, scheme.force_step(place, x), load, span)
    inertia = scheme.inertia(ds.bodies[i], place, x, span.h)
    return inertia - 0.5 * span.h**2 * generalised_force(scheme, place, x, load)


def connection_residual(
    ds: StepSystem, scheme: Scheme, connection: StepConnection, placed: list[Placed], span: Span, z: Array
) -> Array:
    """Return the contributions of a connection to its bodies, and its rows, for z = (x of A, x of B, mu), (..., n)."""
    x: dict[int, Array] = {}
    first = 0
    for i in connection.bodies:
        size = 6 + ds.bodies[i].n
        x[i] = z[..., first : first + size]
        first += size
    n_held = len(connection.held)
    mu, dz = z[..., first : first + n_held], z[..., first + n_held :]
    loads = {i: empty_load(ds.bodies[i].n, x[i]) for i in x}
    ends = ends_of(ds, connection, {i: scheme.force_step(placed[i], x[i]) for i in x}, loads, span)
    ds.connection_loads(connection, ends, span, 2 * mu / span.h**2, dz, is_middle=scheme.acts_along)
    out = [-0.5 * span.h**2 * generalised_force(scheme, placed[i], x[i], load) for i, load in loads.items()]
    if not scheme.acts_along:
        ends = ends_of(ds, connection, {i: step_of(placed[i], x[i]) for i in x}, {}, span)
    if connection.held:
        values = ds.values(connection, ends, span, dz, 2 * mu / span.h**2)
        values = [np.broadcast_to(value, mu.shape[:-1]) for value in values]
        out.append(np.stack(values, axis=-1) + ds.model.rows.soft[list(connection.held)] * mu)
    if connection.states:
        out.append(ds.state_residual(connection, ends, span, dz, 2 * mu / span.h**2, is_along=scheme.acts_along))
    return np.concatenate(out, axis=-1)


def unknowns_of(ds: StepSystem, connection: StepConnection) -> IntArray:
    """Return the numbers of the unknowns of a connection."""
    parts = [np.arange(ds.model.bodies.u0[i], ds.model.bodies.u0[i + 1]) for i in connection.bodies]
    n_u = int(ds.model.bodies.u0[-1])
    multipliers = n_u + connection.first + np.arange(len(connection.held))
    states = n_u + ds.n_held + connection.first_state + np.arange(len(connection.states))
    return np.concatenate([*parts, multipliers, states])


def assemble(
    ds: StepSystem, scheme: Scheme, placed: list[Placed], span: Span, z: Array, *, with_derivative: bool
) -> tuple[Array, list[tuple[IntArray, Array]]]:
    """Return the residual of all unknowns, and the blocks of its derivative with their positions."""
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
        return lambda b: solve_factored((factors, pivots), b)
    rows = np.concatenate([np.repeat(at, len(at)) for at, _ in blocks])
    columns = np.concatenate([np.tile(at, len(at)) for at, _ in blocks])
    values = np.concatenate([block.ravel() for _, block in blocks])
    return splu(sp.csc_array((values, (rows, columns)), shape=(n, n))).solve


def solve_step(
    ds: StepSystem, scheme: Scheme, placed: list[Placed], span: Span, f: Array, tolerance: float,
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
    z = np.zeros(n_u + ds.n_held + ds.n_states)
    for i, (body, place) in enumerate(zip(ds.bodies, placed, strict=True)):
        u = slice(int(ds.model.bodies.u0[i]), int(ds.model.bodies.u0[i + 1]))
        z[u] = h * np.concatenate([place.v, place.omega, place.q_dot])
        modal = np.diag(body.M) + 0.25 * h**2 * np.diag(body.K)
        weight[u] = np.concatenate([np.full(3, body.m), np.diag(body.J0), modal])
        floor += body.m * (ds.length + np.abs(place.c).sum()) ** 2
    n_mu = n_u + ds.n_held
    z[n_u:n_mu] = 0.5 * h**2 * f
    known = span.w[[k for c in ds.connections for k in c.states]]
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
        of_states = np.abs(change[n_mu:]) / (np.abs(known) + np.abs(z[n_mu:]) + ds.model.states.size)
        norm = max(norm, float(of_states.max(initial=0.0)) * allowed / tolerance)
        excess = norm / allowed
        if norm <= allowed or (norm <= 1e3 * allowed and norm > 0.5 * last and iteration > 2):
            x = [z[ds.model.bodies.u0[i] : ds.model.bodies.u0[i + 1]] for i in range(len(placed))]
            return Solution(x, 2 * z[n_u:n_mu] / h**2, z[n_mu:], iteration + 1)
        if norm > SLOW * last:
            solver = None
        last = norm
    raise StepError(f"Newton's method did not converge in {max_iterations} iterations", excess)


def work_of(
    ds: StepSystem, scheme: Scheme, placed: list[Placed], span: Span, solution: Solution
) -> tuple[float, float]:
    """Return the work supplied over a step by forces and prescribed motions, and the work dissipated by dampers.

    Work of a prescribed motion is that of its multiplier.
    """
    given, taken = 0.0, 0.0
    steps = [scheme.force_step(place, x) for place, x in zip(placed, solution.x, strict=True)]
    for i, body in enumerate(ds.bodies):
        load = Load(body.n, (), float)
        given += float(ds.own_loads(i, steps[i], load, span).given)
        dq = solution.x[i][6:]
        taken += float(dq @ body.D @ dq) / span.h
    of_bodies = dict(enumerate(steps))
    for connection in ds.connections:
        f = solution.f[connection.first : connection.first + len(connection.held)]
        dz = solution.dz[connection.first_state : connection.first_state + len(connection.states)]
        loads = {i: Load(ds.bodies[i].n, (), float) for i in connection.bodies}
        ends = ends_of(ds, connection, of_bodies, loads, span)
        part = ds.connection_loads(connection, ends, span, f, dz, is_middle=scheme.acts_along)
        given, taken = given + float(part.given), taken + float(part.taken)
        driven = f * np.array([ds.is_driven(connection, k) for k in connection.held], dtype=bool)
        if driven.any():
            loads = {i: Load(ds.bodies[i].n, (), float) for i in connection.bodies}
            ends = ends_of(ds, connection, of_bodies, loads, span)
            for j, k in enumerate(connection.held):
                ds.add_row(connection, k, ends, span, driven[j])
            given += sum(float(load.work(steps[i])) for i, load in loads.items())
    return given, taken


def remembered(ds: StepSystem, placed: list[Placed], span: Span, solution: Solution) -> Array:
    """Return what connections remember at the end of a step, (n_w,)."""
    steps = {i: step_of(place, x) for i, (place, x) in enumerate(zip(placed, solution.x, strict=True))}
    return ds.remembered([ends_of(ds, connection, steps, {}, span) for connection in ds.connections], span, solution.dz)
