"""Controllers of a run: called between two steps, at every sampling instant.

The outputs are functions of time with a piece for each sampling instant. A call writes its outputs into the pieces of
its instant and of all later ones, so that companions of the run, which repeat earlier steps, find the outputs that
acted in these steps.

    (1) begin       give such functions to the forces of the outputs, and call the controllers at the start of the run
    (2) step        end batches at sampling instants
    (3) sample      measure the inputs, call the function once, write its outputs; where they jump, continue the motion
                    from the same state with the accelerations of the new forces
"""

import time
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.file_frames import rows_of_file
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import Rows
from floatframe.errors import ModelError
from floatframe.model.controller import Controller
from floatframe.model.forces import WITH_AMPLITUDE, driven_forces
from floatframe.model.functions.time_functions import N_COEFFICIENTS, TimeFunction
from floatframe.model.system import System
from floatframe.results.head import Head
from floatframe.results.results_file import MemorySource
from floatframe.results.sensors import measurement_of, sensor_and_column
from floatframe.results.trajectory import Trajectory
from floatframe.simulation.events import has_events
from floatframe.simulation.held_functions import force_numbers
from floatframe.simulation.motion_head import joint_rows

__all__ = ["Sampling", "require_controllers"]

JUMP = 1e-9  #: relative change of an output below which it is constant, as in `TimeFunction.jumps`
WHOLE = 1e-6  #: difference of a period from a whole number of steps, in steps, that counts as roundoff
MOST_NUMBERS = 2**26  #: largest count of numbers in the functions of a controller's outputs


@dataclass
class Sampled:
    """A controller during a run."""

    controller: Controller
    every: int  #: number of steps of its period
    numbers: tuple[int, ...]  #: functions of time in the compiled system, one for each output
    state: Array | None  #: memory after the last call
    t: list[float] = field(default_factory=list)  #: sampling instants so far
    outputs: list[Array] = field(default_factory=list)  #: outputs at these instants
    states: list[Array] = field(default_factory=list)  #: memory after the calls at these instants
    seconds: float = 0.0  #: computing time of the calls

    def cost_words(self) -> str:
        """Describe the number and computing time of the calls of the function."""
        n = len(self.t)
        each = 1e6 * self.seconds / max(n, 1)
        return f"controller {self.controller.name!r}: its Python function was called {n} times, {each:.3g} µs each"


@dataclass
class Sampling:
    """The controllers of a run."""

    system: System  #: the system with the functions of time of the outputs
    t_start: float
    h: float
    sampled: tuple[Sampled, ...]

    @classmethod
    def of(cls, system: System, t_start: float, h: float, n_total: int) -> "Sampling | None":
        """Return the controllers of a run of n_total steps; None if the system has none.

        Raises
        ------
        ModelError
            If a period is not a whole number of steps, an output is no force or has two controllers, or the system has
            events.
        """
        if not system.controllers:
            return None
        require_no_events(system)
        controllers = system.controllers
        every = {each.name: steps_of(each, h) for each in controllers}
        functions = {}
        for each in controllers:
            n = -(-n_total // every[each.name])
            if n * N_COEFFICIENTS * len(each.outputs) > MOST_NUMBERS:
                raise ModelError(f"controller {each.name!r}: {n} calls in a run are too many; take a longer period")
            begins = t_start + h * (every[each.name] * np.arange(n, dtype=float))
            for name in forces_of(system, each):
                if name in functions:
                    raise ModelError(f"controller {each.name!r}: outputs: {name!r} is an output of another controller")
                functions[name] = TimeFunction(begins, np.zeros((n, N_COEFFICIENTS)))
        held = with_outputs(system, functions)
        compiled, made = compiled_system(held), []
        for each in controllers:
            numbers = [force_numbers(held, compiled, {name})[0] for name in forces_of(system, each)]
            made.append(Sampled(each, every[each.name], tuple(numbers), each.state))
        return cls(held, t_start, h, tuple(made))

    def room(self, n_done: int) -> int:
        """Return the number of steps to the next sampling instant."""
        return min(each.every - n_done % each.every for each in self.sampled)

    def is_due(self, n_done: int) -> bool:
        """Whether a sampling instant follows n_done steps."""
        return any(n_done % each.every == 0 for each in self.sampled)

    def sample(self, n_done: int, row: Rows, head: Head) -> bool:
        """Call the controllers that are due after n_done steps; return whether an output jumps.

        Parameters
        ----------
        row
            Results at this time, in the frames of the engine.
        head
            Head of the run.

        Raises
        ------
        ModelError
            If a function fails or returns something impossible, or an input is not one value.
        """
        arrays = joint_rows(self.system, [rows_of_file(compiled_system(self.system), row)])
        motion = Trajectory(head, MemorySource(arrays), is_complete=False)
        jumps = False
        for each in self.sampled:
            if n_done % each.every == 0:
                x = np.array([value_of(self.system, motion, each.controller, name) for name in each.controller.inputs])
                t = self.t_start + self.h * n_done
                before = each.outputs[-1] if each.outputs else np.zeros(len(each.numbers))
                began = time.perf_counter()
                outputs, each.state = each.controller.outputs_at(t, x, each.state)
                each.seconds += time.perf_counter() - began
                self.take(each, n_done // each.every, t, outputs)
                size = np.maximum(np.abs(outputs), np.abs(before))
                jumps |= bool((np.abs(outputs - before) > JUMP * size).any())
        return jumps

    def take(self, each: Sampled, k: int, t: float, outputs: Array) -> None:
        """Store sample k of a controller, and write its outputs into the functions of time from t on."""
        each.t.append(t)
        each.outputs.append(outputs)
        each.states.append(np.zeros(0) if each.state is None else each.state)
        functions = compiled_system(self.system).model.functions
        for number, value in zip(each.numbers, outputs, strict=True):
            first, last = int(functions.piece0[number]), int(functions.piece0[number + 1])
            functions.piece[first + k : last, 0] = value

    def record(self) -> dict[str, Array]:
        """Return the data to resume from here."""
        found: dict[str, Array] = {}
        for i, each in enumerate(self.sampled):
            found |= {f"controller_{i}_{part}": np.array(getattr(each, part)) for part in ("t", "outputs", "states")}
        return found

    def restore(self, record: Mapping[str, Array]) -> None:
        """Continue from the data of `record`."""
        for i, each in enumerate(self.sampled):
            t, outputs, states = (record[f"controller_{i}_{part}"] for part in ("t", "outputs", "states"))
            for k, instant in enumerate(t):
                each.state = None if each.state is None else states[k]
                self.take(each, k, float(instant), outputs[k])

    def summary(self) -> dict[str, Any]:
        """Return the samples of all controllers, for the head of the results."""
        return {
            each.controller.name: {
                "t": each.t,
                "outputs": {
                    name: [float(u[k]) for u in each.outputs] for k, name in enumerate(each.controller.outputs)
                },
                "states": [state.ravel().tolist() for state in each.states],
            }
            for each in self.sampled
        }


def require_controllers(system: System) -> None:
    """Raise `ModelError` if a controller measures or drives something that the system does not have."""
    if system.controllers:
        require_no_events(system)
    for each in system.controllers:
        forces_of(system, each)
        for name in each.inputs:
            try:
                sensor_and_column(system, name)
            except ModelError as error:
                raise ModelError(f"controller {each.name!r}: inputs: {error}") from error


def require_no_events(system: System) -> None:
    """Raise `ModelError` if a system with controllers has events, which would act between the sampling instants."""
    if has_events(system):
        raise ModelError(
            f"system {system.name!r}: expected no events, stops of couplers or switches of expressions beside "
            f"controllers ({', '.join(each.name for each in system.controllers)}); let the controller switch"
        )


def steps_of(controller: Controller, h: float) -> int:
    """Return the number of steps of a period; `ModelError` if it is not whole."""
    n = round(controller.period / h)
    if n < 1 or abs(controller.period / h - n) > WHOLE * n:
        better = controller.period / max(1, np.ceil(controller.period / h))
        raise ModelError(
            f"controller {controller.name!r}: period = {controller.period:g}: expected a whole multiple of the step, "
            f"since steps end at its calls, got h = {h:.9g}; take h = {better:.6g} and an end that is a multiple of it"
        )
    return n


def with_outputs(system: System, functions: Mapping[str, TimeFunction]) -> System:
    """Return the system whose named forces have these functions of time as motors and factors."""
    forces: list[Any] = list(system.forces)
    for k, force in enumerate(forces):
        function = functions.get(getattr(force, "name", ""))
        if function is not None:
            forces[k] = replace(force, **{WITH_AMPLITUDE[type(force)]: function})
    return replace(system, forces=forces)


def forces_of(system: System, controller: Controller) -> list[str]:
    """Return the forces of a controller's outputs by name; `ModelError` with the nearest name if there is none."""
    choices = driven_forces(system.forces)
    for name in controller.outputs:
        if name not in choices:
            hint = nearest(name, list(choices)) if choices else "; the system has no such force"
            where = f"controller {controller.name!r}: outputs"
            raise ModelError(f"{where}: no joint force, point force or body load {quoted(name)}{hint}")
    return [choices[name].name for name in controller.outputs]


def value_of(system: System, motion: Trajectory, controller: Controller, name: str) -> float:
    """Return the current value of an input."""
    try:
        found = measurement_of(system, motion, name)
        return float(found.columns[found.only()][-1])
    except ModelError as error:
        raise ModelError(f"controller {controller.name!r}: inputs: {error}") from error
