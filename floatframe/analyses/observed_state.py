"""A result row at one state, and the power of loads and dampers."""

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.kernels.memory import Rows, memory_at
from floatframe.engine.kernels.work import Work
from floatframe.model.state import State

__all__ = ["observed_state"]


def observed_state(
    compiled: CompiledSystem, work: Work, state: State, u_dot: Array, w: Array, t: float
) -> tuple[Rows, Array]:
    """Return the result row at a state of the engine, and the power of loads and of dampers, (2,)."""
    from floatframe.engine.kernels.entry import absolute_kernels

    work.state.time[...] = t
    memory = memory_at(state, u_dot, w)
    rows = absolute_kernels.observe(compiled.model, work, memory=memory, t=t)
    return rows, memory.power
