"""A system coupled with units of other programs: the master algorithm that advances them by macro-steps."""

import os
from collections.abc import Callable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from typing import Any, cast

from fe_models.foundation.tasks.interrupts import heeded_interrupts
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ConvergenceError, CosimulationError, ModelError
from floatframe.files.cosimulation.foreign_slave import ForeignSlave
from floatframe.files.cosimulation.held_inputs import input_choices
from floatframe.files.cosimulation.interface import output_variables
from floatframe.files.cosimulation.unit import Unit
from floatframe.integrators.integrator import Integrator
from floatframe.model.system import System
from floatframe.results.sensors import sensor_and_column
from floatframe.results.trajectory import Trajectory
from floatframe.results.writer import ResultsPlace, ResultsWriter
from floatframe.simulation.foreign_units import Coupling, ForeignUnit
from floatframe.simulation.integrate import Progress, Run, motion_so_far, number_of_steps

__all__ = ["co_simulate"]

OF_A_DRIVE = (".rate", ".acceleration")


def co_simulate(
    system: System,
    integrator: Integrator,
    t_end: float,
    h: float,
    coupling: Coupling | None = None,
    *,
    output: str | os.PathLike[str] | None = None,
    output_every: int = 1,
    progress: Callable[[Progress], None] | None = None,
) -> Trajectory:
    """Compute the motion of a system with its foreign units from t = 0 to t_end.

    Explicit, from t to t + H:

    (1) sensors of the system at t are the inputs of the units, and outputs of the units at t those of the system
    (2) all take the step with these inputs, which are constant.

    Iterated: (1) and (2) as a first guess; then, until no signal changes by more than the tolerance,

    (3) the signals at t + H are read as in (1), and all return to their states at t
    (4) all take the step with the means of the signals at t and at t + H.

    Parameters
    ----------
    system
        The system, with `fmus`.
    integrator, t_end, h, output, output_every, progress
        As for `integrate`.
    coupling
        Macro-step and scheme; None: explicit, in steps of h.

    Raises
    ------
    ModelError
        If a connection is impossible: no such file, variable, sensor or input, an algebraic loop, or a unit in an
        iteration that cannot restore its state.
    CosimulationError
        If a unit fails or the iteration does not converge; the error contains the motion so far.
    ConvergenceError
        If a step of the system fails; likewise.
    """
    coupling = Coupling() if coupling is None else coupling
    if not system.fmus:
        raise ModelError(f"system {system.name!r}: expected units of other programs (fmus), got none; use integrate")
    wanted = h if coupling.step is None else coupling.step
    per_step = max(1, round(wanted / h))
    if abs(per_step * h - wanted) > 1e-9 * wanted:
        raise ModelError(f"co_simulate: step: expected a multiple of h = {h:g}, got {wanted:g}")
    n_macro = number_of_steps(0.0, t_end, wanted)
    H = t_end / n_macro
    with ExitStack() as held:
        foreign = cast(tuple[ForeignUnit, ...], system.fmus)  # `System` declares only their names
        files = (*system.files, *(each.file for each in foreign))
        place = None if output is None else held.enter_context(ResultsPlace(output, inputs=files))
        slaves = []
        for each in foreign:
            slaves.append(ForeignSlave(each, system.units.time))
            held.callback(slaves[-1].close)
        master = Master(replace(system, fmus=()), integrator, H / per_step, slaves, coupling)
        master.begin()
        unit = master.unit
        assert unit.memory is not None
        assert unit.row is not None
        n_total = n_macro * per_step
        head = replace(unit.head, run=dict(unit.head.run) | {"t_end": t_end, "output_every": output_every})
        writer = None if place is None else ResultsWriter(place, head)
        run = Run(unit.system, integrator, head, 0.0, t_end, H / per_step, n_total, output_every, writer)
        run.keep(unit.row)
        raise_if_interrupted = held.enter_context(heeded_interrupts())
        for k in range(n_macro):
            raise_if_interrupted()
            try:
                master.step(k * H, H)
            except (CosimulationError, ConvergenceError) as error:
                raise with_motion(error, run, k * H, H) from error
            for number, rows in enumerate(unit.steps, start=k * per_step + 1):
                if number % output_every == 0:
                    run.keep(rows)
            run.close_segment_when_due()
            if progress is not None:
                n_done = (k + 1) * per_step
                counts = int(unit.memory.n_iterations), run.watch.notes, int(unit.memory.n_rejected)
                progress(Progress((k + 1) * H, t_end, n_done, n_total, *counts))
        return run.finished(unit.memory)


def with_motion(error: CosimulationError | ConvergenceError, run: Run, t: float, H: float) -> Exception:
    """Return the error with the motion so far and the path of its file."""
    run.look()
    trajectory, where = motion_so_far(run)
    words = f"system {run.system.name!r}: the macro-step of {H:g} from t = {t:.9g} failed: {error}{where}"
    if isinstance(error, ConvergenceError):
        return ConvergenceError(words, t=error.t, h=error.h, residual=error.residual, trajectory=trajectory)
    return CosimulationError(words, t=t, trajectory=trajectory)


@dataclass(frozen=True)
class Signals:
    """Values by name that a system and its units exchange at one time."""

    system: Mapping[str, float]  #: outputs of the system, by sensor.column
    units: Mapping[str, float]  #: inputs of the system that units prescribe

    def __iter__(self) -> Any:
        return iter((self.system, self.units))


class Master:
    """The master of a co-simulation: the system as a unit, the other units, and their connections."""

    def __init__(
        self, system: System, integrator: Integrator, h: float, slaves: Sequence[ForeignSlave], coupling: Coupling
    ) -> None:
        self.slaves, self.coupling = slaves, coupling
        sources = {source for slave in slaves for source in slave.unit.inputs.values()}
        try:
            sensors = {source: sensor_and_column(system, source) for source in sources}
        except ModelError as error:
            raise ModelError(f"fmus: {error}") from error
        targets = targets_of(system, [slave.unit for slave in slaves])
        inputs, outputs = list(dict.fromkeys(targets.values())), sorted({sensor.name for sensor, _ in sensors.values()})
        self.unit = Unit(system, integrator, h, inputs, outputs)
        self.sensors = sensors
        self.columns: dict[str, str] = {}  #: name of the unit's output for each source

    def begin(self) -> None:
        """Initialise the system, the connected columns and the units; raise an error for algebraic loops."""
        self.unit.begin()
        outputs = {each.name: each for each in output_variables(self.unit)}
        for source, (sensor, column) in self.sensors.items():
            names = [name for name in outputs if name.rpartition(".")[0] == sensor.name]
            name = f"{sensor.name}.{column}" if column else names[0]
            if name not in outputs:
                raise ModelError(f"fmus: no column {quoted(source)}{nearest(source, names)}")
            self.columns[source] = name
        self.followers = {source for source, name in self.columns.items() if outputs[name].feeds_through}
        self.require_scheme()
        found = self.unit.values()
        for slave in self.slaves:
            slave.begin(self.unit.t, {name: found[self.columns[s]] for name, s in slave.unit.inputs.items()})
        self.signals = self.exchanged()

    def require_scheme(self) -> None:
        """Raise `ModelError` for an explicit scheme with an algebraic loop, or units or drives that cannot iterate."""
        if self.coupling.scheme == "iterated":
            for slave in self.slaves:
                if not slave.can_go_back:
                    raise ModelError(
                        f"{slave.where}: it cannot keep and restore its state (canGetAndSetFMUstate), which the "
                        'iterated scheme needs; use scheme = "explicit"'
                    )
            drives = [each.name for each in self.unit.held if each.is_drive]
            if drives:
                raise ModelError(f'fmus: {drives[0]} is a drive, which is led explicitly; use scheme = "explicit"')
            return
        for slave in self.slaves:
            for output, target in slave.unit.outputs.items():
                for name in slave.feeds_through(output):
                    source = slave.unit.inputs[name]
                    if source in self.followers and not target.startswith("joints."):
                        raise ModelError(
                            f"{slave.where}: an algebraic loop: its output {output} follows its input {name} at once, "
                            f"which is {source}, an acceleration or force that follows {target} at once; measure a "
                            'position or velocity, or use scheme = "iterated"'
                        )

    def exchanged(self) -> Signals:
        """Return the signals at the time that all units have reached: (1)."""
        found = self.exchanged_once()
        # outputs that depend directly on forces use those of this time
        if self.followers and self.coupling.scheme == "iterated":
            for name, value in found.units.items():
                self.unit.set(name, value)
            found = self.exchanged_once()
        return found

    def exchanged_once(self) -> Signals:
        """Return the signals for the present inputs of the system."""
        measured = self.unit.values()
        of_system = {source: measured[name] for source, name in self.columns.items()}
        of_units: dict[str, float] = {}
        for slave in self.slaves:
            slave.set({name: of_system[source] for name, source in slave.unit.inputs.items()})
            for name, value in slave.outputs().items():
                of_units[slave.unit.outputs[name]] = value
        return Signals(of_system, of_units)

    def apply(self, signals: Signals) -> None:
        """Set the signals as inputs of all units."""
        for name, value in signals.units.items():
            self.unit.set(name, value)
        for slave in self.slaves:
            slave.set({name: signals.system[source] for name, source in slave.unit.inputs.items()})

    def step(self, t: float, H: float) -> None:
        """Take a macro-step of size H from t."""
        if self.coupling.scheme == "explicit":
            self.apply(self.signals)
            self.advance(t, H)
            self.signals = self.exchanged()
            return
        kept, begin = self.unit.state(), self.signals
        states = [slave.state() for slave in self.slaves]
        try:
            guess = begin
            for _ in range(self.coupling.max_iterations):
                self.apply(mean(begin, guess))
                self.advance(t, H)
                found = self.exchanged()
                change = largest_change(guess, found)
                if change <= self.coupling.tolerance:
                    self.signals = found
                    return
                guess = found
                self.unit.restore(kept)
                for slave, state in zip(self.slaves, states, strict=True):
                    slave.restore(state)
            raise CosimulationError(
                f"the iteration of the units did not converge in {self.coupling.max_iterations} rounds (last change "
                f"{change:.2g} of the signals, allowed {self.coupling.tolerance:g}): the coupling is too stiff for the "
                "step; choose a smaller one"
            )
        finally:
            for slave, state in zip(self.slaves, states, strict=True):
                slave.free(state)

    def advance(self, t: float, H: float) -> None:
        """Advance all units by the step: (2)."""
        for slave in self.slaves:
            slave.step(t, H)
        self.unit.step(t, H)


def mean(a: Signals, b: Signals) -> Signals:
    """Return the mean of each signal in two sets."""
    parts = ({name: (x[name] + y[name]) / 2 for name in x} for x, y in zip(a, b, strict=True))
    return Signals(*parts)


def largest_change(a: Signals, b: Signals) -> float:
    """Return the largest relative change of a signal (relative to 1e-12 if the signal is zero)."""
    changes = [abs(y[n] - x[n]) / max(abs(x[n]), abs(y[n]), 1e-12) for x, y in zip(a, b, strict=True) for n in x]
    return max(changes, default=0.0)


def targets_of(system: System, units: Sequence[ForeignUnit]) -> dict[str, str]:
    """Return, by name, the inputs of the system that units prescribe; each may have only one source."""
    choices, found = input_choices(system), {}
    for unit in units:
        for output, target in unit.outputs.items():
            end = next((end for end in OF_A_DRIVE if target.endswith(end) and target.removesuffix(end) in choices), "")
            name = target.removesuffix(end)
            if name not in choices:
                raise ModelError(
                    f"fmus.{unit.name}: outputs: {output}: no input {quoted(target)}{nearest(target, choices)}"
                )
            if end and not choices[name].is_drive:
                raise ModelError(f"fmus.{unit.name}: outputs: {output}: {name} is no drive and has no {end[1:]}")
            if target in found:
                raise ModelError(
                    f"fmus.{unit.name}: outputs: {output}: {target} already has another output as its source"
                )
            found[target] = name
    return found
