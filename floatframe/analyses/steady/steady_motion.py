"""Steady running: the state in which a vehicle goes straight on or round a curve and nothing in it changes.

Found by damped Newton steps for the equations of `equations.py`.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.equilibrium import LARGEST_TURN, Equilibrium, largest_motion, notes_at, worst_body
from floatframe.analyses.steady.carrier import Carrier, carried
from floatframe.analyses.steady.equations import Equations, Family, Place, Step, Trial, timed
from floatframe.analyses.steady.path import path_of, require_body, spins_of
from floatframe.engine.compiling.file_frames import motion_of_file
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.initial import assembled, checked, known_of, start_unknowns
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ConvergenceError, ModelError
from floatframe.model.checked_values import unit_vector
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["SteadyMotion", "steady_motion"]

SETTLED = 1e-7  #: last change of all unknowns, relative to their sizes
STUCK = 1e-4  #: the same, below which forces that do not fall will not
SHORTEST = 1e-4  #: part of a step


@dataclass(frozen=True, eq=False)
class SteadyMotion:
    """A system in steady running."""

    system: System  #: with what was found
    equilibrium: Equilibrium  #: its state; `linearize(system, equilibrium)` is about it
    speed: float  #: of the body of reference [m/s]
    curvature: float  #: of its path, positive about the axis [1/m]
    found: Mapping[str, float]  #: open numbers of the system
    spins: Mapping[str, float]  #: speeds of bodies about axes of their own, relative to the turning vehicle [rad/s]


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
    """Return the state in which a system runs straight on or in a circle with a constant speed.

    Bodies that are placed with another angular velocity than that of `body` about `axis` (wheels that roll) spin about
    that axis of theirs; all others go along with it. Rolling without slip and states of elements are parts of it.

    Parameters
    ----------
    system
        The system, its bodies placed near the motion and with their velocities, or a function that returns it from
        the numbers of `unknown`, by name.
    body
        The body of reference: its frame passes the point where it is placed, or `state` has it, in the direction of
        its velocity.
    speed
        Of it; default: as placed. 0: the system stands, but for what spins in it [m/s].
    curvature
        Of its path, positive about `axis`; None: to be found, the steer angle is given [1/m].
    unknown
        Where to begin with numbers of the system that are to be found, by name: steer angle, drive torque.
    center
        A point of the axis of the circle, ground axes, (3,) [m], where a track gives it; default: beside the body of
        reference, where the curvature says. Only with a curvature, whose size is then one over the distance.
    guided
        Whether a track says where the system is across it. Else the body of reference stays beside its point neither.
    spinning
        Axes of bodies that spin, body axes, (3,), by name, beside those that are placed with a spin; also of a body of
        reference that spins itself and leans.
    state
        Where to begin, such as the end of a motion; of its velocities the spins are used. Default: as placed.
    t
        The time of all functions of time, which should not change then [s].
    axis
        About which the circle turns, ground axes, (3,).
    tolerance
        Largest force out of balance, relative to the forces at work.
    max_iterations
        Steps of Newton's method.

    Raises
    ------
    ConvergenceError
        If no steady motion is found.
    ModelError
        If a body has no speed or is not there, a flexible body spins, or joints do not allow the motion.
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
        """Return the steady motion next to a trial."""
        equations, path = self.equations, self.equations.path
        here = equations.at(Trial(state, w, s, carrier, np.array(list(equations.family.start.values()), dtype=float)))
        errors, is_stuck = [np.inf], False
        for iteration in range(max_iterations + 1):
            step = equations.step(here)
            change = equations.change(here, step.x)
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
            "the system cannot run steadily like this: leave a number of it unknown (a drive torque, a steer angle), "
            "or the curvature (None)"
            if is_stuck
            else "start nearer: place it closer to its steady state, or begin with the end of a motion (state)"
        )
        raise ConvergenceError(
            f"no steady motion of body {path.name!r} at {path.speed:g} found in {iteration} steps: forces "
            f"are out of balance by {error:.2g} of those at work, most at body "
            f"{worst_body(here.compiled, here.now.W, here.now.f)!r}; {why}",
            t=equations.t, h=0.0, residual=error,
        )  # fmt: skip

    def followed(self, here: Place, step: Step) -> Place | None:
        """Return what lies along a step: so far that the next one by the same matrix is shorter (natural monotony)."""
        equations = self.equations
        y = step.x[: len(here.now.f)]
        part, length = min(1.0, LARGEST_TURN / max(largest_motion(here.compiled, y), 1e-300)), step.length(step.x)
        there = None
        while part >= SHORTEST:
            try:
                there = equations.at(equations.moved(here, part * step.x))
            except ModelError:  # joints that do not close there, a law that gives no number
                part /= 2
                continue
            following = step.length(step.inverse @ equations.residual(there))
            if following <= (1 - part / 4) * length or length <= SETTLED:
                return there
            part /= 2 if following < 4 * length else 4
        return there

    def result(self, here: Place, iteration: int) -> SteadyMotion:
        """Return what was found."""
        equations, path, compiled, trial = self.equations, self.equations.path, here.compiled, here.trial
        state, u_dot = carried(compiled.model, trial.state, trial.carrier, equations.spins, trial.s)
        notes = notes_at(here.system, here.work, state, u_dot, trial.w)
        told, told_u_dot = motion_of_file(compiled, state, u_dot)
        about = Equilibrium(
            replace(told, w=trial.w), told_u_dot, trial.w, trial.carrier.omega, here.now.error, iteration, notes,
            equations.t,
        )  # fmt: skip
        names = [compiled.body_names[spin.body] for spin in equations.spins]
        return SteadyMotion(
            here.system, about, path.speed, float(trial.carrier.omega @ path.axis) / (path.speed or 1.0),
            dict(zip(equations.family.start, trial.p.tolist(), strict=True)),
            dict(zip(names, trial.s.tolist(), strict=True)),
        )  # fmt: skip
