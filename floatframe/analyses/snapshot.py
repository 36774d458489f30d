"""Single states as motions, for which sensors, tables and pictures of motions also work."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.equilibrium import Equilibrium
from floatframe.analyses.observed_state import observed_state
from floatframe.engine.compiling.file_frames import motion_of_engine, rows_of_file
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import Rows
from floatframe.engine.kernels.work import new_work
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.motion import Motion, motion_of
from floatframe.results.results_file import MemorySource
from floatframe.results.trajectory import Trajectory
from floatframe.simulation.motion_head import head_of, joint_rows

__all__ = ["snapshot", "states_as_motion"]


@dataclass(frozen=True)
class Snapshot:
    """Describes single states in the record of a run, in place of an integrator."""


def snapshot(
    system: System,
    state: State | Equilibrium,
    u_dot: Array | None = None,
    w: Array | None = None,
    *,
    t: float = 0.0,
) -> Motion:
    """Return one state as a motion with one time: `snapshot(system, rest).sensor("tip").x`, `.to_dataframe()`.

    Parameters
    ----------
    system
        The system.
    state
        A state, or an equilibrium with its accelerations and wrenches.
    u_dot
        Accelerations, (n_u,), in the order of `State.u`; default: those of the equilibrium, zero for a state.
    w
        Wrenches of the connections on their markers A, ground axes, (n_w,); default: as for `u_dot`.
    t
        The time at which all functions of time are evaluated [s].
    """
    if isinstance(state, Equilibrium):
        u_dot = state.u_dot if u_dot is None else u_dot
        w = state.w if w is None else w
        state = state.state
    compiled = compiled_system(system)
    model = compiled.model
    u_dot = np.zeros(int(model.bodies.u0[-1])) if u_dot is None else u_dot
    w = np.zeros(int(model.connections.w0[-1])) if w is None else w
    rows, _ = observed_state(compiled, new_work(model), *motion_of_engine(compiled, state, u_dot), w, t)
    rows = rows_of_file(compiled, rows)
    return as_motion(system, [rows], t, t)


def states_as_motion(system: System, states: Sequence[State]) -> Motion:
    """Return a sequence of states as a motion at times 0, 1, 2, ... without forces, for pictures."""
    compiled = compiled_system(system)
    model, work = compiled.model, new_work(compiled.model)
    still, w = np.zeros(int(model.bodies.u0[-1])), np.zeros(int(model.connections.w0[-1]))
    found = []
    for k, state in enumerate(states):
        rows, _ = observed_state(compiled, work, *motion_of_engine(compiled, state, still), w, float(k))
        found.append(rows_of_file(compiled, rows))
    return as_motion(system, found, 0.0, float(max(len(states) - 1, 0)))


def as_motion(system: System, rows: list[Rows], t: float, t_end: float) -> Motion:
    """Return result rows as a motion in memory."""
    head = head_of(system, Snapshot(), t, t_end, 1.0, 1)  # type: ignore[arg-type]
    return motion_of(Trajectory(head, MemorySource(joint_rows(system, rows)), is_complete=True), system)
