"""Jumps of velocities after an impact, and at the start if prescribed motions begin with a velocity.

In an impact, constraints become active at an instant, or reverse the rate of a coordinate.

Let M be the masses of all bodies and modes and G the rows of all constraints, including those of joints. Then

    M (u_after - u) - Jᵀ i = 0,    G u_after = -e G u for the rows that strike, 0 for all others

where i are impulses. Only the mass weights the change, so that momentum is conserved and the loss of energy is that of
the impact law (Pfeiffer & Glocker (1996), with Newton's coefficient e of each row).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.constraint_words import drive_name
from floatframe.engine.initial_conditions.initial import assembled, checked, known_of, start_unknowns, work_from
from floatframe.engine.initial_conditions.newton_equations import (
    in_ground_axes,
    linearized,
    set_iterate,
    solve,
    with_mass_for_all,
)
from floatframe.model.joints.rows import is_held, is_held_length
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Impact", "impact", "words_of_begun_drives"]

#: allowed deviation of a prescribed motion from the bodies in one step, in rad or relative to the size of the system
FITS = 1e-9


@dataclass(frozen=True, eq=False)
class Impact:
    """The result of an impact."""

    state: State  #: state with the velocities after the impact
    rate: Array  #: rate of each row's constrained quantity before the impact, (n_w,)
    impulse: Array  #: impulse of each row's constraint force, (n_w,) [N s, N m s]
    gap: Array  #: residual gap of each row's constrained quantity, (n_w,) [m, rad; m/s for velocity constraints]


def impact(
    compiled: CompiledSystem, state: State, *, t: float, known: Array, restitution: Mapping[int, float]
) -> Impact:
    """Return the state, in frames of the engine, after all constraints become active at once.

    Parameters
    ----------
    compiled
        The system including the constraints that become active.
    known
        Unknowns of the connections before the impact, (n_w,): counted angles and states of forces.
    restitution
        Coefficient of restitution by row; 0 for rows that are not named.
    """
    from floatframe.engine.kernels.entry import rates_of_constraints

    model = compiled.model
    work = work_from(model, known)
    work.state.time[...] = t
    set_iterate(work, state, w=start_unknowns(model, known))
    parts = linearized(model, work, 1.0, 0.0, 0.0)
    gap = work.connections.g.copy()
    rate, _ = rates_of_constraints(model, work)
    wanted = -rate
    for row, e in restitution.items():
        wanted[row] = -(1.0 + e) * rate[row]
    y, impulse = solve(with_mass_for_all(model, parts.H), parts, np.zeros(len(state.u)), wanted)
    after = State(state.r, state.p, state.q, state.u + in_ground_axes(model, state, y))
    return Impact(after, rate, impulse, gap)


def words_of_begun_drives(system: System, t: float, state: State | None, h: float) -> str:
    """Return a message about the prescribed rate that differs most from the bodies at t, "" if all rates agree.

    If they do not agree, the motion begins with the nearest consistent velocities (weighted by mass and modal
    stiffness). This is right for rigid mechanisms. On elastic parts, such as bars of segments, it acts as an impulse
    whose waves long steps h do not resolve.
    """
    from floatframe.engine.kernels.entry import evaluate_and_linearize, rates_of_constraints

    compiled = compiled_system(system)
    model = compiled.model
    drives = np.flatnonzero((model.rows.motion >= 0) & is_held(model.rows.kind))
    if not len(drives):
        return ""
    known = known_of(compiled, state)
    work = work_from(model, known)
    work.state.time[...] = t
    given = compiled.placed if state is None else checked(compiled, state)
    given = assembled(compiled, work, given, known)
    rates = []
    for velocity in (np.zeros_like(given.u), given.u):
        set_iterate(work, State(given.r, given.p, given.q, velocity), w=start_unknowns(model, known))
        evaluate_and_linearize(model, work, 1.0, 0.0, 0.0)
        rates.append(np.abs(rates_of_constraints(model, work)[0][drives]))
    wanted, off = rates
    is_length = is_held_length(model.rows.kind)[drives]
    way = h * off / np.where(is_length, compiled.length, 1.0)
    k = int(np.argmax(way))
    if not way[k] > FITS:
        return ""
    unit = f"{system.units.length_symbol if is_length[k] else 'rad'}/{system.units.time_symbol}"
    return (
        f"{drive_name(compiled, int(drives[k]))} begins at t = {t:g} with {wanted[k]:.4g} {unit}, which differs by "
        f"{off[k]:.4g} {unit} from the given velocities of its bodies. The motion begins with consistent velocities; "
        "this acts as an impulse on elastic parts. Begin the drive gradually (cycloidal_spin_up), give the bodies "
        "consistent velocities, or resolve the impulse with a smaller h"
    )
