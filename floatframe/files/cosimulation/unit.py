"""A system as a unit of a co-simulation: communication steps with held inputs, outputs of sensors, saved states."""

import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.callbacks import raise_errors_of
from floatframe.engine.compiling.file_frames import rows_of_file
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.kernels.memory import Memory, Rows
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ConvergenceError, ModelError, ResultsError
from floatframe.files.cosimulation.held_inputs import HeldInput, function_numbers, with_held_inputs
from floatframe.integrators.integrator import Integrator
from floatframe.model.system import System
from floatframe.results.results_file import MemorySource
from floatframe.results.sensors import Measurement, sensor_and_column, sensors_of
from floatframe.results.trajectory import Trajectory
from floatframe.simulation.events import events_of
from floatframe.simulation.held_functions import write_function
from floatframe.simulation.integrate import number_of_steps
from floatframe.simulation.jumps import jumps_of_steps, over_jumps
from floatframe.simulation.motion_head import head_of, joint_rows
from floatframe.simulation.restart import memory_of_record, restart_record
from floatframe.simulation.switch_events import switch_events
from floatframe.simulation.validity_watch import ValidityWatch

__all__ = ["Unit", "UnitState", "quintic", "sensor_names"]

ROUNDING = 1e-9  #: allowed difference of times of another program, as a fraction of a step
JUMP = 1e-9  #: change of an input, as in `TimeFunction.jumps`, below which it is a rounding error of the other program


@dataclass(frozen=True, eq=False)
class UnitState:
    """The complete state of a unit: time, memory of the integrator, inputs and drive functions."""

    t: float
    memory: Memory
    inputs: Mapping[str, float]
    acting: Mapping[str, float]  #: force inputs that act at present
    drives: Mapping[str, Array]  #: value, rate and second rate of each drive at t, (3,) each

    def to_bytes(self) -> bytes:
        """Return the state as bytes (npz)."""
        data = io.BytesIO()
        record = {f"memory.{name}": array for name, array in restart_record(self.memory, 0).items()}
        for part in ("inputs", "acting"):
            record |= {f"{part}.{name}": np.array(value) for name, value in getattr(self, part).items()}
        record |= {f"drives.{name}": value for name, value in self.drives.items()}
        np.savez(data, t=np.array(self.t), **record)  # type: ignore[arg-type]
        return data.getvalue()

    @staticmethod
    def from_bytes(content: bytes, system: System) -> "UnitState":
        """Return the state from the bytes of `to_bytes`; `ResultsError` if it belongs to another system."""
        try:
            with np.load(io.BytesIO(content), allow_pickle=False) as file:
                record = dict(file)
        except (ValueError, OSError, EOFError) as error:
            raise ResultsError(f"state of a unit: these bytes are not one that was serialised ({error})") from error
        parts: dict[str, dict[str, Any]] = {"memory": {}, "inputs": {}, "acting": {}, "drives": {}}
        for key, value in record.items():
            part, _, name = key.partition(".")
            if part in parts:
                parts[part][name] = value
        memory, _ = memory_of_record(parts["memory"], system)
        inputs, acting = ({k: float(v) for k, v in parts[part].items()} for part in ("inputs", "acting"))
        return UnitState(float(record["t"]), memory, inputs, acting, parts["drives"])


def quintic(begin: Array, end: Array, duration: float) -> Array:
    """Return coefficients c, (6,), of Σ c_k s^k with value, rate, second rate `begin` at s = 0, `end` at s = duration.

    The first three follow from the beginning. With the difference e between the end and their contribution to it, as
    (e0, e1 T, e2 T²),
    c_3 T³ = 10 e0 - 4 e1 T + e2 T²/2,  c_4 T⁴ = -15 e0 + 7 e1 T - e2 T²,  c_5 T⁵ = 6 e0 - 3 e1 T + e2 T²/2.
    """
    T = duration
    x, v, a = begin
    e0 = end[0] - (x + v * T + a * T**2 / 2)
    e1, e2 = (end[1] - (v + a * T)) * T, (end[2] - a) * T**2
    return np.array(
        [
            x, v, a / 2,
            (10 * e0 - 4 * e1 + e2 / 2) / T**3,
            (-15 * e0 + 7 * e1 - e2) / T**4,
            (6 * e0 - 3 * e1 + e2 / 2) / T**5,
        ]
    )  # fmt: skip


def sensor_names(system: System, outputs: Sequence[str] | None) -> list[str]:
    """Return the names of the outputs: the given ones, else all sensors of the system, else all joint coordinates."""
    if outputs is not None:
        return list(outputs)
    named = [sensor.name for sensor in sensors_of(system)]
    return named or [f"{joint.name}.{coordinate}" for joint in system.joints for coordinate in joint.coordinates]


@dataclass
class Unit:
    """A motion that another program controls by inputs, communication steps, outputs, and saved states.

    Force inputs are constant over a communication step. If one changes, the integrator restarts from the present state
    (as `integrate` does at a jump of a force), so that no impulse is lost. A drive moves from its present value to the
    value, rate and acceleration that its three inputs predict for the end of the step (x + v H + a H²/2, v + a H, a),
    by a polynomial of degree five: its second rate does not jump, and the motion is exact if the inputs are those of
    x(t) with constant acceleration. A step depends only on the state and the inputs, bit for bit.
    """

    system: System
    integrator: Integrator
    h: float  #: largest step size of the integrator [s]
    names: Sequence[str] | None = None  #: names of the inputs; None: the default of `with_held_inputs`
    #: sensors, their columns or joint coordinates for outputs; None: the default of `sensor_names`
    outputs: Sequence[str] | None = None
    inputs: dict[str, float] = field(init=False)  #: present values of the inputs
    notes: list[str] = field(init=False, default_factory=list)  #: messages about bodies that left their linear range
    t: float = field(init=False, default=0.0)
    #: results of the time steps in the last communication step
    steps: list[Rows] = field(init=False, default_factory=list)

    def __post_init__(self) -> None:
        if self.system.fmus:
            raise ModelError(
                f"system {self.system.name!r}: it has units of other programs (fmus), which cannot be part "
                "of a unit; remove them and let the master connect them"
            )
        if events_of(self.system):
            raise ModelError(
                f"system {self.system.name!r}: its table [events] cannot be a part of a co-simulation; remove it "
                "and let the master switch"
            )
        stops = [coupler.name for coupler in self.system.couplers if coupler.limits is not None]
        if stops:
            raise ModelError(
                f"system {self.system.name!r}: coupler {stops[0]!r} has limits, which cannot be a part of a "
                "co-simulation; take a force with a table for the stop"
            )
        if switches := switch_events(self.system):
            raise ModelError(
                f"system {self.system.name!r}: the zeros of {switches[0].name!r} switch a law, which cannot be a part "
                "of a co-simulation"
            )
        self.system, self.held = with_held_inputs(self.system, self.names)
        compiled = compiled_system(self.system)
        self.numbers = {each.name: function_numbers(self.system, compiled, each) for each in self.held}
        for name, found in self.numbers.items():
            assert found, f"input {name} is not in the compiled system"
        self.sensors = [sensor_and_column(self.system, name) for name in sensor_names(self.system, self.outputs)]
        self.inputs = {}
        for each in self.held:
            start = (each.start, 0.0, 0.0)
            variables = each.variables(self.system.units.time_symbol)
            self.inputs |= {name: x for (name, _), x in zip(variables, start, strict=False)}
        self.memory: Memory | None = None
        self.acting: dict[str, float] = {}
        self.drives: dict[str, Array] = {}
        self.row: Rows | None = None
        self.work: Work = new_work(compiled.model)
        self.watch = ValidityWatch(self.system, ())

    def set(self, name: str, value: float) -> None:
        """Set an input, which acts from the present time."""
        if name not in self.inputs:
            raise ModelError(f"unit {self.system.name!r}: no input {name!r}; expected one of {', '.join(self.inputs)}")
        if not np.isfinite(value):
            raise ModelError(f"unit {self.system.name!r}: input {name!r}: expected a finite number, got {value}")
        self.inputs[name] = float(value)

    def begin(self, t: float = 0.0) -> None:
        """Close the joints and start the motion at t with the present inputs."""
        compiled = compiled_system(self.system)
        self.t = t
        for each in self.held:
            if each.is_drive:
                x, v, a = self.drive_inputs(each)
                self.drives[each.name] = np.array([x, v, a])
                self.write(each, t, np.array([x, v, a / 2]))
            else:
                self.acting[each.name] = self.inputs[each.name]
                self.write(each, t, np.array([self.inputs[each.name]]))
        self.head = head_of(self.system, self.integrator, t, t + self.h, self.h, 1)
        self.head = replace(self.head, angles=compiled.angles)
        self.work = new_work(compiled.model)
        self.memory = self.integrator.start(self.system, t)
        self.memory, self.row = self.integrator.observe(self.system, t, self.memory, self.work)
        raise_errors_of(compiled.callbacks)

    def drive_inputs(self, each: HeldInput) -> list[float]:
        """Return the present value, rate and acceleration of a drive."""
        return [self.inputs[name] for name, _ in each.variables(self.system.units.time_symbol)]

    def write(self, each: HeldInput, t: float, coefficients: Array) -> None:
        """Write coefficients into the functions of time of an input."""
        for number in self.numbers[each.name]:
            write_function(compiled_system(self.system), number, t, coefficients)

    def settle(self) -> None:
        """Apply changed force inputs; if one jumps, restart the integrator from the present state."""
        assert self.memory is not None
        jumps = False
        for each in self.held:
            if each.is_drive or self.acting[each.name] == self.inputs[each.name]:
                continue
            old, new = self.acting[each.name], self.inputs[each.name]
            jumps |= abs(new - old) > JUMP * max(abs(new), abs(old))
            self.acting[each.name] = new
            self.write(each, self.t, np.array([new]))
        if jumps:
            self.memory, self.row = self.integrator.after_jump(self.system, self.t, self.memory, self.work)

    def step(self, t: float, size: float) -> None:
        """Take a communication step from t to t + size with constant inputs, in equal time steps of at most h.

        Raises
        ------
        ConvergenceError
            If a step fails; the unit is then where it was before.
        ModelError
            If the unit is at another time, or size is not above 0.
        """
        if self.memory is None:
            raise ModelError(f"unit {self.system.name!r}: a step before its beginning")
        if not 0.0 < size < np.inf:
            raise ModelError(f"unit {self.system.name!r}: expected a communication step above 0, got {size}")
        if abs(t - self.t) > ROUNDING * max(size, self.h) + 1e-12 * abs(self.t):
            raise ModelError(
                f"unit {self.system.name!r}: the step is to begin at t = {t:.12g}, but it is at {self.t:.12g}"
            )
        before = self.state()
        try:
            self.advance(size)
        except ConvergenceError:
            self.restore(before)
            raise

    def advance(self, size: float) -> None:
        """Take the time steps of a communication step."""
        self.settle()
        n = number_of_steps(0.0, size, self.h)
        h, t = size / n, self.t
        assert self.memory is not None
        if abs(h - self.memory.h) <= ROUNDING * h:  # a rounding error of the master's clock is not another step size
            h = float(self.memory.h)
        drives: dict[str, Array] = {}
        for each in self.held:
            if each.is_drive:
                x, v, a = self.drive_inputs(each)
                end = np.array([x + v * size + a * size**2 / 2, v + a * size, a])
                self.write(each, t, quintic(self.drives[each.name], end, n * h))
                drives[each.name] = end
        self.work.solver.c_k[...] = 0.0  # factors are renewed, so that a step depends only on the state
        jumps = jumps_of_steps(self.system, t, h, n)
        k, steps = 0, []
        while k < n:
            n_smooth = min((j - k for j in jumps if j >= k), default=n - k)
            if n_smooth:
                self.memory, rows, n_good, failure = self.integrator.advance(
                    self.system, self.memory, self.work, t0=t, h=h, first=k, n_steps=n_smooth, every=1
                )
            else:
                self.memory, rows, self.work, failure = over_jumps(
                    self.integrator, self.system, self.memory, self.work, t=t + k * h, h=h, jumps=jumps[k]
                )
                n_good = int(failure is None)
            k += n_good
            raise_errors_of(compiled_system(self.system).callbacks)
            if failure is not None:
                words = (
                    f"system {self.system.name!r}: the step of {h:g} from t = {t + k * h:.9g} failed: {failure.words}"
                )
                raise ConvergenceError(words, t=t + k * h, h=h, residual=failure.residual)
            self.notes += [note.words for note in self.watch.observe(rows)]
            steps += [Rows(*(array[j : j + 1] for array in rows)) for j in range(len(rows.t))]
            self.row = steps[-1]
        self.t, self.drives, self.steps = t + size, drives, steps

    def measured(self) -> list[Measurement]:
        """Return the present sensor values for the present inputs."""
        if self.memory is None:
            raise ModelError(f"unit {self.system.name!r}: outputs before its beginning")
        self.settle()
        assert self.row is not None
        arrays = joint_rows(self.system, [rows_of_file(compiled_system(self.system), self.row)])
        motion = Trajectory(self.head, MemorySource(arrays), is_complete=False)
        found = [(sensor.measure(self.system, motion), column) for sensor, column in self.sensors]
        return [one.alone(column) if column else one for one, column in found]

    def values(self) -> dict[str, float]:
        """Return the outputs by name "sensor.column"."""
        return {f"{m.sensor}.{name}": float(column[-1]) for m in self.measured() for name, column in m.columns.items()}

    def state(self) -> UnitState:
        """Return the complete state of the unit."""
        if self.memory is None:
            raise ModelError(f"unit {self.system.name!r}: its state before its beginning")
        return UnitState(self.t, self.memory, dict(self.inputs), dict(self.acting), dict(self.drives))

    def restore(self, state: UnitState) -> None:
        """Restore an earlier or later state of this unit."""
        self.t, self.memory = state.t, state.memory
        self.inputs, self.acting, self.drives = dict(state.inputs), dict(state.acting), dict(state.drives)
        for each in self.held:
            if each.is_drive:
                x, v, a = self.drives[each.name]
                self.write(each, self.t, np.array([x, v, a / 2]))
            else:
                self.write(each, self.t, np.array([self.acting[each.name]]))
        self.work = new_work(compiled_system(self.system).model)
        self.memory, self.row = self.integrator.observe(self.system, self.t, self.memory, self.work)
