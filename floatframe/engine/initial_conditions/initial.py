"""Consistent initial conditions: assembled positions, compatible velocities, accelerations and reactions.

All three solve the same system with the mass matrix M of the bodies and the rows G of the joints (P, V as in
joints/rows/kinds.py; the unknown reactions w include the rows GAUGE and SPRING):

    (1) positions       W dx - Jᵀ w = 0,       G dx = -g           W = M + s K; Newton until g = 0
    (2) velocities      W du - Jᵀ w = 0,       G du = -G u
    (3) accelerations   M u_dot - Jᵀ w = f,    G u_dot = -d(G)/dt u

W is the mass plus the scaled stiffness, so that (1) and (2) move the bodies instead of deforming them.
"""

import logging
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.engine.compiling.callbacks import raise_errors_of
from floatframe.engine.compiling.file_frames import motion_of_file, state_of_engine
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.constraint_words import conflict_of_drives, drive_name, open_joints
from floatframe.engine.initial_conditions.freedoms import Mobility, constraint_mobility, scaled_constraints
from floatframe.engine.initial_conditions.gaps import gaps_at, has_gaps
from floatframe.engine.initial_conditions.newton_equations import (
    STIFF_START,
    displaced,
    in_ground_axes,
    linearized,
    set_iterate,
    solve,
    with_mass_for_all,
    with_modal_weight,
)
from floatframe.engine.initial_conditions.placement import require_placed_near
from floatframe.engine.kernels.model import JOINT, USER_FORCE, Model
from floatframe.engine.kernels.work import Work, new_work
from floatframe.engine.tree.kernels.tree import Tree
from floatframe.engine.tree.topology import tree_of
from floatframe.engine.tree.tree_motions import coordinate_motions
from floatframe.errors import ModelError
from floatframe.model.bodies.rigid_body import euler_parameters_from_user
from floatframe.model.checked_values import array_of_shape
from floatframe.model.joints.rows import DOT, TURN, TURN_B, is_held, is_held_position
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = [
    "ConsistentState",
    "acceleration_rates",
    "consistent_motion",
    "consistent_state",
    "driven_angles",
    "known_of",
    "led_by",
    "mobility",
    "repeated_constraints",
    "require_no_half_turns",
    "require_numbers",
    "solve_accelerations",
    "stages",
    "start_unknowns",
    "way_of_drives",
    "work_from",
]


log = logging.getLogger(__name__)

ASSEMBLED = 1e-12  #: largest residual |g| of a closed joint; for points relative to the size of the system
MOST_ITERATIONS = 30
ENDLESS = 1e12  #: size of a correction (rad, or relative length) above which the matrix counts as singular
OF_STEP = 0.1  #: difference step for rates of accelerations, as a fraction of the time step
NEAREST = 1e-6  #: the same fraction if a contact is close
NEAR_BY = 1e-3  #: test displacement from a position, in rad or relative to the size of the system
#: singular value of the constraints of rigid bodies, relative to the largest, below which a motion is free
ALLOWED = 1e-10


def mobility(system: System) -> Mobility:
    """Return the mobility of a system in its assembled position, after closing its joints.

    Parameters
    ----------
    system
        The system.

    Raises
    ------
    ModelError
        If the joints cannot be closed from the given positions.
    """
    compiled = compiled_system(system)
    work = new_work(compiled.model)
    return constraint_mobility(compiled, work, assembled(compiled, work, compiled.placed))


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ConsistentState:
    """A state that fulfils the joints, with its accelerations and reactions.

    Parameters
    ----------
    state
        The state that satisfies all constraints.
    u_dot
        Accelerations, (n_u,).
    w
        Wrenches of the connections on their markers A, ground axes, (n_w,).
    """

    state: State
    u_dot: Array
    w: Array


def consistent_state(
    system: System, state: State | None = None, *, t: float = 0.0, known: Array | None = None
) -> ConsistentState:
    """Return a consistent state near a given state or near the assembled bodies, with prescribed motions at time t.

    Parameters
    ----------
    system
        The system.
    state
        Positions and velocities to start from; None: the assembled bodies.
    t
        Time at which prescribed motions are evaluated [s].
    known
        Wrenches and other unknowns of an earlier motion, (n_w,). Counted angles of couplers and states of user forces
        continue from them; None: they begin anew.

    Raises
    ------
    ModelError
        If the joints cannot be closed from these positions, or some constraints repeat others.
    """
    made = consistent_motion(system, state, t=t, known=known)
    return ConsistentState(*motion_of_file(compiled_system(system), made.state, made.u_dot), made.w)


def consistent_motion(
    system: System,
    state: State | None = None,
    *,
    t: float = 0.0,
    known: Array | None = None,
    angle: Array | None = None,
) -> ConsistentState:
    """Return the result of `consistent_state` in the frames of the engine, for a state in the frames of the files.

    angle: counted angles of an earlier motion, (n_angles,), from which bushings continue; None: those of the state.
    """
    compiled = compiled_system(system)
    given = compiled.placed if state is None else checked(compiled, state)
    known = known_of(compiled, state) if known is None else known
    angle = counted_angles_of(compiled, state) if angle is None else angle
    work = work_from(compiled.model, known)
    work.state.time[...] = t
    if angle is not None and len(angle):
        work.state.angle[:] = angle
    state = assembled(compiled, work, given, known)
    require_placed_near(compiled, given, state)
    require_no_half_turns(compiled, work, state)
    require_independent_constraints(compiled, work, tree_of(system).tree, state)
    state = with_compatible_velocities(compiled, work, state, known)
    return ConsistentState(state, *solve_accelerations(compiled, work, state, known, warns=True))


def known_of(compiled: CompiledSystem, state: State | None) -> Array | None:
    """Return the connection unknowns in a state if force states or counted angles continue from it; otherwise None.

    Raises
    ------
    ModelError
        If they are those of another system.
    """
    if state is None or state.w is None:
        return None
    n_w, has_states = int(compiled.model.connections.w0[-1]), len(compiled.model.states.row) > 0
    if state.w.shape != (n_w,) and not has_states:
        return None
    if state.w.shape != (n_w,):
        raise ModelError(
            f"state: w: expected the {n_w} unknowns of this system's joints, forces and elements, got {len(state.w)} "
            "of another system; to use the initial values of their states, call dataclasses.replace(state, w=None)"
        )
    return state.w


def counted_angles_of(compiled: CompiledSystem, state: State | None) -> Array | None:
    """Return the counted angles stored in a state if their number matches the system; otherwise None."""
    if state is None or state.angle is None or state.angle.shape != (len(compiled.angles),):
        return None
    return state.angle


def checked(compiled: CompiledSystem, state: State) -> State:
    """Return a user's state in the frames of the engine; `ModelError` if its sizes do not match the system."""
    p = np.empty_like(compiled.placed.p)
    for name in ("r", "p", "q", "u"):
        value = array_of_shape(f"state: {name}", getattr(state, name), getattr(compiled.placed, name).shape)
        if name == "p":
            for i, parameters in enumerate(value):
                p[i] = euler_parameters_from_user(f"state: p of body {compiled.body_names[i]!r}", parameters)
    return state_of_engine(compiled, State(state.r, p, state.q, state.u))


def assembled(compiled: CompiledSystem, work: Work, state: State, known: Array | None = None) -> State:
    """(1): return the state with all joints closed and prescribed angles at their values."""
    model = compiled.model
    if not is_held_position(model.rows.kind).any():
        return state
    w, drives, near = start_unknowns(model, known), driven_angles(model), state
    if len(drives):
        for left in stages(way_of_drives(model, work, state, w, drives)):
            near, error = closed(compiled, led_by(model, drives, left), work, near, w)
            if error.any():  # a position on the path is out of reach, although the drive itself may be within reach
                near = state
                break
    end, error = closed(compiled, model, work, near, w)
    if error.any():
        refuse_open_joints(compiled, work, end, error)
    if len(drives):
        missed = drives[np.abs(way_of_drives(model, work, end, w, drives)) > np.pi / 2]
        if len(missed):
            raise ModelError(
                f"{' and '.join(drive_name(compiled, row) for row in missed)}: closing the joints from the given "
                "positions ends half a turn from the prescribed angle; place the bodies nearer to it"
            )
    return end


def closed(compiled: CompiledSystem, model: Model, work: Work, state: State, w: Array) -> tuple[State, Array]:
    """Return the state with the joints of a model closed, and the remaining residuals of the rows, (n_w,)."""
    holds = is_held_position(model.rows.kind)
    scale = compiled.gap_sizes
    for _ in range(MOST_ITERATIONS):
        set_iterate(work, state, w=w)
        parts = linearized(model, work, 1.0, 0.0, 0.0)
        raise_errors_of(compiled.callbacks)
        require_numbers(compiled, work)
        error = np.where(holds, work.connections.g, 0.0)
        if np.abs(error / scale).max() <= ASSEMBLED:
            return state, np.zeros_like(error)
        try:
            y, _ = solve(with_modal_weight(model, parts.H, STIFF_START), parts, np.zeros(len(work.state.u)), -error)
        except RuntimeError:
            break
        if not np.abs(y).max() < ENDLESS:  # also true for NaN: the equations are singular
            break
        state = displaced(model, state, in_ground_axes(model, state, y))
    return state, np.where(np.abs(error / scale).max() <= 1e-9, 0.0, error)


def refuse_open_joints(compiled: CompiledSystem, work: Work, state: State, error: Array) -> None:
    """Raise `ModelError` with the names of the joints that remain open, or of the prescribed motions in conflict."""
    conflict = conflict_of_drives(compiled, work, state)
    if conflict:
        raise ModelError(f"conflicting drives: {conflict}; remove one of them, or free the coordinate that opposes it")
    is_driven = (compiled.model.rows.motion[is_held_position(compiled.model.rows.kind)] >= 0).any()
    reach = ", and that the drives stay within reach" if is_driven else ""
    unplaced = [repr(name) for name, is_free in zip(compiled.body_names, compiled.by_joints, strict=True) if is_free]
    if unplaced:
        reach += f". No position is given for {', '.join(unplaced)}: in a loop, give orientations near the real ones"
    raise ModelError(
        f"the joints cannot be closed from the given positions: {open_joints(compiled, error)}; place the bodies "
        f"nearer to their joints, or check lengths and axes{reach}"
    )


def require_independent_constraints(compiled: CompiledSystem, work: Work, tree: Tree, state: State) -> None:
    """Raise `ModelError` with the joints of redundant constraints, unless the system lets them share reactions."""
    model = compiled.model
    holds = is_held(model.rows.kind)
    if not holds.any() or model.rows.soft.any():
        return
    n_redundant = repeated_constraints(compiled, work, tree, state)
    if n_redundant == 0:
        return
    rows, _ = scaled_constraints(model, work, state)
    if not rows.any(axis=1).all():
        raise ModelError("a joint connects only the ground; expected a body at one end at least")
    vectors = np.linalg.svd(rows.T)[2][::-1].T  # columns, beginning with those of the smallest singular values
    conflict = conflict_of_drives(compiled, work, state)
    if conflict:
        raise ModelError(f"conflicting drives: {conflict}; remove one of them, or free the coordinate that opposes it")
    share = (vectors[:, :n_redundant] ** 2).sum(axis=1)
    owner = np.repeat(np.arange(len(model.connections.size)), model.connections.size)[holds]
    involved = [name for c, name in enumerate(compiled.connection_names) if share[owner == c].sum() > 1e-6]
    if is_singular_position(compiled, work, tree, state, n_redundant):
        raise ModelError(
            f"a singular position: {n_redundant} of {int(holds.sum())} constraints are redundant here, but "
            f"not in neighbouring positions (see joints {', '.join(repr(name) for name in involved)}), so that the "
            "motion could continue in more than one way; begin in another position"
        )
    counts = constraint_mobility(compiled, work, state).redundant
    told = ", ".join(f"{count} of joint {name!r}" for name, count in counts.items())
    raise ModelError(
        f"{n_redundant} of {int(holds.sum())} constraints repeat others, so that reactions are not "
        f"unique: see joints {', '.join(repr(name) for name in involved)} (in order, {told} repeat those before); "
        "replace one by a joint with fewer constraints (a fixed joint by a revolute, a revolute by a spherical one), "
        'or let them share the load: redundant = "minimum-norm"'
    )


def is_singular_position(compiled: CompiledSystem, work: Work, tree: Tree, state: State, n_redundant: int) -> bool:
    """Whether a test displacement of 1e-3 rad along allowed motions makes redundant constraints independent."""
    model = compiled.model
    holds = is_held(model.rows.kind)
    set_iterate(work, state)
    G = linearized(model, work, 1.0, 0.0, 0.0).G.toarray()[holds]
    modal = np.ones(G.shape[1], dtype=bool)
    for u0 in model.bodies.u0[:-1]:
        modal[u0 : u0 + 6] = False
        G[:, u0 + 3 : u0 + 6] /= compiled.length
    _, values, right = np.linalg.svd(G[:, ~modal])
    allowed = right[int((values > ALLOWED * values.max(initial=0.0)).sum()) :]
    if not len(allowed):
        return False
    y = np.zeros(G.shape[1])
    y[~modal] = NEAR_BY * np.random.default_rng(0).normal(size=len(allowed)) @ allowed
    for u0 in model.bodies.u0[:-1]:
        y[u0 : u0 + 3] *= compiled.length
    try:
        near = assembled(compiled, work, displaced(model, state, in_ground_axes(model, state, y)))
    except ModelError:
        return False
    return repeated_constraints(compiled, work, tree, near) < n_redundant


def with_compatible_velocities(compiled: CompiledSystem, work: Work, state: State, known: Array | None = None) -> State:
    """(2): return the state with velocities that satisfy the constraints."""
    from floatframe.engine.kernels.entry import rates_of_constraints

    model = compiled.model
    if len(work.state.w) == 0:
        return state
    set_iterate(work, state, w=start_unknowns(model, known))
    parts = linearized(model, work, 1.0, 0.0, 0.0)
    rate, _ = rates_of_constraints(model, work)
    if not np.any(rate):
        return state
    y, _ = solve(with_modal_weight(model, parts.H, STIFF_START), parts, np.zeros(len(work.state.u)), -rate)
    return State(state.r, state.p, state.q, state.u + in_ground_axes(model, state, y))


def solve_accelerations(
    compiled: CompiledSystem, work: Work, state: State, known: Array | None = None, *, warns: bool = False
) -> tuple[Array, Array]:
    """(3): return u_dot, (n_u,), and w, (n_w,), at a state.

    warns: log a warning if the iteration does not converge; only at a start, because rates of a motion call this often.
    """
    from floatframe.engine.kernels.entry import rates_of_constraints

    model = compiled.model
    w = start_unknowns(model, known)
    feels_accelerations = bool((model.markers.accelerated >= 0).any())
    y = np.zeros(len(work.state.u))
    for _ in range(MOST_ITERATIONS):
        set_iterate(work, state, in_ground_axes(model, state, y) if feels_accelerations else None, w)
        parts = linearized(model, work, 1.0, 0.0, 0.0)
        _, bias = rates_of_constraints(model, work)
        raise_errors_of(compiled.callbacks)
        require_numbers(compiled, work)
        forces, known_rows = -work.bodies.residual, np.zeros(len(w))
        if feels_accelerations:  # residuals and rows include the accelerations of the iterate
            forces = forces + sp.block_diag(parts.H) @ y
            known_rows = parts.G @ y
        rows = np.where(is_held(model.rows.kind), -bias, known_rows - work.connections.g)
        y, change = solve(with_mass_for_all(model, parts.H), parts, forces, rows)
        w = w + change
        raise_errors_of(compiled.callbacks)
        # friction that depends on the normal force is not linear in the reactions, and users' forces are not linear in
        # states or accelerations
        is_linear = not has_normal_friction(model) and not len(model.states.row) and not feels_accelerations
        if is_linear or np.abs(change).max(initial=0.0) <= 1e-10 * np.abs(w).max(initial=0.0):
            break
    else:
        if warns:
            log.warning(
                "the accelerations at t = %g were not found in %d iterations, because friction or a user force depends "
                "too strongly on the reactions: the motion of rigid bodies may not exist, or not be unique; use a "
                "smaller coefficient of friction, or a bushing in place of the joint",
                float(work.state.time), MOST_ITERATIONS,
            )  # fmt: skip
    return in_ground_axes(model, state, y), w


def work_from(model: Model, known: Array | None) -> Work:
    """Return working arrays with the states of user forces fixed at their known or initial values."""
    work = new_work(model)
    work.states.base[:] = start_unknowns(model, known)[model.states.row]
    return work


def require_numbers(compiled: CompiledSystem, work: Work) -> None:
    """Raise `ModelError` with the name of an element or user force whose law is not finite at the present iterate."""
    no_number = int(work.counted.no_number)
    if no_number:
        raise ModelError(
            f"{compiled.connection_words(no_number - 1)} is not finite (NaN or infinity) in the initial position; "
            "check its law, or place its bodies where the law is defined"
        )


def start_unknowns(model: Model, known: Array | None = None) -> Array:
    """Return the initial connection unknowns, (n_w,): states of user forces at their initial values, the others zero.

    With known unknowns of an earlier motion, the states and the coordinates of couplers and user forces have these
    values, and angles continue from them.
    """
    w = np.zeros(int(model.connections.w0[-1]))
    w[model.states.row] = model.states.start
    if known is not None:
        w[model.states.row] = known[model.states.row]
        w[model.coordinates.row] = known[model.coordinates.row]
    return w


def has_normal_friction(model: Model) -> bool:
    """Whether a friction law depends on the normal force in its joint."""
    return bool((model.joint_forces.coefficient > 0).any())


def acceleration_rates(compiled: CompiledSystem, consistent: ConsistentState, t: float, h: float, work: Work) -> Array:
    """Return d(u_dot)/dt at a consistent state, (n_u,), by a difference over a tenth of the time step h.

    work: arrays from `work_from`; overwritten.

    Its error is of second order in h. The difference is central, but forward if functions of time or laws may depend on
    t, because they may begin or jump there. Its interval contains no closing or opening of a contact, whose force does
    not act yet; the result is zero if this happens within a millionth of the step.
    """
    model, state, u_dot = compiled.model, consistent.state, consistent.u_dot
    s = OF_STEP * h

    def moved(step: float) -> State:
        after = displaced(model, state, step * state.u + 0.5 * step**2 * u_dot)
        return replace(after, u=state.u + step * u_dot)

    def u_dot_after(step: float) -> Array:
        work.state.time[...] = t + step
        return solve_accelerations(compiled, work, moved(step), consistent.w)[0]

    def closed(step: float) -> NDArray[np.bool_]:
        return gaps_at(compiled, work, t + step, moved(step), consistent.w) < 0.0

    if has_gaps(compiled):
        now = closed(0.0)
        while (closed(-s) != now).any() or (closed(s) != now).any() or (closed(2 * s) != now).any():
            s *= 0.5
            if s < NEAREST * h:
                return np.zeros_like(u_dot)
    if len(model.functions.begin) or compiled.laws or (model.connections.law == USER_FORCE).any():
        return (-3 * u_dot_after(0.0) + 4 * u_dot_after(s) - u_dot_after(2 * s)) / (2 * s)
    return (u_dot_after(s) - u_dot_after(-s)) / (2 * s)


# checks of initial values: motions far from the start, half turns, redundant constraints ------------------------------


# drives of angles that begin far from where their bodies were placed: selection of the root of their row --------------
# The row of a driven angle, (E cos f + Z sin f) · D = sin(f - th), vanishes at th = f and half a turn from there, and
# Newton's method converges to the nearer root. If th is far from f, the drive therefore approaches f in steps of an
# eighth of a turn: a row whose axes E, Z are rotated by delta prescribes f - delta.


FAR = np.pi / 4  #: largest increment by which a prescribed angle approaches its value


def driven_angles(model: Model) -> IntArray:
    """Return the rows that prescribe an angle as a function of time."""
    is_turn = (model.rows.kind == TURN) | (model.rows.kind == TURN_B)
    return np.flatnonzero(is_turn & (model.rows.motion >= 0))


def way_of_drives(model: Model, work: Work, state: State, w: Array, rows: IntArray) -> Array:
    """Return the deviation of prescribed angles from their values, between -pi and pi, (len(rows),) [rad]."""
    from floatframe.engine.kernels.entry import evaluate_and_linearize

    set_iterate(work, state, w=w)
    evaluate_and_linearize(model, work, 1.0, 0.0, 0.0)
    sense = sense_of(model, rows)
    sine = sense * work.connections.g[rows]
    quarter_back = led_by(model, rows, np.full(len(rows), np.pi / 2))
    evaluate_and_linearize(quarter_back, work, 1.0, 0.0, 0.0)
    return np.arctan2(sine, -sense * work.connections.g[rows])


def led_by(model: Model, rows: IntArray, delta: Array) -> Model:
    """Return a model with the prescribed angles reduced by delta, (len(rows),)."""
    c, s = np.cos(delta)[:, None], (sense_of(model, rows) * np.sin(delta))[:, None]
    x, z = model.rows.x.copy(), model.rows.z.copy()
    x[rows] = c * model.rows.x[rows] - s * model.rows.z[rows]
    z[rows] = s * model.rows.x[rows] + c * model.rows.z[rows]
    return model._replace(rows=model.rows._replace(x=x, z=z))


def sense_of(model: Model, rows: IntArray) -> Array:
    """Return the sign of an angle in the marker that has its axis: -1 for an axis of B."""
    return np.where(model.rows.kind[rows] == TURN_B, -1.0, 1.0)


def stages(way: Array) -> list[Array]:
    """Return the deviations of prescribed angles that remain after each increment but the last, (n_drives,) each.

    There are none if all drives are near their values.
    """
    n = int(np.ceil(np.abs(way).max(initial=0.0) / FAR))
    return [way * (1 - k / n) for k in range(1, n)]


# wrong roots of rotations: rows of products of axes also vanish at half a turn ----------------------------------------
# Rows x_A·y' = y_A·z' = z_A·x' = 0 fix an orientation, in which the axes x', y', z' of B should be parallel to those of
# A. Rows E·n_1 = E·n_2 = 0 fix an axis E of A, which should be parallel to the axis n_1 × n_2 of B. With the rotation R
# between A and B, the first rows are R_12 = R_23 = R_31 = 0. Because R is orthogonal, they have three kinds of
# solutions: R = 1, half a turn about x, y or z (1 and -1 on the diagonal), and a third of a turn about a diagonal of
# the cube (only R_13, R_21 and R_32 are not zero). The second rows vanish if the axes are parallel or opposite.
# Newton's method converges to the nearest of these solutions.


def require_no_half_turns(compiled: CompiledSystem, work: Work, state: State) -> None:
    """Raise `ModelError` with the name of a joint that is closed with an axis antiparallel instead of parallel.

    Parameters
    ----------
    compiled
        The system.
    work
        Working arrays; overwritten.
    state
        State with closed joints, in the frames of the engine.
    """
    from floatframe.engine.kernels.entry import evaluate_and_linearize

    model = compiled.model
    if not (model.rows.kind == DOT).any():
        return
    set_iterate(work, state)
    evaluate_and_linearize(model, work, 1.0, 0.0, 0.0)
    for c, name in enumerate(compiled.connection_names):
        if model.connections.law[c] != JOINT:
            continue
        rows = np.arange(model.connections.w0[c], model.connections.w0[c + 1])
        rows = rows[model.rows.kind[rows] == DOT]
        if len(rows) < 2 or np.abs(model.rows.c[rows]).any():
            continue
        A, B = work.markers.A[model.connections.a[c]], work.markers.A[model.connections.b[c]]
        x, y = A @ model.rows.x[rows].T, B @ model.rows.y[rows].T  # columns
        if len(rows) == 2 and np.allclose(x[:, 0], x[:, 1]):
            along = [float(x[:, 0] @ np.cross(y[:, 0], y[:, 1]))]
        elif len(rows) == 3:
            along = [float(x[:, k] @ y[:, k - 1]) for k in range(3)]
        else:
            continue
        if min(along) < 0.5:
            turn = "half a turn" if min(along) < -0.5 else "a third of a turn"
            raise ModelError(
                f"joint {name!r} is closed {turn} away from its orientation, at another solution of its equations; "
                "place its bodies nearer to the right orientation, or rotate its given axis (axis_b, rotation)"
            )


# number of redundant constraints, distinguished from poorly conditioned constraints -----------------------------------
# Joints of a tree are never redundant, because each adds a body. The columns of N, the motions of the bodies due to the
# coordinates of the tree, span all motions that these joints allow. So the rank of all constraints G is
#
#     rank G = rows of the tree + rank (G_c N),      G_c the rows that close loops.
#
# A chain of any length has no G_c, although the smallest singular value of G, scaled by the masses, falls with the
# square of the number of its links. Rows of G_c N are scaled to length one, coordinates by the mass that they move.
# Its small singular values belong to redundant constraints if there is a gap above them, or if they are roundoff;
# those of long trusses decrease without a gap. In the usual case of few, well-conditioned constraints this analysis
# is skipped, because N needs the kernels of relative coordinates, which are compiled at their first use.


FEW = 200  #: number of rows up to which the exact check comes first, because it takes milliseconds
WELL = 1e-6  #: smallest eigenvalue of G M⁻¹ Gᵀ with unit rows above which no constraint is redundant
SMALL = 1e-5  #: singular value, relative to the largest, below which constraints may be redundant
GAP = 1e-3  #: ratio of a singular value to the next larger one below which the constraint is redundant
#: singular value relative to the largest, or norm of a row relative to its part for bodies only, that counts as zero
ROUNDING = 1e-11


def repeated_constraints(compiled: CompiledSystem, work: Work, tree: Tree, state: State) -> int:
    """Return the number of redundant rows of joints and elements at a state; the working arrays are overwritten."""
    model = compiled.model
    closing = is_held(model.rows.kind) & (tree.kept_row >= 0)
    if not closing.any():
        return 0
    if is_held(model.rows.kind).sum() <= FEW:
        rows, _ = scaled_constraints(model, work, state)
        if np.linalg.eigvalsh(rows @ rows.T)[0] > WELL:
            return 0
    set_iterate(work, state)
    parts = linearized(model, work, 1.0, 0.0, 0.0)
    G, N = parts.G[closing], coordinate_motions(compiled, tree, state)
    mass, alone = np.zeros(N.shape[1]), np.zeros(G.shape[0])
    for i, H in enumerate(with_mass_for_all(model, parts.H)):
        u = slice(int(model.bodies.u0[i]), int(model.bodies.u0[i + 1]))
        mass += np.einsum("us,uv,vs->s", N[u], H, N[u], optimize=True)
        alone += (G[:, u].power(2) @ (1 / np.diag(H))) if G[:, u].nnz else 0.0
    C = (G @ N) / np.sqrt(np.maximum(mass, np.finfo(float).tiny))
    size = np.linalg.norm(C, axis=1)
    is_none = size <= ROUNDING * np.sqrt(alone)
    return int(is_none.sum()) + dependent_count(C[~is_none] / size[~is_none, None])


def dependent_count(C: Array) -> int:
    """Return the rank deficiency of a matrix with unit rows."""
    if not len(C):
        return 0
    values = np.linalg.svd(C, compute_uv=False)
    ends = [
        k
        for k in range(1, len(values))
        if values[k] <= ROUNDING * values[0] or (values[k] <= SMALL * values[0] and values[k] <= GAP * values[k - 1])
    ]
    return len(C) - (ends[0] if ends else len(values))
