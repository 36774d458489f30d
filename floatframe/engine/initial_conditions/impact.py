"""Velocities after an impact: constraints that become active at an instant, or reverse the rate of a coordinate.

With M the masses of all bodies and modes and G the rows of all constraints, those of joints among them,

    M (u_after - u) - Jᵀ i = 0,    G u_after = -e G u for the rows that strike, 0 for all others

i are impulses. No weight but the mass enters, so that momentum is kept and the energy lost is that of the impact law
(Pfeiffer & Glocker (1996), with Newton's coefficient e of each row).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.initial_conditions.initial import start_unknowns, work_from
from floatframe.engine.initial_conditions.newton_equations import (
    in_ground_axes,
    linearized,
    set_iterate,
    solve,
    with_mass_for_all,
)
from floatframe.model.state import State

__all__ = ["Impact", "impact"]


@dataclass(frozen=True, eq=False)
class Impact:
    """The result of an impact."""

    state: State  #: with the velocities after it
    rate: Array  #: rate of the held quantity of each row before the impact, (n_w,)
    impulse: Array  #: impulse of the unknown of each row, (n_w,) [N s, N m s]
    gap: Array  #: gap of the held quantity of each row, (n_w,) [m, rad; for held velocities m/s]


def impact(
    compiled: CompiledSystem, state: State, *, t: float, known: Array, restitution: Mapping[int, float]
) -> Impact:
    """Return the state (frames of the engine) after all constraints of a system become active at once.

    Parameters
    ----------
    compiled
        The system with the constraints that begin to hold.
    known
        Unknowns of the connections before, (n_w,): counted angles and states of forces.
    restitution
        By row: the part of its rate with which it is thrown back; 0 where a row is not named.
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
