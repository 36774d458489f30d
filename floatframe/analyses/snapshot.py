"""One state as a motion of one time, so that sensors, tables and pictures of motions serve for it too."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.analyses.equilibrium import Equilibrium
from floatframe.compiling.system import CompiledSystem, compiled_system
from floatframe.kernels.memory import Rows, memory_at
from floatframe.kernels.work import Work, new_work
from floatframe.motion.integration import head_of, joint_rows
from floatframe.results.results_file import MemorySource
from floatframe.results.trajectory import Trajectory
from floatframe.state import State
from floatframe.system import System

__all__ = ["observed_state", "snapshot"]


@dataclass(frozen=True)
class Snapshot:
    """What stands in the place of the integrator in the record of one state."""


def snapshot(
    system: System,
    state: State | Equilibrium,
    u_dot: Array | None = None,
    w: Array | None = None,
    *,
    t: float = 0.0,
) -> Trajectory:
    """Return one state as a trajectory of one time, so that sensors, exports and pictures of motions serve for it.

    Parameters
    ----------
    system
        The system.
    state
        A state, or an equilibrium with its accelerations and wrenches.
    u_dot
        Accelerations, (n_u,), in the order of `State.u`; default: those of the equilibrium, zero for a state.
    w
        Wrenches of the connections on their markers A, ground axes, (n_w,); default likewise.
    t
        The time of all functions of time [s].
    """
    if isinstance(state, Equilibrium):
        u_dot = state.u_dot if u_dot is None else u_dot
        w = state.w if w is None else w
        state = state.state
    model = compiled_system(system).model
    u_dot = np.zeros(int(model.bodies.u0[-1])) if u_dot is None else u_dot
    w = np.zeros(int(model.connections.w0[-1])) if w is None else w
    rows, _ = observed_state(compiled_system(system), new_work(model), state, u_dot, w, t)
    head = head_of(system, Snapshot(), t, t, 1.0, 1)  # type: ignore[arg-type]
    return Trajectory(head, MemorySource(joint_rows(system, [rows])), is_complete=True)


def observed_state(
    compiled: CompiledSystem, work: Work, state: State, u_dot: Array, w: Array, t: float
) -> tuple[Rows, Array]:
    """Return the row of results of a state and the power of loads and dampers at it, (2,)."""
    from floatframe.kernels.entry import observe_state

    work.state.time[...] = t
    memory = memory_at(state, u_dot, w)
    rows = observe_state(compiled.model, work, memory, t)
    return rows, np.array([memory.power_given, memory.power_taken])
