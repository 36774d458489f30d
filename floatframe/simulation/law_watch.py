"""Check for undeclared time dependence of user functions, by their values at the ends and middles of steps.

Functions of time in fields, expressions and `knots` declare where a law jumps, and steps end there. Any other time
dependence of a user's function is unknown. After some steps the function is therefore evaluated at their ends and
middles, all with the motion at the last end. If a middle value is far from the mean of the end values, the function
jumps or varies faster than the steps, which is reported once. A pulse between these points is missed.
"""

import ctypes
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.callbacks import Callback
from floatframe.engine.compiling.public_elements import PlacedLaw
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.initial_conditions.newton_equations import set_iterate
from floatframe.engine.kernels.memory import Memory
from floatframe.engine.kernels.work import Work, new_work
from floatframe.model.forces import UserForce
from floatframe.model.system import System
from floatframe.simulation.switch_events import unknowns_of_force

__all__ = ["LawWatch"]

N_STEPS = 100  #: smallest number of steps in one check
FAR = 0.05  #: allowed difference between a middle value and the mean of the end values, relative to the largest value
OWN = "floatframe."  #: prefix of modules whose elements declare their time dependence
LAW, FORCE = (ctypes.CFUNCTYPE(None, *[ctypes.c_void_p] * n) for n in (4, 2))


@dataclass
class AskedLaw:
    """A user function, with functions that return its inputs for a motion and its values for inputs."""

    where: str
    callback: Callback
    inputs: Callable[[Memory, Work], Array]  #: returns the inputs, time first
    ask: Callable[[Array, Array], Array]  #: returns the values at given times for the inputs, (n_t, n_out)
    is_told: bool = False


@dataclass
class LawWatch:
    """The user functions of a system, checked in the steps of a run that starts at t_start."""

    system: System
    t_start: float
    h: float
    cut: Collection[int]  #: steps with a declared jump, which are not checked
    n_seen: int = 0  #: number of steps checked so far
    laws: list[AskedLaw] = field(init=False)
    work: Work | None = field(init=False, default=None)

    def __post_init__(self) -> None:
        self.laws = list(asked_laws(self.system, compiled_system(self.system)))

    def observe(self, memory: Memory, n_done: int, *, is_last: bool) -> list[str]:
        """Check the steps since the last check, up to the given memory; return new messages."""
        from floatframe.engine.kernels.entry import evaluate_and_linearize

        if all(law.is_told for law in self.laws) or (n_done - self.n_seen < N_STEPS and not is_last):
            return []
        first, self.n_seen = self.n_seen, n_done
        if n_done == first:
            return []
        model = compiled_system(self.system).model
        if self.work is None:
            self.work = new_work(model)
        set_iterate(self.work, memory.state, w=memory.w)
        self.work.state.time[...] = self.t_start + n_done * self.h
        evaluate_and_linearize(model, self.work, 0.0, 0.0, 1.0)
        t: Array = self.t_start + self.h * (first + 0.5 * np.arange(2 * (n_done - first) + 1, dtype=float))
        t[-1] -= 1e-9 * self.h  # the run may end where a law jumps
        words = []
        for law in self.laws:
            error = law.callback.error
            values = law.ask(law.inputs(memory, self.work), t)
            law.callback.error = error  # only errors of the run itself are raised
            far = np.abs(values[1::2] - 0.5 * (values[:-2:2] + values[2::2])) > FAR * np.abs(values).max(axis=0)
            steps = [first + int(k) for k in np.flatnonzero(far.any(axis=1)) if first + k not in self.cut]
            if steps and not law.is_told:
                law.is_told = True
                words.append(
                    f"{law.where}: its function jumps with time, or varies fast, inside the step of {self.h:.6g} from "
                    f"t = {self.t_start + steps[0] * self.h:.9g}, but a step treats it as a ramp: give the times of "
                    "jumps as knots, or take a shorter step"
                )
        return words


def asked_laws(system: System, compiled: CompiledSystem) -> Iterator[AskedLaw]:
    """Yield the functions of user forces and the laws of the user's own elements."""
    callbacks = iter(compiled.callbacks)
    for u, force in enumerate(force for force in system.forces if isinstance(force, UserForce)):
        if force.function is not None:
            yield asked_force(f"forces.{force.name}", compiled, len(system.couplers) + u, next(callbacks))
    for placed in compiled.laws:
        if not type(placed.element).__module__.startswith(OWN):
            yield asked_element(f"elements.{placed.element.name}", compiled, placed)


def asked_force(where: str, compiled: CompiledSystem, i: int, callback: Callback) -> AskedLaw:
    """Return the function of the user force that is element i among couplers and user forces."""
    elements = compiled.model.elements
    n_out = int(elements.n_forces[i] + elements.n_states[i])
    unknowns = unknowns_of_force(compiled, i)
    function = FORCE(callback.address)

    def ask(inputs: Array, t: Array) -> Array:
        values = np.zeros((len(t), n_out))
        at, first, stride = inputs.ctypes.data, values.ctypes.data, values.strides[0]
        for k, time in enumerate(t):
            inputs[0] = time
            function(at, first + k * stride)
        return values

    return AskedLaw(where, callback, lambda memory, _: np.array([0.0, *memory.w[unknowns]]), ask)


def asked_element(where: str, compiled: CompiledSystem, placed: PlacedLaw) -> AskedLaw:
    """Return the law of an element as a checked function."""
    model = compiled.model
    first, n = int(model.connections.a[placed.connection]), len(placed.markers)
    function, head, data = LAW(placed.value.address), np.array(placed.head, np.int64), np.array(placed.law.data)
    unknowns = [*placed.states, *placed.multipliers]

    def inputs(memory: Memory, work: Work) -> Array:
        markers, parts = work.markers, [np.zeros(1)]
        for m in range(first, first + n):
            parts += [markers.r[m], markers.A[m].ravel(), markers.v[m], markers.omega[m]]
            if placed.law.accelerations:
                parts.append(markers.acceleration[model.markers.accelerated[m]])
        return np.concatenate([*parts, memory.w[unknowns]])

    def ask(row: Array, t: Array) -> Array:
        values = np.zeros((len(t), placed.n_out + len(placed.law.outputs)))
        fixed, stride = (head.ctypes.data, row.ctypes.data, data.ctypes.data), values.strides[0]
        first = values.ctypes.data
        for k, time in enumerate(t):
            row[0] = time
            function(*fixed, first + k * stride)
        return values[:, : placed.n_out]

    return AskedLaw(where, placed.value, inputs, ask)
