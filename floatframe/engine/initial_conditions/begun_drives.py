"""Messages about drives that begin with another rate than their bodies have."""

import numpy as np

from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.constraint_words import drive_name
from floatframe.engine.initial_conditions.initial import assembled, checked, known_of, start_unknowns, work_from
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.model.joints.rows import is_held, is_held_length
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["words_of_begun_drives"]

#: distance in a step, in radians or relative to the size of the system, that a drive may deviate from its bodies
FITS = 1e-9


def words_of_begun_drives(system: System, t: float, state: State | None, h: float) -> str:
    """Return a message about the drive whose rate at t differs most from that of its bodies, "" if none does.

    A motion then begins with velocities that fit, the nearest ones by mass and modal stiffness. Rigid mechanisms move
    so; what is elastic, as bars of segments, takes it as a blow whose waves long steps h do not follow.
    """
    from floatframe.engine.kernels.entry import rates_of_constraints

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
        linearized(model, work, 1.0, 0.0, 0.0)
        rates.append(np.abs(rates_of_constraints(model, work)[0][drives]))
    wanted, off = rates
    is_length = is_held_length(model.rows.kind)[drives]
    way = h * off / np.where(is_length, compiled.length, 1.0)
    k = int(np.argmax(way))
    if not way[k] > FITS:
        return ""
    unit = f"{system.units.length_symbol if is_length[k] else 'rad'}/{system.units.time_symbol}"
    return (
        f"{drive_name(compiled, int(drives[k]))} begins at t = {t:g} with {wanted[k]:.4g} {unit}, {off[k]:.4g} {unit} "
        "from what its bodies as given have: all begin with consistent velocities, which acts as an impulse on elastic "
        "parts; begin it gradually (cycloidal_spin_up), give the bodies consistent velocities, or resolve the impulse "
        "with a smaller h"
    )
