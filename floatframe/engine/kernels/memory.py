"""The memory of an integrator after a step, and the results of output times; sizes as in `kernels.model`."""

from typing import NamedTuple

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.kernels.model import Model, n_angles, n_b, n_body_loads, n_c, n_loads, n_w
from floatframe.engine.kernels.records import Size, integer, real, tabled, zeros
from floatframe.engine.kernels.work import n_q, n_u, state_sizes
from floatframe.model.state import State

__all__ = [
    "ANGULAR_MOMENTUM",
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
    "WORK_GIVEN",
    "WORK_TAKEN",
    "Memory",
    "Rows",
    "memory_at",
    "new_rows",
]

N_DIAGNOSTICS = 12
#: columns of `Rows.diagnostics`: energies; momentum (3), and angular momentum about the origin (3); work, as in
#: `Memory`
KINETIC, STRAIN, GRAVITATION, SPRINGS, MOMENTUM, ANGULAR_MOMENTUM, WORK_GIVEN, WORK_TAKEN = 0, 1, 2, 3, 4, 7, 10, 11
N_DRIFTS = 4
OF_DISTANCES, OF_ANGLES, OF_DISTANCE_RATES, OF_ANGLE_RATES = range(N_DRIFTS)  #: columns of `Rows.drift`

n_t = Size("n_t")


@tabled
class Memory(NamedTuple):
    """The memory of an integrator after a step, which the next step overwrites."""

    r: Array = real(n_b, 3, unit="m")
    p: Array = real(n_b, 4)  #: Euler parameters
    q: Array = real(n_q)
    u: Array = real(n_u, unit="m/s, rad/s, 1/s")
    u_dot: Array = real(n_u, unit="m/s², rad/s², 1/s²")
    a: Array = real(n_u, unit="m/s², rad/s², 1/s²")  #: algorithmic acceleration
    w: Array = real(n_w, unit="N, N m")
    work_given: Array = real(unit="J")  #: by forces and drives
    work_taken: Array = real(unit="J")  #: energy dissipated by dampers, friction and modal damping
    power_given: Array = real(unit="W")
    power_taken: Array = real(unit="W")
    h: Array = real(unit="s")  #: size of the step for which `a` holds
    h_wanted: Array = real(unit="s")  #: of the next step
    n_accepted: IntArray = integer()  #: steps
    n_rejected: IntArray = integer()
    angle: Array = real(n_angles, unit="rad")  #: counted through full turns
    angle_rate: Array = real(n_angles, unit="rad/s")


@tabled
class Rows(NamedTuple):
    """Results of consecutive output times."""

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
    load_case: Array = real(n_t, n_body_loads)  #: factors of load cases


def memory_at(state: State, u_dot: Array, w: Array, *, n_angles: int = 0) -> Memory:
    """Return a copy of the memory at a state, before any step, with algorithmic accelerations equal to u_dot.

    n_angles: how many angles are counted, all of the model or none.
    """
    sizes = {"n_b": len(state.r), "n_q": len(state.q), "n_u": len(state.u), "n_w": len(w), "angles": n_angles}
    memory = zeros(Memory(), sizes)
    for name in ("r", "p", "q", "u"):
        getattr(memory, name)[:] = getattr(state, name)
    memory.u_dot[:] = u_dot
    memory.a[:] = u_dot
    memory.w[:] = w
    return memory


def new_rows(model: Model, n_t: int) -> Rows:
    """Return empty results for n_t output times."""
    sizes = {
        "n_c": len(model.connections.size),
        "n_t": n_t,
        "angles": len(model.angles.sign),
        "loads": len(model.loads.marker),
        "body loads": len(model.body_loads.body),
    }
    return zeros(Rows(), state_sizes(model) | sizes)
