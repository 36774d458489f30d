"""Steady running: the state of a vehicle that runs straight or in a circle without any change in the moving frame.

It is found by damped Newton steps for the equations of `equations.py`.
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

SETTLED = 1e-7  #: last change of all unknowns, relative to their magnitudes
STUCK = 1e-4  #: change of all unknowns, relative to their magnitudes, below which a constant residual ends the search
SHORTEST = 1e-4  #: smallest damping factor of a Newton step


@dataclass(frozen=True, eq=False)
class SteadyMotion:
    """A system in steady running."""

    system: System  #: the system with the values found for its open parameters
    equilibrium: Equilibrium  #: the steady state; `linearize(system, equilibrium)` gives small motions about it
    speed: float  #: speed of the reference body [m/s]
    curvature: float  #: curvature of its path, positive about the axis [1/m]
    found: Mapping[str, float]  #: values of the open parameters, by name
    spins: Mapping[str, float]  #: speeds of spinning bodies about their axes, relative to the moving frame [rad/s]


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
        magnitude is one over the distance to the reference body. Default: beside the reference body, at this distance.
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
        """Return the steady motion near a trial."""
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
        """Return the trial after a damped step; damping ensures that the simplified Newton step decreases.

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
        """Return the result at a converged trial."""
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
