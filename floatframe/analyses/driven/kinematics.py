"""Kinematic analysis and inverse dynamics of a fully driven system: motion, reactions and drive forces over time.

Nothing is integrated: every instant follows from joints and drives (`driven_motion`). There is no step size to choose,
and times may be as far apart as Newton's method can find the next position from the previous one.
"""

import os
from collections.abc import Callable, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.driven.driven_freedoms import SingularityGuard, free_coordinates
from floatframe.analyses.driven.driven_motion import ELASTICITY, Elasticity, Instant, frozen_bodies
from floatframe.analyses.observed_state import observed_state
from floatframe.engine.compiling.file_frames import rows_of_file
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.constraint_words import conflict_of_drives
from floatframe.engine.initial_conditions.freedoms import constraint_mobility
from floatframe.engine.initial_conditions.initial import assembled, checked
from floatframe.engine.initial_conditions.newton_equations import displaced
from floatframe.engine.kernels.memory import WORK_GIVEN, WORK_TAKEN, Rows
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ConvergenceError, ModelError
from floatframe.integrators.carry import Carry, turned_on, with_angles
from floatframe.model.joints.rows import is_held_velocity
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.results_file import MemorySource
from floatframe.results.small_motions.joint_rates import driven_coordinates
from floatframe.results.trajectory import Trajectory, read_results
from floatframe.results.writer import ResultsPlace, ResultsWriter
from floatframe.simulation.integration import head_of, joint_rows

__all__ = ["Kinematics", "kinematics"]

LARGEST_TURN = 0.25  #: largest rotation of a body between two positions; longer paths are divided [rad]
MOST_PARTS = 2000  #: largest number of parts between two times
ROWS_KEPT = 200  #: number of rows of results between writes


@dataclass(frozen=True)
class Kinematics:
    """Replaces the integrator in the record of a run."""

    elasticity: str  #: name of the treatment of flexible bodies in `ELASTICITY`


def kinematics(
    system: System,
    times: Sequence[float] | Array,
    *,
    elasticity: Elasticity = frozen_bodies,
    state: State | None = None,
    output: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> Trajectory:
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
        raise ModelError("kinematics: times: expected two or more rising numbers")
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
    carry = Carry(now.state, now.u_dot, now.u_dot, 0.0, now.w, np.zeros(2), np.zeros(2))
    carry = with_angles(system, float(t[0]), carry)
    with ExitStack() as held:  # the place of the results, until the end of the analysis
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
                    carry = turned_on(system, replace(carry, state=now.state), float(time - t[k - 1]))
                    done = done + (time - t[k - 1]) / 2 * (power[0] + power[1])
                power[0] = power[1]
                rows.diagnostics[0, [WORK_GIVEN, WORK_TAKEN]] = done
                rows.angle[0] = carry.angle
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
                error.trajectory = Trajectory(head, MemorySource(joint_rows(system, kept)), is_complete=False)
            else:
                writer.close_segment()
                error.trajectory = read_results(writer.folder)
                error.args = (f"{error}; the motion so far is in {str(writer.folder)!r}",)
            raise
        except BaseException:
            if writer is not None:
                writer.close_segment()
            raise
        if writer is None:
            return Trajectory(head, MemorySource(joint_rows(system, kept)), is_complete=True)
        writer.finish()
        return read_results(writer.path)


def first_instant(system: System, work: Work, state: State, t: float, elasticity: Elasticity) -> Instant:
    """Return the motion at the first time; `ModelError` unless the drives determine it completely."""
    compiled = compiled_system(system)
    own = [each for each in compiled.laws if each.law.states or each.law.multipliers]
    if own:
        raise ModelError(
            f"kinematics: element {own[0].element.name!r} has states or multipliers of its own, which need a motion in "
            "time: integrate it, or take the element out"
        )
    felt = [each.element.name for each in compiled.laws if each.law.accelerations]
    if felt:
        raise ModelError(
            f"kinematics: element {felt[0]!r} asks for accelerations, which a driven motion does not give to "
            "elements; give its masses as bodies, or integrate the motion"
        )
    rolling = np.flatnonzero(is_held_velocity(compiled.model.rows.kind))
    if len(rolling):
        raise ModelError(
            f"kinematics: joint {compiled.owners[rolling[0]]!r} rolls: it holds velocities, and where that leads "
            "follows by integration only; integrate the motion"
        )
    shapes = state.q  # assembled shapes, because closing joints with modes may bend bodies
    state = assembled(compiled, work, state)
    conflict = conflict_of_drives(compiled, work, state)
    if conflict:
        raise ModelError(f"conflicting drives: {conflict}; take one away, or free what it drives against")
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
            f"kinematics: {counted.n_redundant_rigid} constraints repeat others ({told}), so that reactions are not "
            'unique; replace a joint by one that holds less, or share the load: redundant = "minimum-norm"'
        )
    return elasticity(compiled, work, replace(state, q=shapes), t)


def moved_on(
    compiled: CompiledSystem, work: Work, now: Instant, t: float, elasticity: Elasticity, guard: SingularityGuard
) -> Instant:
    """Return the motion at time t, reached from the previous one in parts in which no body rotates far."""
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
                f"kinematics: the way from t = {begin:g} to {t:g} has more than {MOST_PARTS} parts in which a body "
                f"turns by {LARGEST_TURN} rad; give more times, or look for a singular position",
                t=now.t,
                h=h,
                residual=0.0,
            )
    return replace(now, n_iterations=n)
