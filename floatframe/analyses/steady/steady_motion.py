"""Steady running: the state of a vehicle in straight or circular motion that is constant in the moving frame.

It is found by damped Newton steps for the equations below.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.analyses.equilibrium import (
    CLOSED,
    LARGEST_TURN,
    Equilibrium,
    forces_at_work,
    largest_motion,
    notes_at,
    rounding_of,
    size_of,
    worst_body,
)
from floatframe.analyses.steady.carrier import Carrier, Spin, by_carrier, by_spin, carried
from floatframe.analyses.steady.path import Path, path_of, require_body, spins_of
from floatframe.analyses.system_matrices import turning_matrices
from floatframe.engine.compiling.callbacks import raise_errors_of
from floatframe.engine.compiling.file_frames import motion_of_file
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.initial import assembled, checked, known_of, require_numbers, start_unknowns
from floatframe.engine.initial_conditions.newton_equations import (
    Linearized,
    by_velocities,
    displaced,
    in_ground_axes,
    linearized,
    set_iterate,
    with_modal_weight,
)
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ConvergenceError, ModelError
from floatframe.model.checked_values import unit_vector
from floatframe.model.joints.rows import is_held_position
from floatframe.model.rotations import rotation_matrix, tilde
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.simulation.stop_events import require_off_stops

__all__ = ["Equations", "Family", "Place", "SteadyMotion", "Step", "Trial", "steady_motion", "timed"]


# the equations of steady running and their derivatives ----------------------------------------------------------------
# The unknowns are the motions xi of the bodies; the wrenches, multipliers and states w of connections; the speeds s of
# the spins; the curvature, unless it is given; and open parameters p of the system, such as a steer angle or a torque.
# With the carrier of `carrier.py`:
#
#     (1) every trial (xi, s, curvature) has the velocities and accelerations of the steady motion
#     (2) residuals: forces f of the bodies, rows g of connections, rates of joint constraints, rates z' of states, and
#         the distances of the reference body from its point, along and across its path
#     (3) the linear equations are scaled by rows and columns, and solved by least squares with the smallest norm, so
#         that motions without resistance (the angle of a wheel on its axle, the position along the road) do not change
#     (4) the tangent is exact for xi, w, s and the curvature; for p, it is a finite difference


SINGULAR = 1e-12  #: singular value of the scaled equations below which a motion has no resistance
DIFFERENCE = 1e-4  #: first difference step of an open parameter, relative to its size, or absolute if it is zero
#: change of forces by such a difference, relative to the acting forces: the wanted one, the smallest and the largest
EFFECT, LEAST_EFFECT, MOST_EFFECT = 1e-5, 1e-9, 1e-2
MOST_DIFFERENCES = 4  #: largest number of difference steps tried for each parameter


@dataclass(frozen=True, eq=False)
class Family:
    """A system as a function of its open parameters."""

    system: System | Callable[..., System]
    start: dict[str, float]

    @property
    def first(self) -> System:
        """The system for the initial values of the open parameters."""
        return self.at(np.array(list(self.start.values()), dtype=float))

    def at(self, p: Array) -> System:
        """Return the system for values p of the open parameters, (n_p,)."""
        if isinstance(self.system, System):
            if self.start:
                raise ModelError(
                    f"steady_motion: unknown {sorted(self.start)}: expected a function that returns the system for "
                    "these parameters, got a system"
                )
            return self.system
        return self.system(**dict(zip(self.start, (float(value) for value in p), strict=True)))


def timed(work: Work, t: float) -> Work:
    """Return the working arrays with another time."""
    work.state.time[...] = t
    return work


@dataclass(frozen=True, eq=False)
class Evaluated:
    """The equations at a trial state."""

    parts: Linearized
    D: Array  #: derivatives of forces by xi, (n_u, n_u)
    G: Array  #: derivatives of rows by xi, (n_w, n_u)
    C: Array  #: derivatives of forces by nu, (n_u, n_u)
    M: Array
    G_v: Array
    f: Array  #: unbalanced forces, (n_u,)
    g: Array  #: residuals of the rows, (n_w,)
    rate: Array  #: rates of joint constraints, (n_w,)
    W: tuple[Array, ...]  #: mass and modal stiffness of each body, as weights
    scale: float  #: norm of the acting forces

    @property
    def error(self) -> float:
        """Unbalanced forces relative to the acting forces."""
        size = size_of(self.W, self.f)
        return size / self.scale if self.scale > 0 else size


@dataclass(frozen=True, eq=False)
class Trial:
    """Values of all unknowns of a trial."""

    state: State
    w: Array
    s: Array
    carrier: Carrier
    p: Array


@dataclass(frozen=True, eq=False)
class Place:
    """A trial with its equations."""

    system: System
    compiled: CompiledSystem
    work: Work
    trial: Trial
    now: Evaluated


@dataclass(frozen=True, eq=False)
class Step:
    """A step of Newton's method."""

    x: Array  #: changes of all unknowns, (n_x,)
    inverse: Array  #: matrix from residuals to changes of unknowns, (n_x, n_rows)
    sizes: Array  #: typical sizes of the unknowns, (n_x,)

    def length(self, x: Array) -> float:
        """Return the norm of a change, scaled by the typical sizes of the unknowns."""
        return float(np.linalg.norm(x / self.sizes))


@dataclass(frozen=True, eq=False)
class Equations:
    """The equations of one search."""

    family: Family
    spins: tuple[Spin, ...]
    path: Path
    guided: bool
    t: float

    def at(self, trial: Trial) -> Place:
        """Return a trial, corrected so that joints are closed, with its equations."""
        system = self.family.at(trial.p)
        compiled, work = compiled_system(system), timed(new_work(compiled_system(system).model), self.t)
        if len(trial.w) != int(compiled.model.connections.w0[-1]):
            raise ModelError("steady_motion: the function returns systems with different connections")
        require_off_stops(system, trial.w)
        # close the joints first: if they are open, their equations depend on the angle of a spinning wheel
        trial = replace(trial, state=assembled(compiled, work, trial.state, trial.w))
        return Place(system, compiled, work, trial, self.evaluated(compiled, work, trial))

    def moved(self, here: Place, x: Array) -> Trial:
        """Return a trial after a change x of its unknowns."""
        trial, model = here.trial, here.compiled.model
        _, unknowns, _ = self.used_rows(here.compiled)
        n_u, n_s = len(here.now.f), len(self.spins)
        y, dw, rest = x[:n_u], np.zeros(len(trial.w)), x[n_u + len(unknowns) :]
        dw[unknowns] = x[n_u : n_u + len(unknowns)]
        omega = trial.carrier.omega
        if self.path.is_open:
            omega = omega + rest[n_s] * self.path.speed * self.path.axis
        return Trial(
            displaced(model, trial.state, in_ground_axes(model, trial.state, y)),
            trial.w + dw,
            trial.s + rest[:n_s],
            replace(trial.carrier, omega=omega),
            trial.p + rest[len(rest) - len(trial.p) :],
        )

    def change(self, here: Place, step: Step) -> float:
        """Return the largest change of an unknown in a step, relative to its typical size."""
        trial, model, length = here.trial, here.compiled.model, here.compiled.length
        after = self.moved(here, step.x)
        dw, of_states = after.w - trial.w, np.concatenate([model.states.row, model.laws.equation]).astype(int)
        of_rows = np.maximum(np.concatenate([model.states.size, model.laws.equation_size]), np.abs(trial.w[of_states]))
        sizes = step.sizes
        own = np.zeros(len(dw), dtype=bool)
        own[of_states] = True
        turning = float(np.linalg.norm(after.carrier.omega - trial.carrier.omega))
        changes = [
            largest_motion(here.compiled, step.x[: len(here.now.f)]),
            largest(dw[~own]) / max(largest(trial.w[~own]), 1e-300),
            largest(dw[of_states] / of_rows),
            largest(after.s - trial.s) / max(largest(trial.s), 1e-300),
            turning * length / max(self.path.speed, 1e-300),
            largest((after.p - trial.p) / np.maximum(np.abs(trial.p), sizes[len(sizes) - len(trial.p) :])),
        ]
        return float(max(changes))

    def evaluated(self, compiled: CompiledSystem, work: Work, trial: Trial) -> Evaluated:
        """Return residuals (2) with their derivatives by motions."""
        from floatframe.engine.kernels.entry import rates_of_constraints

        model = compiled.model
        state, u_dot = carried(model, trial.state, trial.carrier, self.spins, trial.s)
        set_iterate(work, state, u_dot, trial.w)
        rate, _ = rates_of_constraints(model, work)
        mass = linearized(model, work, 1.0, 0.0, 0.0).H
        parts = linearized(model, work, 0.0, 0.0, 1.0)
        by_rates, G_of_rates = by_velocities(model, work, parts)
        raise_errors_of(compiled.callbacks)
        require_numbers(compiled, work)
        K, C, M = (la.block_diag(*blocks) for blocks in (parts.H, by_rates, mass))
        G_x, G_v = parts.G.toarray(), G_of_rates.toarray()
        Omega, Omega_t = turning_matrices(model, work, trial.carrier.omega)
        W = with_modal_weight(model, mass)
        f = work.bodies.residual.copy()
        # forces in carrier axes do not change if a body rotates
        D = K + C @ Omega + M @ Omega_t @ Omega - turned_forces(compiled, f)
        return Evaluated(
            parts, D, G_x + G_v @ Omega, C, M, G_v, f, work.connections.g.copy(), rate, W,
            forces_at_work(compiled, work, parts, W),
        )  # fmt: skip

    def fastest(self, trial: Trial, length: float) -> float:
        """Return the speed of the system, or at rest the largest speed due to spins."""
        return self.path.speed or (float(np.abs(trial.s).max(initial=0.0)) or 1.0) * length

    def used_rows(self, compiled: CompiledSystem) -> tuple[IntArray, IntArray, IntArray]:
        """Return the rows that are equations, the connection unknowns, and the rows that constrain positions."""
        model = compiled.model
        n_w = int(model.connections.w0[-1])
        steps, rates = np.zeros(n_w, dtype=bool), np.zeros(n_w, dtype=bool)
        steps[model.states.row] = steps[model.states.row + 2] = True  # these rows are equations of time integration
        rates[model.states.row + 1] = rates[model.states.row + 2] = True  # these unknowns are zero
        return np.flatnonzero(~steps), np.flatnonzero(~rates), np.flatnonzero(is_held_position(model.rows.kind))

    def gauges(self, compiled: CompiledSystem, trial: Trial) -> tuple[Array, Array]:
        """Return distances of the reference body from its point, ahead and aside, and their derivatives by xi."""
        i, n_u = self.path.body, int(compiled.model.bodies.u0[-1])
        u0 = int(compiled.model.bodies.u0[i])
        directions = [] if not self.path.speed else [self.path.ahead]
        if directions and not self.guided:
            directions.append(self.path.aside)
        rows, toward = np.zeros((len(directions), n_u)), np.array(directions).reshape(-1, 3)
        rows[:, u0 : u0 + 3] = toward @ rotation_matrix(trial.state.p[i])
        return toward @ (trial.state.r[i] - self.path.point), rows

    def residual(self, here: Place) -> Array:
        """Return the negative residuals (2)."""
        rows, _, held = self.used_rows(here.compiled)
        gap, _ = self.gauges(here.compiled, here.trial)
        return -np.concatenate([here.now.f, here.now.g[rows], here.now.rate[held], gap])

    def step(self, here: Place) -> Step:
        """Return the step (3) of xi, w, s, curvature and p."""
        compiled, work, trial, now = here.compiled, here.work, here.trial, here.now
        model = compiled.model
        rows, unknowns, held = self.used_rows(compiled)
        gap, by_gap = self.gauges(compiled, trial)
        n_u = len(now.f)
        others = [by_spin(model, work, trial.carrier.omega, spin) for spin in self.spins]
        if self.path.is_open:
            others.append(by_carrier(model, work, trial.carrier, self.path.speed * self.path.axis))
        G_x = now.parts.G.toarray()
        columns = [
            np.concatenate([now.C @ nu + now.M @ eta, (now.G_v @ nu)[rows], (G_x @ nu)[held], np.zeros(len(gap))])
            for nu, eta in others
        ]
        columns += self.by_numbers(trial, now, rows, held, len(gap))
        J, V = now.parts.J.toarray(), now.parts.V.toarray()
        A = np.zeros((n_u + len(rows) + len(held) + len(gap), n_u + len(unknowns) + len(columns)))
        A[:n_u, :n_u], A[n_u : n_u + len(rows), :n_u] = now.D, now.G[rows]
        A[len(A) - len(gap) :, :n_u] = by_gap
        A[:n_u, n_u : n_u + len(unknowns)] = -J.T[:, unknowns]
        A[n_u : n_u + len(rows), n_u : n_u + len(unknowns)] = V[np.ix_(rows, unknowns)]
        if columns:
            A[:, n_u + len(unknowns) :] = np.stack(columns, axis=1)
        sizes = self.sizes(compiled, trial, now, unknowns)
        of_rows = np.zeros(len(A))  # rates that depend on no spin are rounding errors
        of_rows[n_u + len(rows) : len(A) - len(gap)] = (
            np.abs(G_x[held]) @ sizes[:n_u] * self.fastest(trial, compiled.length) / compiled.length
        )
        inverse, sizes = smallest_inverse(A, of_rows, sizes, len(trial.p))
        return Step(inverse @ self.residual(here), inverse, sizes)

    def sizes(self, compiled: CompiledSystem, trial: Trial, now: Evaluated, unknowns: IntArray) -> Array:
        """Return typical sizes of the unknowns in a step; 1 for parameters, whose effect determines their size."""
        model = compiled.model
        motions = np.ones(len(now.f))
        force = max(float(np.abs(trial.w).max(initial=0.0)), weight_of(now), 1e-300)
        for i, u0 in enumerate(model.bodies.u0[:-1]):
            motions[u0 : u0 + 3] = compiled.length
            modal = np.diag(now.W[i])[6:]
            motions[u0 + 6 : u0 + 6 + len(modal)] = np.sqrt(now.W[i][0, 0] / modal) * compiled.length
        w = np.full(len(now.g), force)
        w[model.states.row] = np.maximum(model.states.size, np.abs(trial.w[model.states.row]))
        w[model.laws.equation] = model.laws.equation_size
        speed = self.fastest(trial, compiled.length) / compiled.length
        others = [*(speed,) * len(self.spins), *(1 / compiled.length,) * self.path.is_open]
        return np.concatenate([motions, w[unknowns], others, np.ones(len(trial.p))])

    def by_numbers(self, trial: Trial, now: Evaluated, rows: IntArray, held: IntArray, n_gaps: int) -> list[Array]:
        """Return derivatives by the open parameters from differences, step (4)."""
        columns = []
        for k, value in enumerate(trial.p):
            h = DIFFERENCE * (abs(value) or 1.0)
            for _ in range(MOST_DIFFERENCES):
                p = trial.p.copy()
                p[k] += h
                compiled = compiled_system(self.family.at(p))
                work = timed(new_work(compiled.model), self.t)
                after = self.evaluated(compiled, work, replace(trial, p=p))
                effect = size_of(now.W, after.f - now.f) / now.scale if now.scale > 0 else 0.0
                if not effect or LEAST_EFFECT <= effect <= MOST_EFFECT:
                    break
                h *= EFFECT / effect
            # rates are evaluated after the joints are closed again, as for motions
            parts = [after.f - now.f, (after.g - now.g)[rows], np.zeros(len(held) + n_gaps)]
            columns.append(np.concatenate(parts) / h)
        return columns

    def is_closed(self, here: Place) -> bool:
        """Whether joint constraints are satisfied in positions and rates."""
        compiled, now, size = here.compiled, here.now, here.compiled.gap_sizes
        pace = self.fastest(here.trial, compiled.length) / compiled.length
        noise = rounding_of(compiled, now.parts, here.trial.state)
        held = is_held_position(compiled.model.rows.kind)
        is_closed = (np.abs(now.g) <= CLOSED * size + noise)[held].all()
        return bool(is_closed and (np.abs(now.rate) <= pace * (CLOSED * size + noise)).all())


def largest(values: Array) -> float:
    """Return the largest absolute value; 0 if there are no values."""
    return float(np.abs(values).max(initial=0.0))


def weight_of(now: Evaluated) -> float:
    """Return a typical force in the system."""
    return now.scale * np.sqrt(float(sum(block[0, 0] for block in now.W)))


def turned_forces(compiled: CompiledSystem, f: Array) -> Array:
    """Return derivatives, by body rotation, of forces f that rotate with their bodies (body axes), (n_u, n_u)."""
    by_turn = np.zeros((len(f), len(f)))
    for u0 in compiled.model.bodies.u0[:-1]:
        for k in (u0, u0 + 3):
            by_turn[k : k + 3, u0 + 3 : u0 + 6] = tilde(f[k : k + 3])
    return by_turn


def smallest_inverse(A: Array, rows: Array, columns: Array, n_p: int) -> tuple[Array, Array]:
    """Return the matrix from b to the minimum-norm x that minimises |A x - b|, and the sizes of x.

    Parameters
    ----------
    A
        Coefficients, (n_rows, n_x).
    rows
        Smallest magnitudes of rows, (n_rows,); rows are scaled to one.
    columns
        Magnitudes of the unknowns, (n_x,). Those of the last n_p are computed from A.
    n_p
        Number of open parameters.
    """
    others = slice(None, A.shape[1] - n_p)
    size = np.maximum(np.abs(A[:, others] * columns[others]).max(axis=1, initial=0.0), rows)
    by = 1 / np.where(size > 0, size, np.maximum(np.abs(A).max(axis=1, initial=0.0), 1e-300))
    of_numbers = np.abs(by[:, None] * A[:, len(columns) - n_p :]).max(axis=0, initial=0.0)
    columns = columns.copy()
    columns[len(columns) - n_p :] = 1 / np.where(of_numbers > 0, of_numbers, 1.0)
    inverse = la.pinv(by[:, None] * A * columns, rtol=SINGULAR)
    return columns[:, None] * inverse * by, columns


# steady running: the state of a vehicle that runs straight or in a circle without any change in the moving frame ------


SETTLED = 1e-7  #: largest last change of an unknown at convergence, relative to its size
STUCK = 1e-4  #: change of unknowns, relative to their sizes, below which a constant residual ends the search
SHORTEST = 1e-4  #: smallest damping factor of a Newton step


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class SteadyMotion:
    """A system in steady running.

    Parameters
    ----------
    system
        The system with the values found for its open parameters.
    equilibrium
        The steady state; `linearize(system, equilibrium)` gives small motions about it.
    speed
        Speed of the reference body [m/s].
    curvature
        Curvature of the path, positive about the axis [1/m].
    found
        Values found for the open parameters, by name.
    spins
        Speeds of spinning bodies about their axes, relative to the moving frame, by name [rad/s].
    """

    system: System
    equilibrium: Equilibrium
    speed: float
    curvature: float
    found: Mapping[str, float]
    spins: Mapping[str, float]


def steady_motion(
    system: System | Callable[..., System],
    body: str,
    speed: float | None = None,
    *,
    curvature: float | None = 0.0,
    unknown: Mapping[str, float] | None = None,
    center: Array | Sequence[float] | None = None,
    guided: bool = False,
    spinning: Mapping[str, Sequence[float]] | None = None,
    state: State | None = None,
    t: float = 0.0,
    axis: Array | tuple[float, float, float] = (0.0, 0.0, 1.0),
    tolerance: float = 1e-9,
    max_iterations: int = 60,
) -> SteadyMotion:
    """Return the state in which a system runs straight or in a circle at constant speed.

    A body spins, such as a rolling wheel, if its placed angular velocity differs from that of `body` about `axis`; the
    difference is its axis of spin. All other bodies move with `body`. Rolling without slip and states of elements are
    included.

    Parameters
    ----------
    system
        The system, with its bodies placed near the steady motion and with their velocities; or a function that takes
        the parameters of `unknown` as keyword arguments and returns such a system.
    body
        The reference body. Its frame passes the point at which it is placed (or at which it is in `state`), in the
        direction of its velocity.
    speed
        Speed of the reference body [m/s]; default: its placed speed. 0: only spinning bodies move.
    curvature
        Curvature of its path, positive about `axis` [1/m]. None: it is unknown, because the steer angle is given.
    unknown
        Initial values of open parameters of the system, by name, such as a steer angle or a drive torque.
    center
        A point on the axis of the circle, ground axes, (3,) [m], if a track determines it. It needs a curvature, whose
        magnitude is the inverse of the distance to the reference body. Default: beside this body, at this distance.
    guided
        Whether a track determines the lateral position of the system. If not, the reference body passes exactly through
        its point.
    spinning
        Axes of spinning bodies, by name, body axes, (3,), in addition to the bodies that are placed with a spin. It is
        needed for a reference body that itself spins and leans.
    state
        Initial state, such as the end of a motion; only the spins of its velocities are used. Default: as placed.
    t
        The time at which all functions of time are evaluated; they should be constant near it [s].
    axis
        Axis of the circle, ground axes, (3,).
    tolerance
        Largest unbalanced force, relative to the acting forces.
    max_iterations
        Largest number of Newton steps.

    Raises
    ------
    ConvergenceError
        If no steady motion is found.
    ModelError
        If the reference body has no speed or does not exist, a flexible body spins, or joints do not allow the motion.
    """
    family = Family(system, dict(unknown or {}))
    trial = family.first
    require_body(trial, body)
    compiled = compiled_system(trial)
    given = compiled.placed if state is None else checked(compiled, state)
    start = assembled(compiled, timed(new_work(compiled.model), t), given, known_of(compiled, state))
    carrier, path = path_of(compiled, start, body, speed, curvature, center, unit_vector("steady_motion: axis", axis))
    spins, s = spins_of(trial, compiled, start, path, spinning or {})
    search = Search(Equations(family, spins, path, guided, t), tolerance)
    return search.run(start, start_unknowns(compiled.model, known_of(compiled, state)), s, carrier, max_iterations)


@dataclass(frozen=True, eq=False)
class Search:
    """Newton's method for a steady motion."""

    equations: Equations
    tolerance: float

    def run(self, state: State, w: Array, s: Array, carrier: Carrier, max_iterations: int) -> SteadyMotion:
        """Search the steady motion near a trial and return it."""
        equations, path = self.equations, self.equations.path
        here = equations.at(Trial(state, w, s, carrier, np.array(list(equations.family.start.values()), dtype=float)))
        errors, is_stuck = [np.inf], False
        for iteration in range(max_iterations + 1):
            step = equations.step(here)
            change = equations.change(here, step)
            error = here.now.error
            if error <= self.tolerance and change <= SETTLED and equations.is_closed(here):
                return self.result(here, iteration)
            errors.append(error)
            is_stuck = change <= STUCK and len(errors) > 5 and error > 0.5 * errors[-5]
            following = None if is_stuck or not np.isfinite(step.x).all() else self.followed(here, step)
            if following is None:
                break
            here = following
        why = (
            "the system cannot run steadily with these values; make a parameter unknown (drive torque, steer angle), "
            "or the curvature (None)"
            if is_stuck
            else "place the system nearer to its steady state, or give the end of a motion as state"
        )
        raise ConvergenceError(
            f"no steady motion of body {path.name!r} at {path.speed:g} found in {iteration} steps: forces "
            f"are unbalanced by {error:.2g} of the acting forces, most at body "
            f"{worst_body(here.compiled, here.now.W, here.now.f)!r}; {why}",
            t=equations.t, h=0.0, residual=error,
        )  # fmt: skip

    def followed(self, here: Place, step: Step) -> Place | None:
        """Return the trial after a damped step, for which the simplified Newton step decreases.

        This is the natural monotonicity test: the next step, with the same matrix, must be shorter.
        """
        equations = self.equations
        y = step.x[: len(here.now.f)]
        part, length = min(1.0, LARGEST_TURN / max(largest_motion(here.compiled, y), 1e-300)), step.length(step.x)
        there = None
        while part >= SHORTEST:
            try:
                there = equations.at(equations.moved(here, part * step.x))
            except ModelError:  # the joints cannot be satisfied, or a law returns NaN
                part /= 2
                continue
            following = step.length(step.inverse @ equations.residual(there))
            if following <= (1 - part / 4) * length or length <= SETTLED:
                return there
            part /= 2 if following < 4 * length else 4
        return there

    def result(self, here: Place, iteration: int) -> SteadyMotion:
        """Return the result for a converged trial."""
        equations, path, compiled, trial = self.equations, self.equations.path, here.compiled, here.trial
        state, u_dot = carried(compiled.model, trial.state, trial.carrier, equations.spins, trial.s)
        notes = notes_at(here.system, here.work, state, u_dot, trial.w)
        told, told_u_dot = motion_of_file(compiled, state, u_dot)
        about = Equilibrium(
            replace(told, w=trial.w), told_u_dot, trial.w, trial.carrier.omega, here.now.error, iteration, notes,
            equations.t, here.system,
        )  # fmt: skip
        names = [compiled.body_names[spin.body] for spin in equations.spins]
        return SteadyMotion(
            here.system, about, path.speed, float(trial.carrier.omega @ path.axis) / (path.speed or 1.0),
            dict(zip(equations.family.start, trial.p.tolist(), strict=True)),
            dict(zip(names, trial.s.tolist(), strict=True)),
        )  # fmt: skip
