"""Equilibrium at rest, or in steady rotation about an axis that is fixed in space.

The solution is followed along a flow that ends in the equilibrium, with growing implicit steps (pseudo-transient
continuation):

    (1) at a state x:  residual f(x) of the bodies, constraint errors g(x) of the joints, at the velocities of the
        steady motion
    (2) (W/tau + K) dx - Jᵀ dw = -f,   G dx = -g          W: mass and modal stiffness, K: complete tangent
    (3) tau grows as f decreases: small tau follows the flow downhill, large tau is Newton's method
    (4) states z of elements follow their rates by implicit steps of sqrt(tau), z_new = z + sqrt(tau) g(z_new)

Motions without resistance (a wheel on its hinge) do not change, because W/tau restrains them. If the flow fails, for
example for beams of stiff bushings that bend and twist, it is abandoned (`Progress`), and increasing loads lead to the
equilibrium (`led_equilibrium`). If elements have states, such as a controller with an observer, the flow need not
converge to an equilibrium even if the motion does, because it ignores velocities; Newton's method alone is then tried.
"""

import logging
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, IntArray
from floatframe.analyses.led_equilibrium import LARGEST, Balance, LoadPathEnd, is_left_by_none, led_equilibrium
from floatframe.analyses.observed_state import observed_state
from floatframe.analyses.relative.tree_flow import tree_flow
from floatframe.analyses.snapshot import Equilibrium
from floatframe.analyses.system_matrices import held_rows, turning_matrices
from floatframe.engine.compiling.callbacks import raise_errors_of
from floatframe.engine.compiling.file_frames import motion_of_file
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.initial import (
    assembled,
    checked,
    known_of,
    require_independent_constraints,
    require_numbers,
    start_unknowns,
)
from floatframe.engine.initial_conditions.mass_positivity import indefinite_mass_words, indefinite_masses
from floatframe.engine.initial_conditions.newton_equations import (
    Linearized,
    by_velocities,
    displaced,
    in_ground_axes,
    linearized,
    modal_matrix,
    set_iterate,
    solve,
    with_modal_weight,
)
from floatframe.engine.initial_conditions.placement import require_placed_near
from floatframe.engine.kernels.model import STIFFNESS, Model
from floatframe.engine.kernels.work import Work, new_work
from floatframe.engine.tree.formulation import is_relative
from floatframe.engine.tree.topology import tree_of
from floatframe.errors import ConvergenceError, ModelError
from floatframe.model.checked_values import array_of_shape
from floatframe.model.joints.rows import is_held_length, is_held_velocity
from floatframe.model.rotations import rotation_matrix
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.validity import ValidityNote
from floatframe.simulation.stop_events import require_off_stops
from floatframe.simulation.validity_watch import ValidityWatch

__all__ = ["static_equilibrium", "steady_rotation"]

log = logging.getLogger(__name__)

LARGEST_TURN = 0.5  #: largest motion in one step: rotation [rad], and translation relative to the size of the system
#: factors by which tau grows in one step if the residual decreases, and if it stagnates
FASTEST_GROWTH, LEAST_GROWTH = 30.0, 2.0
#: ratio of the previous residual to the present one below which the residual counts as increasing, and tau is reduced
STANDING = 0.9
#: ratio of other forces to the assembled spring forces below which only springs move the system
STANDING_SPRINGS = 1e-9
ROUNDING = 32 * np.finfo(float).eps  #: relative rounding error of a position or rotation, as it affects springs
STANDSTILL = 1e-200  #: residual, relative to the first one, below which it counts as zero
LONG_STEP = 1e4  #: step size of element states, relative to the first step, from which unchanged states are at rest
LONGEST_STEP = 1e10  #: longest step of element states, in units of time
SLOWER = 1e-6  #: largest relative loss of speed per revolution that a steady rotation may have
HELD = 1e-6  #: rate of a joint constraint, relative to the rotation, above which the joint prevents the rotation
CLOSED = 1e-10  #: largest constraint error of a joint, relative to the size of the system
#: number of steps in which unbalanced forces, constraint errors or changes of states must fall to half their minimum.
#: The slowest equilibria of the tests, a free spinning body and a beam far above buckling, needed 28 and 29
PATIENCE = 40


@dataclass(eq=False)
class StatesAtRest:
    """Element states that approach rest in step (4), and the unknowns of their equations; without user forces."""

    solved: IntArray  #: indices of the element states among all states
    rows: IntArray  #: rows of the values of these states
    equations: IntArray  #: rows of multipliers without constraint
    sizes: Array  #: typical sizes of these states and multipliers
    own: NDArray[np.bool_]  #: whether each row belongs to these states and multipliers, (n_w,)
    names: tuple[str, ...]  #: names of these states and multipliers, with their elements
    change: Array = field(default_factory=lambda: np.full(1, np.inf))  #: last changes, relative to the sizes
    first_step: float = 0.0
    last_step: float = 0.0

    @classmethod
    def of(cls, compiled: CompiledSystem) -> "StatesAtRest":
        """Return the element states of a system."""
        model = compiled.model
        solved = np.arange(int(model.laws.state0[0]), len(model.states.row))
        rows, equations = model.states.row[solved], model.laws.equation
        own = np.zeros(int(model.connections.w0[-1]), dtype=bool)
        for row in (rows, rows + 1, rows + 2, equations):
            own[row] = True
        sizes = np.concatenate([model.states.size[solved], model.laws.equation_size])
        states = [f"{each.element.name}.{name}" for each in compiled.laws for name in each.law.states]
        of_rows = {
            row: f"{each.element.name}.{name}"
            for each in compiled.laws
            for row, name in zip(each.multipliers, each.law.multipliers, strict=True)
        }
        names = (*states, *(of_rows[int(row)] for row in equations))
        return cls(solved, rows, equations, sizes, own, names)

    def prepare(self, work: Work, w: Array, tau: float) -> None:
        """Begin a step from the unknowns w."""
        step = min(float(np.sqrt(tau)), LONGEST_STEP)
        work.states.base[self.solved] = w[self.rows]
        work.states.kappa[self.solved] = step
        self.first_step, self.last_step = self.first_step or step, step

    def follow(self, w: Array, dw: Array) -> None:
        """Record the change dw of the unknowns in a step."""
        at = np.concatenate([self.rows, self.equations])
        self.change = np.abs(dw[at]) / np.maximum(self.sizes, np.abs(w[at]))

    def are_at_rest(self, tolerance: float) -> bool:
        """Return whether a long step has changed no state."""
        if not len(self.sizes):
            return True
        is_long = self.last_step >= min(LONG_STEP * self.first_step, LONGEST_STEP) > 0
        return is_long and float(self.change.max()) <= tolerance

    def description(self, tolerance: float) -> str:
        """Return a description of a state that does not come to rest; empty if all do."""
        if not len(self.sizes) or self.change.max() <= tolerance:
            return ""
        return f"; state {self.names[int(self.change.argmax())]!r} of an element does not come to rest"


@dataclass(eq=False)
class Progress:
    """Smallest values so far of the quantities that decrease towards an equilibrium, and the last times they halved."""

    #: smallest unbalanced forces, constraint errors and changes of states so far
    smallest: Array = field(default_factory=lambda: np.full(3, np.inf))
    iteration: int = 0

    def has_ended(self, iteration: int, values: tuple[float, float, float]) -> bool:
        """Record the values after an iteration; return whether none has halved for too many steps."""
        falls = np.array(values) < 0.5 * self.smallest
        if falls.any():
            self.smallest[falls] = np.array(values)[falls]
            self.iteration = iteration
        return iteration - self.iteration >= PATIENCE


@dataclass(frozen=True, eq=False)
class FlowFailure:
    """The end of the flow if it reaches no equilibrium."""

    iteration: int
    has_stood: bool  #: whether the flow has stagnated for the permitted number of steps
    error: float  #: unbalanced forces relative to the acting forces
    state: State
    W: tuple[Array, ...]
    forces: Array


def static_equilibrium(
    system: System,
    state: State | None = None,
    *,
    tolerance: float = 1e-9,
    max_iterations: int = 200,
    formulation: str = "absolute",
) -> Equilibrium:
    """Return the equilibrium at rest near a state (default: the assembled bodies) under all forces of the system.

    Parameters
    ----------
    system
        The system.
    state
        State near the equilibrium, from which the search begins; None: the assembled bodies.
    tolerance
        Largest unbalanced force, relative to the acting forces.
    max_iterations
        Largest number of steps; fewer are made if there is no progress.
    formulation
        "absolute", or "relative" for joint coordinates, in which the joints of the tree are satisfied exactly.

    Raises
    ------
    ConvergenceError
        If there is no equilibrium nearby, because a part is free to fall, or it is too far away. The error is raised
        when the search makes no more progress; the message describes the attempts.
    ModelError
        If the joint constraints cannot be satisfied, or some constraints are redundant.
    """
    return steady_rotation(
        system, (0.0, 0.0, 0.0), state=state, tolerance=tolerance, max_iterations=max_iterations,
        formulation=formulation,
    )  # fmt: skip


def steady_rotation(
    system: System,
    omega: Array | tuple[float, float, float],
    *,
    center: Array | tuple[float, float, float] = (0.0, 0.0, 0.0),
    state: State | None = None,
    tolerance: float = 1e-9,
    max_iterations: int = 200,
    formulation: str = "absolute",
) -> Equilibrium:
    """Return the state in which the whole system rotates as a rigid body about an axis fixed in space.

    Parameters
    ----------
    system
        The system; its joints to the ground must allow the rotation, and its forces must rotate with it.
    omega
        Angular velocity in ground axes, (3,) [rad/s].
    center
        A point of the axis in ground axes, (3,) [m].
    state
        Initial guess; its velocities are ignored. Default: the assembled bodies.
    tolerance
        Largest unbalanced force, relative to the acting forces.
    max_iterations
        Largest number of steps; fewer are made if there is no progress.
    formulation
        "absolute", or "relative" for joint coordinates, in which the joints of the tree are satisfied exactly.

    Raises
    ------
    ConvergenceError
        If no such motion is found.
    ModelError
        If there is no such formulation, the joint constraints cannot be satisfied or do not allow the rotation, or some
        constraints are redundant.
    """
    omega = array_of_shape("steady_rotation: omega", omega, (3,))
    center = array_of_shape("steady_rotation: center", center, (3,))
    compiled = compiled_system(system)
    model = compiled.model
    rolling = [name for name, rolls in zip(compiled.owners, is_held_velocity(model.rows.kind), strict=True) if rolls]
    if rolling:
        raise ModelError(
            f"joint {rolling[0]!r} rolls without slip: equilibria and steady rotations do not support velocity "
            "constraints; use steady_motion, also for speed 0"
        )
    resting = compiled.resting_model
    flow = None
    if is_relative(formulation):
        flow = tree_flow(system, lambda state: turning(compiled, state, omega, center), rests=not omega.any())
    states = StatesAtRest.of(compiled)
    work = new_work(model)
    w = start_unknowns(model, known_of(compiled, state))
    given = compiled.placed if state is None else checked(compiled, state)
    state = assembled(compiled, work, given)
    require_placed_near(compiled, given, state)
    require_independent_constraints(compiled, work, tree_of(system).tree, state)
    holds = held_rows(model)

    def followed(
        state: State, w: Array, *, by_newton: bool = False, runs_down: bool = False
    ) -> "Equilibrium | FlowFailure":
        """Return the steady rotation found from a state by the flow or, with `by_newton`, by Newton's method alone.

        With `runs_down`, the forces that slow the rotation need no balance, but they must be small.
        """
        tau, last, progress, has_stood = np.inf if by_newton else 0.0, np.inf, Progress(), False
        for iteration in range(max_iterations + 1):
            state, u_dot = turning(compiled, state, omega, center)
            set_iterate(work, state, u_dot, w)
            states.prepare(work, w, tau)
            if flow is not None:
                w = flow.wrenches(work, state, u_dot, w)
            parts, K = _tangent(resting, work, omega)
            raise_errors_of(compiled.callbacks)
            require_numbers(compiled, work)
            mass = linearized(resting, work, 1.0, 0.0, 0.0).H
            W = with_modal_weight(model, mass)
            forces, gaps = work.bodies.residual.copy(), work.connections.g.copy()
            slows = 0.0
            if runs_down:
                forces, slows = without_slowing(compiled, work, W, parts, forces)
            size = size_of(W, forces)
            scale_of_forces = forces_at_work(compiled, work, parts, W)
            # a stiffened body is deformed beyond the validity of its second-order terms
            if not np.isfinite(size + scale_of_forces):
                error = np.inf
                break
            noise = rounding_of(compiled, parts, state)
            is_nothing = scale_of_forces <= size_of(
                W, abs(parts.J).T @ np.where(holds, 0.0, noise)
            )  # springs relax to zero force
            error = 0.0 if is_nothing else size / scale_of_forces
            # steps no longer reduce the unbalanced forces, and these are not larger than rounding errors
            is_rounding = 0.5 * last < size <= size_of(W, rounding_of_inertia(model, mass, state, omega, center))
            is_balanced = error <= tolerance or is_rounding
            is_closed = bool((np.abs(gaps) <= CLOSED * compiled.gap_sizes + noise)[holds].all())
            told = tolerance * np.abs(w[~states.own]).max(initial=0.0) + noise
            is_told = bool((np.abs(gaps) <= told)[~holds & ~states.own].all())
            is_steady = slows <= SLOWER * float(np.linalg.norm(omega)) / (2 * np.pi)
            if is_balanced and is_closed and is_told and is_steady and states.are_at_rest(tolerance):
                _require_rotation(compiled, work, omega)
                require_off_stops(system, w)
                notes = notes_at(system, work, state, u_dot, w)
                told_state, told_u_dot = motion_of_file(compiled, state, u_dot)
                rest = replace(told_state, w=w)
                return Equilibrium(rest, told_u_dot, w, omega, error, iteration, notes, system=system)
            change = float(states.change.max()) if len(states.sizes) else np.inf
            has_stood = progress.has_ended(iteration, (size, float(np.abs(gaps).max(initial=0.0)), change))
            if iteration == max_iterations or has_stood:
                break
            if tau == 0.0:
                pulled = forces - parts.J.T @ wrenches_by_law(model, parts, gaps, holds | states.own)
                at_first = size if size > STANDING_SPRINGS * size_of(W, pulled) else size_of(W, pulled)
                tau = 0.1 * compiled.length / max(at_first / np.sqrt(_total_mass(W)), STANDSTILL)
            elif not by_newton:
                # below the tolerance, the residual is roundoff: tau grows as fast as allowed
                fall = last / max(size, np.finfo(float).tiny) if not is_balanced else np.inf
                tau *= min(max(fall, LEAST_GROWTH), FASTEST_GROWTH) if fall > STANDING else max(fall, 0.1)
            last = size
            ds = None
            if flow is not None:
                ds, moved, dw = flow.step(work, state, u_dot, w, tau)
            # smaller changes are noise of the coordinates; refine body by body
            if ds is None or not np.abs(moved).max() > ROUNDING:
                try:
                    y, dw = solve(tuple(k + m / tau for k, m in zip(K, W, strict=True)), parts, -forces, -gaps)
                except RuntimeError:  # exactly singular: a part is free to move
                    if not by_newton:
                        raise
                    break
                ds, moved = None, in_ground_axes(model, state, y)
            if not np.isfinite(moved).all():
                break
            far = largest_motion(compiled, moved, only_turns=by_newton)
            part = min(1.0, LARGEST_TURN / max(far, 1e-300))
            if flow is not None and ds is not None:
                state = flow.displaced(work, state, part * ds)
            else:
                state = displaced(model, state, part * moved)
            w = w + part * dw
            states.follow(w, dw)
        return FlowFailure(iteration, has_stood, error, state, tuple(W), forces)

    found, tried = followed(state, w), ""
    if isinstance(found, FlowFailure) and not states.own.any():
        led, is_end = led_by_loads(compiled, work, omega, center, state, w)
        if is_end:
            again = followed(led.state, led.w)
            if isinstance(again, Equilibrium):
                log.info("system %r: the equilibrium was found by loads that grow, in small steps", system.name)
                return replace(again, n_iterations=found.iteration + again.n_iterations)
        tried = words_of(led, is_end)
    if isinstance(found, FlowFailure) and omega.any():
        again = followed(found.state, w, runs_down=True)
        if isinstance(again, Equilibrium):
            return replace(again, n_iterations=found.iteration + again.n_iterations)
    if isinstance(found, FlowFailure) and states.own.any():
        again = followed(state, w, by_newton=True)
        if isinstance(again, Equilibrium):
            return replace(again, n_iterations=found.iteration + again.n_iterations)
    if isinstance(found, Equilibrium):
        return found
    lost = indefinite_masses(system, found.state)
    why = (
        f"loads at or above buckling deform it too far, or the equilibrium is far away; {indefinite_mass_words(lost)}"
        if lost
        else f"forces are out of balance by {found.error:.2g} of the acting forces, most at body "
        f"{worst_body(compiled, found.W, found.forces)!r}{states.description(tolerance)}; fix what can fall or drift, "
        "start nearer (from the state under a part of the loads), or add damping and integrate until it rests"
    )
    stood = f", without progress in the last {PATIENCE}" if found.has_stood else ""
    words = f"no equilibrium found in {found.iteration} steps{stood}{tried}: {why}"
    raise ConvergenceError(words, t=0.0, h=0.0, residual=found.error)


def without_slowing(
    compiled: CompiledSystem, work: Work, W: tuple[Array, ...], parts: Linearized, forces: Array
) -> tuple[Array, float]:
    """Return unbalanced forces without the part that slows the rotation, and the relative rate of slowing [1/s].

    A freely spinning rotor is slowed by the damping of its bearings, which no steady motion balances. With s the
    velocities of the rotation, forces f = f' + c M s, f'·s = 0, slow it at the rate c. They are returned unchanged if
    the rotation is prescribed.
    """
    s, momentum, first = work.state.u.copy(), np.zeros_like(forces), 0
    for i, block in enumerate(W):
        u = slice(first, first + len(block))
        s[first : first + 3] = work.state.R[i].T @ s[first : first + 3]
        momentum[u] = block @ s[u]  # W also contains modal stiffness, but no mode moves
        first += len(block)
    held = np.abs(parts.G @ s)[is_driven_turn(compiled.model)]
    energy = float(momentum @ s)
    if not energy > 0.0 or held.max(initial=0.0) > HELD * float(np.linalg.norm(s[3:6])):
        return forces, 0.0
    c = float(forces @ s) / energy
    return forces - c * momentum, abs(c)


def is_driven_turn(model: Model) -> NDArray[np.bool_]:
    """Return whether each row prescribes an angle, (n_w,)."""
    return np.asarray((model.rows.motion >= 0) & ~is_held_length(model.rows.kind))


def words_of(led: LoadPathEnd, is_stable: bool) -> str:
    """Return a description of the end of the load path; empty if increasing loads were not tried."""
    if led.n_solves == 0:
        return ""
    if led.p == 1.0 and not is_stable:
        return f", and increasing loads ({led.n_solves} solves) lead only to an unstable one"
    return f", nor by increasing loads ({led.n_solves} solves, up to {100 * led.p:.3g} % of them)"


def led_by_loads(
    compiled: CompiledSystem, work: Work, omega: Array, center: Array, state: State, w: Array
) -> tuple[LoadPathEnd, bool]:
    """Return the state that increasing loads reach, and whether it is near a stable equilibrium of the system."""
    model, resting = compiled.model, compiled.resting_model
    if len(state.u) + len(w) > LARGEST:
        return LoadPathEnd(state, w, 0.0, 0), False

    def tangents(state: State, w: Array) -> tuple[Linearized, tuple[Array, ...]]:
        moving, u_dot = turning(compiled, state, omega, center)
        set_iterate(work, moving, u_dot, w)
        parts, K = _tangent(resting, work, omega)
        raise_errors_of(compiled.callbacks)
        return parts, K

    def balance(state: State, w: Array) -> Balance | None:
        parts, K = tangents(state, w)
        forces, gaps = work.bodies.residual.copy(), work.connections.g.copy()
        if not (np.isfinite(forces).all() and np.isfinite(gaps).all()):
            return None

        def way(out_of_balance: Array, open_by: Array) -> tuple[Array, Array]:
            try:
                y, dw = solve(K, parts, -out_of_balance, -open_by)
            except RuntimeError:  # exactly singular: a part is free to move
                return np.full(len(forces), np.inf), gaps
            return in_ground_axes(model, state, y), dw

        return Balance(forces, gaps, way)

    led = led_equilibrium(
        state, w, balance, lambda state, way: displaced(model, state, way), lambda way: largest_motion(compiled, way)
    )
    if led.p < 1.0:
        return led, False
    parts, K = tangents(led.state, led.w)
    W = with_modal_weight(model, linearized(resting, work, 1.0, 0.0, 0.0).H)
    return led, is_left_by_none(parts, K, W)


def wrenches_by_law(model: Model, parts: Linearized, gaps: Array, others: NDArray[np.bool_]) -> Array:
    """Return the change of wrenches that makes springs, bushings etc. satisfy their laws at this state, (n_w,).

    Only for connections without constraints and states, whose rows V dw = -g have no other unknowns.
    """
    change, w0 = np.zeros(len(gaps)), model.connections.w0
    for first, last in pairwise(w0.tolist()):
        rows = slice(first, last)
        if first == last or others[rows].any() or not gaps[rows].any():
            continue
        block = parts.V[rows, rows].toarray()
        if np.linalg.cond(block) < 1e12:
            change[rows] = np.linalg.solve(block, -gaps[rows])
    return change


def notes_at(system: System, work: Work, state: State, u_dot: Array, w: Array) -> tuple[ValidityNote, ...]:
    """Return and log notes on bodies that exceed the linear range of their frame in a state of the engine."""
    watch = ValidityWatch(system)
    rows, _ = observed_state(compiled_system(system), work, state, u_dot, w, 0.0)
    for note in watch.observe(rows):
        log.warning("equilibrium: %s", note.words)
    return watch.notes


def turning(compiled: CompiledSystem, state: State, omega: Array, center: Array) -> tuple[State, Array]:
    """Return the state with velocities of a common rotation about an axis, and the accelerations, (n_u,)."""
    u, u_dot = np.zeros_like(state.u), np.zeros_like(state.u)
    for i, u0 in enumerate(compiled.model.bodies.u0[:-1]):
        v = np.cross(omega, state.r[i] - center)
        u[u0 : u0 + 3] = v
        u[u0 + 3 : u0 + 6] = rotation_matrix(state.p[i]).T @ omega
        u_dot[u0 : u0 + 3] = np.cross(omega, v)
    return State(state.r, state.p, state.q, u), u_dot


def _tangent(model: Model, work: Work, omega: Array) -> tuple[Linearized, tuple[Array, ...]]:
    """Return the linearised system, and the tangent matrix of each body.

    A change of the position changes velocities and accelerations as in a steady rotation.
    """
    parts = linearized(model, work, 0.0, 0.0, 1.0)
    if not work.state.u.any():
        return parts, parts.H
    Omega, Omega_t = turning_matrices(model, work, omega)
    C, G_v = by_velocities(model, work, parts)
    mass = linearized(model, work, 1.0, 0.0, 0.0).H
    K = []
    for i, k in enumerate(parts.H):
        u = slice(int(model.bodies.u0[i]), int(model.bodies.u0[i + 1]))
        K.append(k + C[i] @ Omega[u, u] + mass[i] @ Omega_t[u, u] @ Omega[u, u])
    G = parts.G + G_v @ sp.csr_array(Omega)
    return Linearized(parts.H, parts.J, sp.csr_array(G), parts.V), tuple(K)


def size_of(W: tuple[Array, ...], forces: Array) -> float:
    """Return the norm of forces with W⁻¹ (for one mass: force over root of mass); nan without mass."""
    total, first = 0.0, 0
    for block in W:
        f = forces[first : first + len(block)]
        total += float(f @ np.linalg.solve(block, f))
        first += len(block)
    return float(np.sqrt(total)) if total >= 0 else float("nan")


def forces_at_work(compiled: CompiledSystem, work: Work, parts: Linearized, W: tuple[Array, ...]) -> float:
    """Return the norm of joint, spring, weight and elastic forces, in the same norm as the residual."""
    bodies, residual = compiled.model.bodies, work.bodies.residual
    reactions = parts.J.T @ work.state.w if len(work.state.w) else np.zeros_like(residual)
    elastic = np.zeros_like(residual)
    for i, u0 in enumerate(bodies.u0[:-1]):
        q = work.state.q[int(bodies.q0[i]) : int(bodies.q0[i + 1])]
        elastic[int(u0) + 6 : int(bodies.u0[i + 1])] = modal_matrix(compiled.model, i, STIFFNESS) @ q
    return max(size_of(W, part) for part in (reactions, residual + reactions, elastic))


def rounding_of(compiled: CompiledSystem, parts: Linearized, state: State) -> Array:
    """Return the rounding error of each row's residual due to positions, (n_w,); large for stiff springs."""
    reach = np.ones(len(state.u))
    for i, u0 in enumerate(compiled.model.bodies.u0[:-1]):
        reach[u0 : u0 + 3] = compiled.length + np.abs(state.r[i]).max()
        q = slice(int(compiled.model.bodies.q0[i]), int(compiled.model.bodies.q0[i + 1]))
        reach[u0 + 6 : compiled.model.bodies.u0[i + 1]] = np.abs(state.q[q])
    return np.asarray(ROUNDING * (abs(parts.G) @ reach))


def rounding_of_inertia(model: Model, mass: tuple[Array, ...], state: State, omega: Array, center: Array) -> Array:
    """Return errors of a rotation's inertia forces caused by rounded positions, (n_u,); large far from the origin."""
    forces = np.zeros(len(state.u))
    for i, block in enumerate(mass):
        u = slice(int(model.bodies.u0[i]), int(model.bodies.u0[i + 1]))
        error = ROUNDING * (np.abs(state.r[i]).max() + np.abs(center).max())
        forces[u] = float(omega @ omega) * error * np.abs(block[:, :3]).sum(axis=1)
    return forces


def _total_mass(W: tuple[Array, ...]) -> float:
    return float(sum(block[0, 0] for block in W))


def largest_motion(compiled: CompiledSystem, y: Array, *, only_turns: bool = False) -> float:
    """Return the largest translation (relative to the size of the system) or rotation of a body."""
    largest = 0.0
    for u0 in compiled.model.bodies.u0[:-1]:
        way = 0.0 if only_turns else float(np.linalg.norm(y[u0 : u0 + 3])) / compiled.length
        largest = max(largest, way, float(np.linalg.norm(y[u0 + 3 : u0 + 6])))
    return largest


def worst_body(compiled: CompiledSystem, W: tuple[Array, ...], forces: Array) -> str:
    u0 = compiled.model.bodies.u0
    sizes = [size_of((block,), forces[u0[i] : u0[i + 1]]) for i, block in enumerate(W)]
    return compiled.body_names[int(np.argmax(sizes))]


def _require_rotation(compiled: CompiledSystem, work: Work, omega: Array) -> None:
    """Raise `ModelError` with the joint that prevents the rotation."""
    from floatframe.engine.kernels.entry import rates_of_constraints

    if not omega.any() or not len(work.state.w):
        return
    rate, _ = rates_of_constraints(compiled.model, work)
    speed, kinds = float(np.linalg.norm(omega)), compiled.model.rows.kind
    rate = np.where(held_rows(compiled.model), np.abs(rate), 0.0)
    rate /= np.where(is_held_length(kinds), compiled.length + np.abs(work.state.r).max(), 1.0) * speed
    worst = int(np.argmax(rate))
    if rate[worst] > HELD:
        joint = int(np.searchsorted(compiled.model.connections.w0, worst, side="right")) - 1
        name = compiled.connection_names[joint]
        if compiled.model.rows.motion[worst] >= 0:
            raise ModelError(
                f"steady_rotation: a motion drives joint {name!r} at a speed that differs from {speed:g} by "
                f"{rate[worst] * speed:.4g}; correct this speed, or remove the motion"
            )
        raise ModelError(
            f"steady_rotation: joint {name!r} does not allow a rotation with omega = "
            f"{omega.tolist()}; give omega along the axis of the joint, and a point of this axis as center"
        )
