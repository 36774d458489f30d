"""Kinematic analysis and inverse dynamics of a fully driven system: motion, reactions and drive forces over time.

Nothing is integrated: every instant follows from joints and drives (`driven_motion`). There is no step size to choose,
and times may be as far apart as Newton's method can find the next position from the previous one.
"""

import os
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from floatframe.analyses.driven.driven_motion import (
    ELASTICITY,
    Elasticity,
    Instant,
    frozen_bodies,
    rigid_columns,
    rigid_equations,
    rigid_scale,
)
from floatframe.analyses.observed_state import observed_state
from floatframe.engine.compiling.file_frames import rows_of_file
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.constraint_words import conflict_of_drives
from floatframe.engine.initial_conditions.freedoms import constraint_mobility, dependent_rows, unit_rows
from floatframe.engine.initial_conditions.initial import assembled, checked
from floatframe.engine.initial_conditions.newton_equations import displaced, set_iterate
from floatframe.engine.kernels.memory import WORK_GIVEN, WORK_TAKEN, Rows, memory_at
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ConvergenceError, ModelError
from floatframe.integrators.integrator import turned_on, with_angles
from floatframe.model.joints.rows import is_held, is_held_velocity
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.motion import Motion, motion_of
from floatframe.results.results_file import MemorySource, segments_words
from floatframe.results.small_motions.joint_rates import coordinate_rows, driven_coordinates
from floatframe.results.trajectory import read_trajectory
from floatframe.results.writer import ResultsPlace, ResultsWriter
from floatframe.simulation.motion_head import head_of, joint_rows

__all__ = ["Kinematics", "SingularityGuard", "free_coordinates", "kinematics"]


# driven freedoms ------------------------------------------------------------------------------------------------------
# Degrees of freedom that joints and drives leave free, and the distance of a driven system from singular positions.


SINGULAR = 1e-6  #: singular value of the constraint rows (each of unit length) below which a position is singular
FREE = 1e-7  #: singular value of the constraint rows (each of unit length) below which a motion is free
REPORTED = 1e-6  #: fraction of a free motion above which a coordinate or body is reported


def free_coordinates(system: System, state: State, *, t: float = 0.0) -> tuple[str, ...]:
    """Return the free motions at an assembled state, as a minimal set of joint coordinates or bodies.

    Flexible bodies are treated as rigid.
    """
    compiled = compiled_system(system)
    work = new_work(compiled.model)
    work.state.time[...] = t
    set_iterate(work, state)
    rigid = rigid_columns(compiled)
    G = rigid_equations(compiled, work).G[is_held(compiled.model.rows.kind)]
    G = scaled_rows(compiled, G)
    _, values, right = la.svd(G) if len(G) else (0, np.zeros(0), np.eye(int(rigid.sum())))
    motions = right[int((values > FREE).sum()) :]
    if not len(motions):
        return ()
    rows = coordinate_rows(system, compiled, work, state)
    driven = set(driven_coordinates(system))
    names = [name for name in rows if name not in driven]
    scale = rigid_scale(compiled)
    named: list[str] = []
    left = motions
    if names:
        rates = np.array([rows[name][rigid] * scale for name in names]) @ motions.T
        rates[np.linalg.norm(rates, axis=1) < FREE] = 0.0
        _, R, order = la.qr(unit_rows(rates).T, mode="economic", pivoting=True)
        rank = int((np.abs(np.diag(R)) > REPORTED).sum())
        chosen = sorted(order[:rank])
        named = [f"{names[k]!r}" for k in chosen]
        _, values, right = la.svd(rates[chosen])
        left = right[rank:] @ motions
    if len(left):
        share = (left**2).reshape(len(left), -1, 6).sum(axis=(0, 2))
        moving = [name for name, part in zip(compiled.body_names, share, strict=True) if part > REPORTED]
        named.append(
            f"{len(left)} motions of {', '.join(repr(name) for name in moving)} that change no joint coordinate"
        )
    return tuple(named)


def scaled_rows(compiled: CompiledSystem, G: Array) -> Array:
    """Return constraint rows by frame motions, (n_held, 6 n_b), in one unit and with unit length."""
    return unit_rows(G * rigid_scale(compiled))


class SingularityGuard:
    """Monitors the smallest singular value and the determinant's sign of the constraints during a motion."""

    def __init__(self, compiled: CompiledSystem, now: Instant) -> None:
        """Begin at an instant; `ConvergenceError` if the position is singular."""
        self.compiled = compiled
        self.kept = np.logical_not(dependent_rows(scaled_rows(compiled, now.G)))  #: linearly independent rows
        self.sign = 0.0
        self.check(now, now.t)

    def check(self, now: Instant, last_t: float) -> None:
        """Raise `ConvergenceError` if the position is singular, or if a singular one was passed since the last time."""
        G = scaled_rows(self.compiled, now.G)[self.kept]
        left, values, _ = la.svd(G)
        is_square = G.shape[0] == G.shape[1]
        sign = float(np.linalg.slogdet(G)[0]) if is_square else 1.0
        is_passed = self.sign not in (0.0, sign)
        if is_square and values[-1] > SINGULAR and not is_passed:
            self.sign = sign
            return
        is_met = not is_square or values[-1] <= SINGULAR
        where = f"at t = {now.t:g}" if is_met else f"between t = {last_t:g} and {now.t:g}"
        holds = np.flatnonzero(is_held(self.compiled.model.rows.kind))[self.kept]
        owner = [self.compiled.owners[k] for k in holds]
        share = left[:, -1] ** 2
        names = dict.fromkeys(owner)
        involved = [name for name in names if sum(s for s, o in zip(share, owner, strict=True) if o == name) > 0.02]
        raise ConvergenceError(
            f"a singular position {where}: the constraints of joints {', '.join(repr(name) for name in involved)} "
            f"depend on each other there (smallest singular value {values[-1]:.2g}): the drives do not "
            "determine how the mechanism continues; drive another coordinate, or keep away from this position",
            t=now.t,
            h=0.0,
            residual=float(values[-1]),
        )


# kinematics -----------------------------------------------------------------------------------------------------------


LARGEST_TURN = 0.25  #: largest rotation of a body between two positions [rad]; longer paths are divided
MOST_PARTS = 2000  #: largest number of parts between two times
ROWS_KEPT = 200  #: number of result rows that are collected before they are written


@dataclass(frozen=True)
class Kinematics:
    """Describes a kinematic analysis in the record of a run, in place of an integrator."""

    elasticity: str  #: name of the treatment of flexible bodies, from `ELASTICITY`


def kinematics(
    system: System,
    times: Sequence[float] | Array,
    *,
    elasticity: Elasticity = frozen_bodies,
    state: State | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Motion:
    """Return the motion of a fully driven system at given times, with its reactions and drive forces.

    Parameters
    ----------
    system
        The system; its joints and prescribed motions must leave no body free to move.
    times
        Increasing, at least two, (n_t,) [s].
    elasticity
        `frozen_bodies`: flexible bodies keep their assembled shape. `quasi_static_bodies`: they deform under their
        loads and the inertia of the rigid motion, without vibrations (velocities and accelerations of the modes are
        neglected).
    state
        Initial guess of the first position; by default the assembled bodies.
    output
        Results file; with None, the motion is kept in memory.
    progress
        Called with the number of times completed and the total number.

    Raises
    ------
    ModelError
        If coordinates are free (the message names them), drives conflict, or constraints are redundant.
    ConvergenceError
        At a singular position, between times on both sides of one, or if a drive is out of reach. The error has the
        motion computed so far.
    """
    t = np.asarray(times, dtype=float)
    if t.ndim != 1 or len(t) < 2 or not np.isfinite(t).all() or (np.diff(t) <= 0).any():
        raise ModelError("kinematics: times: expected at least two increasing numbers")
    name = next((key for key, value in ELASTICITY.items() if value is elasticity), "user")
    compiled = compiled_system(system)
    work = new_work(compiled.model)
    work.state.time[...] = t[0]
    state = compiled.placed if state is None else checked(compiled, state)
    now = first_instant(system, work, state, float(t[0]), elasticity)
    guard = SingularityGuard(compiled, now)
    spacing = float(t[-1] - t[0]) / (len(t) - 1)
    head = head_of(system, Kinematics(name), float(t[0]), float(t[-1]), spacing, 1)  # type: ignore[arg-type]
    head = replace(head, angles=compiled.angles)
    memory = memory_at(now.state, now.u_dot, now.w)
    memory = with_angles(system, float(t[0]), memory)
    with ExitStack() as held:  # reserves the location of the results until the end of the analysis
        place = None if output is None else held.enter_context(ResultsPlace(output, inputs=system.files))
        writer = None if place is None else ResultsWriter(place, head)
        kept: list[Rows] = []
        power, done = np.zeros((2, 2)), np.zeros(2)  # powers at the last two times, work so far
        try:
            for k, time in enumerate(t):
                if k:
                    now = moved_on(compiled, work, now, float(time), elasticity, guard)
                rows, power[1] = observed_state(compiled, work, now.state, now.u_dot, now.w, now.t)
                if k:
                    memory = turned_on(system, memory.changed(state=now.state), float(time - t[k - 1]))
                    done = done + (time - t[k - 1]) / 2 * (power[0] + power[1])
                power[0] = power[1]
                rows.diagnostics[0, [WORK_GIVEN, WORK_TAKEN]] = done
                rows.angle[0] = memory.angle
                rows = rows_of_file(compiled, rows)
                if writer is None:
                    kept.append(rows)
                else:
                    writer.append(rows)
                    if (k + 1) % ROWS_KEPT == 0:
                        writer.close_segment()
                if progress is not None:
                    progress(k + 1, len(t))
        except ConvergenceError as error:
            if writer is None:
                error.trajectory = Motion(head, MemorySource(joint_rows(system, kept)), is_complete=False, known=system)
            else:
                writer.close_segment()
                error.trajectory = motion_of(read_trajectory(writer.folder), system)
                error.args = (f"{error}; {segments_words(writer.folder)}",)
            raise
        except BaseException:
            if writer is not None:
                writer.close_segment()
            raise
        if writer is None:
            return Motion(head, MemorySource(joint_rows(system, kept)), is_complete=True, known=system)
        writer.finish()
        return motion_of(read_trajectory(writer.path), system)


def first_instant(system: System, work: Work, state: State, t: float, elasticity: Elasticity) -> Instant:
    """Return the motion at the first time; `ModelError` unless the drives determine it completely."""
    compiled = compiled_system(system)
    own = [each for each in compiled.laws if each.law.states or each.law.multipliers]
    if own:
        raise ModelError(
            f"kinematics: element {own[0].element.name!r} has states or multipliers, which follow only from "
            "integration in time; integrate the motion, or remove the element"
        )
    felt = [each.element.name for each in compiled.laws if each.law.accelerations]
    if felt:
        raise ModelError(
            f"kinematics: element {felt[0]!r} uses accelerations, which a driven motion does not provide to "
            "elements; model its masses as bodies, or integrate the motion"
        )
    rolling = np.flatnonzero(is_held_velocity(compiled.model.rows.kind))
    if len(rolling):
        raise ModelError(
            f"kinematics: joint {compiled.owners[rolling[0]]!r} rolls: it constrains velocities, and the positions "
            "follow only by integration; integrate the motion"
        )
    shapes = state.q  # assembled shapes, because closing joints with modes may bend bodies
    state = assembled(compiled, work, state)
    conflict = conflict_of_drives(compiled, work, state)
    if conflict:
        raise ModelError(f"conflicting drives: {conflict}; remove one of them, or free the coordinate that opposes it")
    free = free_coordinates(system, state, t=t)
    if free:
        driven = driven_coordinates(system)
        raise ModelError(
            f"kinematics: system {system.name!r} is not fully driven: {', '.join(free)} "
            f"{'is' if len(free) == 1 else 'are'} free (driven: {', '.join(driven) or 'nothing'}); prescribe "
            f"{'its motion' if len(free) == 1 else 'their motions'}, or integrate the motion instead"
        )
    counted = constraint_mobility(compiled, work, state)
    if counted.n_redundant_rigid and not compiled.model.rows.soft.any():
        told = (
            ", ".join(f"{count} of joint {name!r}" for name, count in counted.redundant.items()) or "with rigid bodies"
        )
        raise ModelError(
            f"kinematics: {counted.n_redundant_rigid} constraints are redundant ({told}), so that reactions are not "
            'unique; replace a joint by one with fewer constraints, or set redundant = "minimum-norm"'
        )
    return elasticity(compiled, work, replace(state, q=shapes), t)


def moved_on(
    compiled: CompiledSystem, work: Work, now: Instant, t: float, elasticity: Elasticity, guard: SingularityGuard
) -> Instant:
    """Return the motion at time t, reached from the previous one in parts with limited rotations."""
    model = compiled.model
    begin, done, n = now.t, 0.0, now.n_iterations
    parts = 0
    while done < 1.0:
        rest = t - now.t
        x = rest * now.state.u + 0.5 * rest**2 * now.u_dot
        turn = max(float(np.linalg.norm(x[u0 + 3 : u0 + 6])) for u0 in model.bodies.u0[:-1])
        part = min(1.0, LARGEST_TURN / turn) if turn > 0 else 1.0
        h = rest * part
        after = t if part == 1.0 else now.t + h
        guess = displaced(model, now.state, h * now.state.u + 0.5 * h**2 * now.u_dot)
        last = now.t
        now = elasticity(compiled, work, guess, after)
        guard.check(now, last)
        n += now.n_iterations
        done = 1.0 if after == t else (after - begin) / (t - begin)
        parts += 1
        if parts > MOST_PARTS:
            raise ConvergenceError(
                f"kinematics: the motion from t = {begin:g} to {t:g} needs over {MOST_PARTS} parts in which a body "
                f"rotates by {LARGEST_TURN} rad; give more times, or look for a singular position",
                t=now.t,
                h=h,
                residual=0.0,
            )
    return replace(now, n_iterations=n)
