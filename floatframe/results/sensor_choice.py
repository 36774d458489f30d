"""Selection of the sensors of a system by names, columns and wildcards."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError, ResultsError
from floatframe.model.forces import driven_forces
from floatframe.model.system import System
from floatframe.results.sensors import coordinate_sensors, measured, measurement_of, sensor_of, sensors_of
from floatframe.results.sensors.joint_coordinate import JointCoordinate
from floatframe.results.sensors.loads import ReactionSensor
from floatframe.results.sensors.measurement import Measurement, Sensor, amplitude_unit, unit_words, vector_columns
from floatframe.results.trajectory import Trajectory

__all__ = ["chosen_measurements", "controller_samples"]

WILD = "*?"
#: difference between output times and sampling instants, as a fraction of a period, below which they are equal
SAME_TIME = 1e-6


def chosen_measurements(system: System, trajectory: Trajectory, names: Sequence[str]) -> list[Measurement]:
    """Return the measurements of the named sensors, each once, in the order of the names.

    A name is that of a sensor, of a column, "sensor.column" or "sensor column", or of a coordinate, "joint.coordinate".
    The name of a joint stands for its coordinates and its reaction, the name of a body for the position of its origin,
    and the name of a controller for its outputs and states.
    In names of sensors and coordinates, * stands for any letters and ? for one letter; if no name matches,
    "sensor.column" is searched as well.

    Raises
    ------
    ModelError
        If names match nothing; the message lists each with the nearest name.
    """
    known = [sensor.name for sensor in (*sensors_of(system), *coordinate_sensors(system))]
    whole: dict[str, Measurement] | None = None
    found: dict[str, Measurement] = {}
    missing: list[str] = []
    for name in names:
        fitting = [each for each in known if fnmatchcase(each, pattern_of(name))] if is_wild(name, known) else []
        if fitting:
            found |= measured(system, trajectory, [sensor_of(system, each) for each in fitting if each not in found])
            continue
        if not is_wild(name, known):
            part = {} if name in known else measurements_of_part(system, trajectory, name)
            if part:
                found |= part
                continue
            try:
                found[name] = measurement_of(system, trajectory, name)
            except ModelError as error:
                missing.append(str(error))
            continue
        if whole is None:
            whole = measured(system, trajectory)
        columns = [
            Measurement(f"{key}.{column}", one.t, {column: one.columns[column]}, {column: one.units[column]})
            for key, one in whole.items()
            for column in one.columns
            if fnmatchcase(f"{key}.{column}", pattern_of(name))
        ]
        if not columns:
            missing.append(f"{quoted(name)}: no sensor, column or coordinate matches{nearest(name, known)}")
        found |= {column.sensor: column for column in columns}
    if missing:
        lines = missing if len(missing) == 1 else ["", *(f"  {each}" for each in missing)]
        raise ModelError(f"system {system.name!r}: unknown sensors: " + "\n".join(lines))
    return list(found.values())


def is_wild(name: str, known: Sequence[str]) -> bool:
    """Return whether a name contains a wildcard and is not an existing name with such a character."""
    return any(letter in name for letter in WILD) and name not in known


def pattern_of(name: str) -> str:
    """Return a pattern in which brackets are literal."""
    return name.replace("[", "[[]")


def controller_samples(system: System, trajectory: Trajectory, name: str) -> Measurement:
    """Return outputs and states of a controller at its sampling instants; columns are its outputs, "state 1", ...

    Raises
    ------
    ResultsError
        If the motion has no such controller, or ended before its samples were stored.
    """
    stored = trajectory.head.summary.get("controllers", {})
    if name not in stored:
        raise ResultsError(f"motion: no samples of a controller {quoted(name)}{nearest(name, list(stored))}")
    found = stored[name]
    states = np.array(found["states"], dtype=float).reshape(len(found["t"]), -1)
    columns = {key: np.array(values, dtype=float) for key, values in found["outputs"].items()}
    columns |= {f"state {k + 1}": states[:, k] for k in range(states.shape[1])}
    unit_of = {each: amplitude_unit(system.units, force) for each, force in driven_forces(system.forces).items()}
    units = {key: unit_of[key] if key in found["outputs"] else "1" for key in columns}
    return Measurement(name, np.array(found["t"], dtype=float), columns, units)


def held_between(samples: Measurement, t: Array) -> Measurement:
    """Return samples at times t, (n_t,), constant from each sampling instant to the next."""
    period = float(samples.t[1] - samples.t[0]) if len(samples.t) > 1 else 1.0
    k = np.maximum(np.searchsorted(samples.t - SAME_TIME * period, t, side="right") - 1, 0)
    return Measurement(samples.sensor, t, {key: values[k] for key, values in samples.columns.items()}, samples.units)


def measurements_of_part(system: System, trajectory: Trajectory, name: str) -> dict[str, Measurement]:
    """Return the measurements of the joint, body or controller with this name; none if it does not exist."""
    for joint in system.joints:
        if joint.name == name:
            own: list[Sensor] = [JointCoordinate(name, each) for each in joint.coordinates]
            return measured(system, trajectory, [*own, ReactionSensor(f"{name} reaction", name)])
    if name in trajectory.body_names:
        columns, units = vector_columns(trajectory.body(name).r, unit_words(system.units, "length"))
        return {f"{name} position": Measurement(f"{name} position", trajectory.t, columns, units)}
    if name in trajectory.head.summary.get("controllers", {}):
        return {name: held_between(controller_samples(system, trajectory, name), trajectory.t)}
    return {}
