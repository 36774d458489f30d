"""Many runs of one system: a table of its numbers, sensors as arrays, failures as rows.

many = integrate_many(system, {"bodies.rod.mass": masses}, GeneralizedAlpha(), t_end=1.0, h=1e-3)
many.sensors["tip"]                          # (n_runs, n_t, n_columns); NaN where a run failed
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.presentation import Summary, listed, presented
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.tasks.campaign import Campaign
from fe_models.foundation.tasks.notes import recorded_notes
from fe_models.foundation.tasks.workers import Workers
from fe_models.foundation.words import nearest, quoted
from floatframe.design.gradients.parameters import has_same_topology, topology_error, value_at, with_value
from floatframe.design.studies.study import as_placed, report_notes
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError, ResultsError
from floatframe.integrators.integrator import Integrator
from floatframe.integrators.registry import made_integrator
from floatframe.integrators.relative import in_formulation
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.sensors import measurement_of
from floatframe.simulation.integrate import (
    checked_times,
    integrate,
    number_of_steps,
    require_no_units,
    require_watch,
)

__all__ = ["ManyRuns", "integrate_many"]

INSTEAD = "vary it by a sweep (run_study)"
#: largest difference of an output time from the time of its row, as a fraction of a step, and in roundings of the time
SAME_TIME, ROUNDINGS = 1e-6, 4


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ManyRuns:
    """Runs of one system, one for each row of a table of parameters, in the order of the table.

    Parameters
    ----------
    parameters
        Values of each parameter, (n_runs,), by key path.
    t
        Output times, (n_t,) [s].
    sensors
        Values of each sensor, (n_runs, n_t, n_columns); NaN for a run that failed, and after an event that ended a run.
    columns
        Names of the columns of each sensor.
    units
        Units of these columns.
    errors
        Reason why a run failed, "" if it did not, one text for each run.
    notes
        Warnings of each run.
    """

    parameters: Mapping[str, Array]
    t: Array
    sensors: Mapping[str, Array]
    columns: Mapping[str, tuple[str, ...]]
    units: Mapping[str, tuple[str, ...]]
    errors: tuple[str, ...]
    notes: tuple[tuple[str, ...], ...]

    @property
    def n_failed(self) -> int:
        """Number of failed runs."""
        return sum(map(bool, self.errors))

    def column(self, sensor: str, column: str = "") -> Array:
        """Return a column of a sensor at all runs and times, (n_runs, n_t); "" means its only column."""
        if sensor not in self.sensors:
            raise ResultsError(f"runs: no sensor {quoted(sensor)}{nearest(sensor, list(self.sensors))}")
        names = self.columns[sensor]
        if column not in names and (column or len(names) > 1):
            raise ResultsError(f"sensor {sensor!r}: no column {quoted(column)}{nearest(column, names)}")
        return self.sensors[sensor][:, :, names.index(column) if column else 0]

    def summary(self) -> Summary:
        """Return the content shown by `repr` and notebooks: sizes, and the range of each parameter."""
        times = f"{len(self.t)}, {self.t[0]:.6g} to {self.t[-1]:.6g}"
        rows = [("times", times), ("sensors", listed(list(self.sensors)))]
        table = [(name, f"{values.min():.6g}", f"{values.max():.6g}") for name, values in self.parameters.items()]
        title = f"{len(self.errors)} runs, {self.n_failed} of which failed"
        return Summary(title, rows, ("parameter", "least", "greatest"), table)


def integrate_many(
    system: System,
    parameters: Mapping[str, ArrayLike],
    integrator: Integrator | type[Integrator] | str,
    t_end: float,
    h: float,
    *,
    sensors: Sequence[str] | None = None,
    t_start: float = 0.0,
    state: State | None = None,
    output_every: int = 1,
    formulation: str | None = None,
    watch: str = "stop",
    workers: Workers = None,
    progress: Callable[[int, int], None] | None = None,
) -> ManyRuns:
    """Compute the motion of a system for each row of a table of its numbers, and return what its sensors measure.

    Every run is bit for bit the one that `integrate` computes for the system with these numbers.

    Parameters
    ----------
    system
        The system, read once; its other numbers stay as they are.
    parameters
        Values by key path, (n_runs,) each, such as {"bodies.rod.mass": [1.0, 1.1], "forces.spring.stiffness": [9, 10]};
        paths as in `floatframe.design.sensitivities`.
    integrator, t_end, h, t_start, state, output_every, formulation, watch
        As in `integrate`. watch = "off" saves the time of the checks, up to half of a short run.
    sensors
        Names of sensors, joint coordinates or their columns; None: all sensors of the system.
    workers
        Workers that compute runs (docs/cluster.md); None: one process per processor.
    progress
        Called with the number of finished runs and of all runs.

    Returns
    -------
    ManyRuns
        Sensors as arrays. A run that fails is a row of NaN with its message in `errors`.

    Raises
    ------
    ModelError
        Before the first run, if an argument is wrong, or a parameter changes the topology of the system.
    ProcessError
        If the system has a function that cannot be sent to other processes; workers = 1 computes it here.
    WorkerError
        If no workers are available.
    """
    table = values_of_table(system, parameters)
    require_no_units(system)
    require_watch(watch)
    method = in_formulation(made_integrator(integrator), formulation)
    t_start, t_end, h = checked_times(t_start, t_end, h)
    if output_every < 1:
        raise ModelError(f"integrate_many: output_every: expected at least 1, got {output_every}")
    n_steps = number_of_steps(t_start, t_end, h)
    t: Array = t_start + (t_end - t_start) / n_steps * np.arange(0, n_steps + 1, output_every, dtype=float)
    names = tuple(each.name for each in system.sensors) if sensors is None else tuple(sensors)
    if not names:
        raise ModelError(f"integrate_many: sensors: expected at least one, system {system.name!r} has none")
    placed = as_placed(system)
    measured = {name: measurement_of(system, placed, name) for name in names}
    columns = {name: tuple(each.columns) for name, each in measured.items()}
    given = {"integrator": method, "t_end": t_end, "h": h, "t_start": t_start, "state": state,
             "output_every": output_every, "watch": watch}  # fmt: skip
    run = OneRun(system, tuple(table), names, t, given)
    for path, values in table.items():
        run.require_topology(path, values)
    points = [tuple(row) for row in np.column_stack(list(table.values())).tolist()]
    rows = Campaign(run).rows(points, workers, progress=progress)
    report_notes(row.notes for row in rows)
    found = {}
    for name in names:
        missing = np.full((len(t), len(columns[name])), np.nan)
        found[name] = np.array([row.values.get(name, missing) for row in rows])
    return ManyRuns(
        parameters=table,
        t=t,
        sensors=found,
        columns=columns,
        units={name: tuple(each.units[column] for column in each.columns) for name, each in measured.items()},
        errors=tuple(row.error for row in rows),
        notes=tuple(row.notes for row in rows),
    )


def values_of_table(system: System, parameters: Mapping[str, ArrayLike]) -> dict[str, Array]:
    """Return the values of each parameter, (n_runs,); `ModelError` if a path is wrong or lengths differ."""
    if not parameters:
        raise ModelError("integrate_many: parameters: expected at least one")
    table = {}
    for path, values in parameters.items():
        value_at(system, path)
        try:
            array = np.array(values, dtype=float)
        except (TypeError, ValueError):
            array = np.zeros(())
        if array.ndim != 1 or not len(array) or not np.isfinite(array).all():
            raise ModelError(
                f"integrate_many: parameter {path!r}: expected a finite number for each run, (n_runs,), got "
                f"{quoted(values)}"
            )
        table[path] = array
    lengths = {path: len(values) for path, values in table.items()}
    if len(set(lengths.values())) > 1:
        found = ", ".join(f"{path} {n}" for path, n in lengths.items())
        raise ModelError(f"integrate_many: parameters: expected as many values of each, got {found}")
    return table


# one run --------------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class RunRow:
    """What a run found."""

    values: dict[str, Array] = field(default_factory=dict)  #: of each sensor, (n_t, n_columns); none if the run failed
    error: str = ""
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False, repr=False)
class OneRun:
    """The function that computes one run, a task of `Campaign`; a process receives the system once."""

    system: System
    paths: tuple[str, ...]
    sensors: tuple[str, ...]
    t: Array  #: output times, (n_t,)
    given: dict[str, Any]  #: other arguments of `integrate`

    def __repr__(self) -> str:
        """Return the name by which a message about sending the task calls it."""
        return f"system {self.system.name!r}"

    def __call__(self, values: tuple[float, ...]) -> RunRow:
        """Return the row of a run."""
        with recorded_notes() as notes:
            system = self.changed(self.paths, values)
            if not has_same_topology(compiled_system(self.system), compiled_system(system)):
                raise topology_error(", ".join(self.paths), INSTEAD)
            motion = integrate(system, **self.given)
            found = {}
            for name in self.sensors:
                table = np.column_stack(list(measurement_of(system, motion, name).columns.values()))
                found[name] = self.at_output_times(np.asarray(motion.t), table)
        return RunRow(found, notes=tuple(notes))

    def changed(self, paths: Sequence[str], values: Sequence[float]) -> System:
        """Return the system with other numbers at paths; `ModelError` if it does not accept them."""
        system = self.system
        for path, value in zip(paths, values, strict=True):
            system = with_value(system, path, value)
        return system

    def require_topology(self, path: str, values: Array) -> None:
        """Raise `ModelError` if an extreme value of a parameter changes the topology."""
        for value in (float(values.min()), float(values.max())):
            try:
                other = compiled_system(self.changed([path], [value]))
            except ReportedError:  # an impossible value, which becomes a row
                continue
            if not has_same_topology(compiled_system(self.system), other):
                raise topology_error(path, INSTEAD)

    def at_output_times(self, t: Array, values: Array) -> Array:
        """Return the values at the output times, (n_t, n): of the last row at each time, NaN where there is none."""
        slack = SAME_TIME * self.given["h"] + ROUNDINGS * np.spacing(np.abs(self.t))
        k = np.searchsorted(t, self.t + slack, side="right") - 1
        return np.where((np.abs(t[k] - self.t) <= slack)[:, None], values[k], np.nan)

    def failed(self, _: tuple[float, ...], words: str, __: bool) -> RunRow:
        """Return the row of a failed run."""
        return RunRow(error=words)

    def key(self, values: tuple[float, ...]) -> tuple[float, ...]:
        """Return the values."""
        return values

    def record(self, _: RunRow) -> None:
        """Return nothing, because runs are not written to a journal."""

    def row(self, _: tuple[float, ...], __: dict[str, Any]) -> RunRow:
        """Raise, because no journal has a record of a run."""
        raise KeyError
