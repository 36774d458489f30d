"""Switching functions: a law jumps at their zeros; their signs are constant within a step.

A step keeps the sign of its beginning even if it ends beyond the zero, so that its motion is smooth. Trial steps of
other sizes therefore find the time of the zero, as that of any event. There the sign changes, and the motion continues
with the accelerations after the jump.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.kernels.memory import Rows
from floatframe.model.elements.element import ElementLaw, Placed
from floatframe.model.elements.element_proxy import ElementProxy
from floatframe.model.forces import UserForce
from floatframe.model.functions.expressions import Tape, compile_expression
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.functions.time_switches import time_parts
from floatframe.model.system import System
from floatframe.simulation.events import Event

__all__ = ["HeldSigns", "SwitchEvent", "beyond_zero", "sign_of", "switch_events", "unknowns_of_force", "with_signs"]


@dataclass(frozen=True)
class SwitchEvent(Event):
    """A switching function passes zero."""

    #: returns the values for result rows, (n_times,); None for an element output, which a sensor measures
    values: Callable[[Sequence[Rows]], Array] | None = None

    @property
    def is_active(self) -> bool:
        """Whether the event changes the motion, which a switch always does."""
        return True


def switch_events(system: System) -> tuple[SwitchEvent, ...]:
    """Return the events of the switching functions of all user forces and elements."""
    compiled = compiled_system(system)
    found = []
    forces = [force for force in system.forces if isinstance(force, UserForce)]
    for u, force in enumerate(forces):
        unknowns = unknowns_of_force(compiled, len(system.couplers) + u)
        numbers = {name: k for k, name in enumerate(force.functions)}
        for key, text in force.switches.items():
            where = f"force {force.name!r}: switches: {key}"
            tape = compile_expression(where, text, force.inputs, parameters=force.parameters, functions=numbers)
            values = partial(values_of_tape, tape, list(force.functions.values()), unknowns)
            found.append(SwitchEvent(f"{force.name}.{key}", f"{force.name}.{key}", values=values))
    for placed in compiled.laws:
        names = (f"{placed.element.name}.{key}" for key in placed.law.switches)
        found += [SwitchEvent(name, name) for name in names]
    return tuple(found)


def values_of_tape(tape: Tape, functions: Sequence[TimeFunction], unknowns: IntArray, rows: Sequence[Rows]) -> Array:
    """Return the values of a user force's switching function for result rows, (n_times,)."""
    t, w = (np.concatenate([getattr(row, name) for row in rows]) for name in ("t", "w"))
    columns = w[:, unknowns].T
    inputs = {0: np.asarray} | {1 + k: partial(column_at, column) for k, column in enumerate(columns)}
    value = time_parts(tape, inputs, functions).value
    assert value is not None  # all inputs are known
    with np.errstate(all="ignore"):
        return np.asarray(value(t), dtype=float)


def column_at(column: Array, t: Array) -> Array:
    """Return the known inputs at times t."""
    return column


def unknowns_of_force(compiled: CompiledSystem, i: int) -> IntArray:
    """Return the indices of the unknowns (values, rates, states) of the user force that is element i."""
    elements = compiled.model.elements
    rows = compiled.model.coordinates.row[elements.coordinate0[i] : elements.coordinate0[i + 1]]
    states = int(elements.core[i]) + int(elements.n_forces[i]) + 3 * np.arange(int(elements.n_states[i]))
    return np.concatenate([rows, rows + 1, states])


def with_signs(system: System, signs: Mapping[str, int]) -> System:
    """Return a system whose switching functions have constant signs, given by event name."""
    if not signs:
        return system
    forces = []
    for force in system.forces:
        if isinstance(force, UserForce) and force.switches:
            held = {key: str(signs[f"{force.name}.{key}"]) for key in force.switches}
            force = replace(force, switches=held)
        forces.append(force)
    elements = []
    for element in system.elements:
        own = tuple(sign for name, sign in signs.items() if name.rpartition(".")[0] == element.name)
        elements.append(HeldSigns(element, own) if own else element)
    return replace(system, forces=forces, elements=elements)


def sign_of(value: float) -> int:
    """Return the sign of a switching function: 1 if it is not negative, else -1."""
    return -1 if value < 0.0 else 1


def beyond_zero(value: float, sign: int) -> float:
    """Return a value with the given sign; a value with the other sign becomes the nearest number with this sign."""
    return value if sign * value > 0.0 else float(np.nextafter(0.0, sign))


# an element whose switching functions have constant signs, as within a step of a run ----------------------------------


@dataclass(frozen=True, eq=False)
class HeldSigns(ElementProxy):
    """An element whose law uses given signs of its switching functions."""

    signs: Sequence[int]  #: sign of its switching functions, 1 or -1

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the element with these signs."""
        law = self.element.law(placed)
        return replace(law, data=[*law.data, *map(float, self.signs)], switches=())
