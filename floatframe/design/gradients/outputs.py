"""Outputs to be differentiated: a sensor column, reduced over time to one number."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.observed_state import observed_state
from floatframe.design.gradients.parameters import Neighbour
from floatframe.design.gradients.tangents import Point
from floatframe.design.studies.study_file import TAKES
from floatframe.engine.compiling.file_frames import rows_of_file
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.engine.kernels.memory import new_rows
from floatframe.engine.open_equations.configuration import Configurations
from floatframe.errors import ModelError
from floatframe.integrators.integrator import joined_rows
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.results_file import MemorySource
from floatframe.results.sensors import EnergySensor, MomentumSensor, Sensor, measured, sensor_and_column
from floatframe.results.trajectory import Trajectory
from floatframe.simulation.motion_head import joint_rows

__all__ = ["Column", "OutputRequest", "Take", "columns_of", "moved", "values_at", "wanted_of", "weights_of"]

#: reduction of values over time, (n_t,), to a number: a key of `TAKES`, or a function that returns the number and its
#: derivatives
Take = str | Callable[[Array], tuple[float, Array]]

#: energies that are integrals over the motion and not functions of its state
OF_THE_WAY = ("work", "dissipated", "balance")


@dataclass(frozen=True)
class OutputRequest:
    """A named output."""

    name: str
    of: str  #: a sensor or joint coordinate, and its column, such as "tip x"
    take: Take  #: how the values over time become a number: a key of `TAKES`, or a function


@dataclass(frozen=True, eq=False)
class Column:
    """A column of a sensor."""

    sensor: Sensor
    column: str


def wanted_of(outputs: Sequence[str] | Mapping[str, str | tuple[str, Take]]) -> tuple[OutputRequest, ...]:
    """Return outputs from a list of columns ("tip x", last value), or from a dict of names, columns and reductions."""
    if isinstance(outputs, str):
        raise ModelError(f"sensitivities: outputs: expected a list of sensor columns, got the text {outputs!r}")
    named = outputs if isinstance(outputs, Mapping) else {str(of): of for of in outputs}
    if not named:
        raise ModelError("sensitivities: outputs: expected at least one")
    found = []
    for name, given in named.items():
        of, take = (given, "last") if isinstance(given, str) else given
        if not callable(take) and take not in TAKES:
            raise ModelError(f"sensitivities: output {name!r}: no reduction {quoted(take)}{nearest(take, TAKES)}")
        found.append(OutputRequest(name, of, take))
    return tuple(found)


def columns_of(system: System, wanted: tuple[OutputRequest, ...]) -> tuple[Column, ...]:
    """Return the columns of outputs; `ModelError` with the nearest name if there is no such sensor."""
    found = []
    for each in wanted:
        try:
            sensor, column = sensor_and_column(system, each.of)
        except ModelError as error:
            raise ModelError(f"output {each.name!r}: of = {quoted(each.of)}: {error}") from error
        if isinstance(sensor, EnergySensor) and column in OF_THE_WAY:
            raise ModelError(
                f"output {each.name!r}: {column!r} is an integral over the whole motion, which is not differentiated; "
                "take kinetic, strain, gravity, springs or total"
            )
        found.append(Column(sensor, column))
    return tuple(found)


def values_at(neighbour: Neighbour, columns: tuple[Column, ...], points: Sequence[Point]) -> tuple[Array, list[str]]:
    """Return the measured columns at points, (n_points, n_outputs), and their units; angles are continuous."""
    compiled = neighbour.compiled
    if any(isinstance(each.sensor, EnergySensor | MomentumSensor) for each in columns):
        rows = [observed_state(compiled, neighbour.work, p.state, p.u_dot, p.w, p.t)[0] for p in points]
        joined = joined_rows(rows)
    else:
        joined = new_rows(compiled.model, len(points))
        for k, p in enumerate(points):
            for name in ("r", "p", "q", "u"):
                getattr(joined, name)[k] = getattr(p.state, name)
            joined.u_dot[k], joined.w[k], joined.t[k] = p.u_dot, p.w, p.t
    for k, p in enumerate(points):
        joined.angle[k] = p.angle if len(p.angle) else 0.0
    head = replace(neighbour.head, angles=compiled.angles)
    motion = Trajectory(head, MemorySource(joint_rows(neighbour.system, [rows_of_file(compiled, joined)])), True)
    values, units = [], []
    for each in columns:
        measurement = measured(neighbour.system, motion, [each.sensor])[each.sensor.name]
        column = measurement.only(each.column)
        values.append(measurement.columns[column])
        units.append(measurement.units[column])
    return np.array(values).T.reshape(len(points), len(columns)), units


def moved(group: Configurations, compiled: CompiledSystem, point: Point, change: Array, factor: float) -> Point:
    """Return a point after a change of (x, u, u_dot, w), (3 n_u + n_w,), times a factor."""
    n = group.n_v
    dx, du, da, dw = np.split(factor * change, [n, 2 * n, 3 * n])
    state = replace(point.state, u=point.state.u + du)
    if dx.any():
        x = group.retract(vector_of(group, compiled, point.state), dx)
        state = group.state(group.normalized(x), state.u)
    return Point(point.t, state, point.u_dot + da, point.w + dw, point.w_start, point.angle)


def vector_of(group: Configurations, compiled: CompiledSystem, state: State) -> Array:
    """Return x for a state of the engine."""
    q0 = compiled.model.bodies.q0
    return np.concatenate(
        [part for i in range(len(state.r)) for part in (state.r[i], state.p[i], state.q[q0[i] : q0[i + 1]])]
    )


def weights_of(take: Take, values: Array) -> tuple[float, Array]:
    """Return the number taken from values over time, and its derivatives by the values, (n_t,)."""
    if callable(take):
        value, slopes = take(values)
        slopes = np.asarray(slopes, dtype=float)
        if slopes.shape != values.shape:
            raise ModelError(f"sensitivities: expected {len(values)} derivatives of an output, got {slopes.shape}")
        return float(value), slopes
    n, weights = len(values), np.zeros(len(values))
    if take in ("last", "first"):
        weights[-1 if take == "last" else 0] = 1.0
    elif take in ("least", "greatest"):
        weights[values.argmin() if take == "least" else values.argmax()] = 1.0
    elif take == "largest":
        k = int(np.abs(values).argmax())
        weights[k] = np.sign(values[k])
    elif take == "mean":
        weights[:] = 1 / n
    elif take == "rms":
        size = np.sqrt((values**2).mean())
        weights[:] = values / (n * size) if size > 0 else 0.0
    else:  # range
        weights[values.argmax()] += 1.0
        weights[values.argmin()] -= 1.0
    return float(TAKES[take](values)), weights
