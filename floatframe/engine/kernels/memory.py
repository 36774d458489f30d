"""The memory of a motion between steps, and the results of output times; sizes as in `kernels.model`.

A `State` is what a user gives and gets; a `Memory` is the complete state of a method between steps. Kernels overwrite a
memory, restart records store one, and a block of steps stores the memory after each step (`work.Past`).
"""

from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.model import Model, n_angles, n_b, n_body_loads, n_c, n_loads, n_q, n_u, n_w
from floatframe.engine.kernels.records import Size, integer, real, tabled, zeros
from floatframe.model.state import State

__all__ = [
    "ANGULAR_MOMENTUM",
    "GIVEN",
    "GRAVITATION",
    "KINETIC",
    "MOMENTUM",
    "N_DIAGNOSTICS",
    "N_DRIFTS",
    "OF_ANGLES",
    "OF_ANGLE_RATES",
    "OF_DISTANCES",
    "OF_DISTANCE_RATES",
    "SPRINGS",
    "STRAIN",
    "TAKEN",
    "WORK_GIVEN",
    "WORK_TAKEN",
    "Memory",
    "Rows",
    "memory_at",
    "new_rows",
    "state_sizes",
]

N_DIAGNOSTICS = 12
#: columns of `Rows.diagnostics`: energies, momentum (3), angular momentum about the origin (3), and work as in
#: `Memory`
KINETIC, STRAIN, GRAVITATION, SPRINGS, MOMENTUM, ANGULAR_MOMENTUM, WORK_GIVEN, WORK_TAKEN = 0, 1, 2, 3, 4, 7, 10, 11
N_DRIFTS = 4
OF_DISTANCES, OF_ANGLES, OF_DISTANCE_RATES, OF_ANGLE_RATES = range(N_DRIFTS)  #: columns of `Rows.drift`

GIVEN, TAKEN = 0, 1  #: items of `Memory.work` and `Memory.power`

n_t = Size("n_t")


@tabled
class Memory(NamedTuple):
    """The memory of a method after a step; kernels overwrite it, all other code creates a new one with `changed`."""

    r: Array = real(n_b, 3, unit="m")
    p: Array = real(n_b, 4)  #: Euler parameters
    q: Array = real(n_q)
    u: Array = real(n_u, unit="m/s, rad/s, 1/s")
    u_dot: Array = real(n_u, unit="m/s², rad/s², 1/s²")
    #: further memory of the method: algorithmic accelerations (n_u,), or constraint multipliers
    a: Array = real(Size("n_remembered"))
    w: Array = real(n_w, unit="N, N m")
    #: work supplied by forces and drives, and work dissipated by dampers, friction and modal damping
    work: Array = real(2, unit="J")
    power: Array = real(2, unit="W")  #: supplied and dissipated power
    h: Array = real(unit="s")  #: step size for which `a` is valid; 0 at the start
    h_next: Array = real(unit="s")  #: desired size of the next step
    n_steps: IntArray = integer()  #: number of accepted steps so far
    n_rejected: IntArray = integer()  #: number of rejected steps so far
    n_iterations: IntArray = integer()  #: number of Newton iterations so far
    #: angles of `CompiledSystem.angles`, counted through full turns; empty if not counted
    angle: Array = real(n_angles, unit="rad")
    angle_rate: Array = real(n_angles, unit="rad/s")

    @property
    def state(self) -> State:
        """Positions and velocities of the memory."""
        return State(self.r, self.p, self.q, self.u)

    def changed(self, *, state: State | None = None, **values: Any) -> "Memory":
        """Return the memory with some values replaced; unchanged arrays are shared."""
        if state is not None:
            values |= {name: getattr(state, name) for name in ("r", "p", "q", "u")}
        arrays = {name: np.array(value, getattr(self, name).dtype, order="C") for name, value in values.items()}
        return self._replace(**arrays)

    def copied(self) -> "Memory":
        """Return a copy that the kernels may overwrite."""
        made = memory_of_sizes(len(self.r), len(self.q), len(self.u), len(self.a), len(self.w), len(self.angle))
        for array, values in zip(made, self, strict=True):
            array[...] = values
        return made


@tabled
class Rows(NamedTuple):
    """Results at consecutive output times."""

    t: Array = real(n_t, unit="s")
    r: Array = real(n_t, n_b, 3, unit="m")
    p: Array = real(n_t, n_b, 4)
    q: Array = real(n_t, n_q)
    u: Array = real(n_t, n_u, unit="m/s, rad/s, 1/s")
    u_dot: Array = real(n_t, n_u, unit="m/s², rad/s², 1/s²")
    w: Array = real(n_t, n_w, unit="N, N m")
    diagnostics: Array = real(n_t, N_DIAGNOSTICS, unit="J, kg m/s, kg m²/s, J")
    drift: Array = real(n_t, n_c, N_DRIFTS, unit="m, rad, m/s, rad/s")
    angle: Array = real(n_t, n_angles, unit="rad")
    load: Array = real(n_t, n_loads, 6, unit="N, N m")  #: wrenches on the markers of loads, ground axes
    load_case: Array = real(n_t, n_body_loads)  #: factors of the load cases on bodies


def memory_of_sizes(n_b: int, n_q: int, n_u: int, n_remembered: int, n_w: int, n_angles: int) -> Memory:
    """Return a memory of zeros in one block, whose table costs less than that of single arrays."""
    sizes = {"n_b": n_b, "n_q": n_q, "n_u": n_u, "n_remembered": n_remembered, "n_w": n_w, "angles": n_angles}
    return zeros(Memory(), sizes)


def memory_at(state: State, u_dot: Array, w: Array, a: Array | None = None, *, n_angles: int = 0) -> Memory:
    """Return the memory for a state before the first step.

    a: further memory of the method; None: the accelerations. n_angles: number of counted angles, all of the model or 0.
    """
    a = u_dot if a is None else a
    made = memory_of_sizes(len(state.r), len(state.q), len(state.u), len(a), len(w), n_angles)
    return made.changed(state=state, u_dot=u_dot, a=a, w=w)


def state_sizes(model: Model) -> dict[str, int]:
    """Return the sizes of the arrays that change with time, by name."""
    bodies = model.bodies
    n_u, n_w = int(bodies.u0[-1]), int(model.connections.w0[-1])
    return {"n_b": len(bodies.kind), "n_q": int(bodies.q0[-1]), "n_u": n_u, "n_w": n_w}


def new_rows(model: Model, n_t: int) -> Rows:
    """Return results of zeros for n_t output times; those for none are shared."""
    sizes = {
        "n_c": len(model.connections.size),
        "n_t": n_t,
        "angles": len(model.angles.sign),
        "loads": len(model.loads.marker),
        "body loads": len(model.body_loads.body),
    }
    sizes = state_sizes(model) | sizes
    return zeros(Rows(), sizes) if n_t > 0 else no_rows(tuple(sizes.items()))


@lru_cache(maxsize=64)
def no_rows(sizes: tuple[tuple[str, int], ...]) -> Rows:
    """Return results for no output time."""
    return zeros(Rows(), dict(sizes))
