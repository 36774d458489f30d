"""Selection of the sensors of a system by names, columns and wildcards."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.model.system import System
from floatframe.results.sensors import coordinate_sensors, measured, measurement_of, sensor_of, sensors_of
from floatframe.results.sensors.loads import CoordinateSensor, ReactionSensor
from floatframe.results.sensors.measurement import Measurement, Sensor, unit_words, vector_columns
from floatframe.results.trajectory import Trajectory

__all__ = ["chosen_measurements"]

WILD = "*?"


def chosen_measurements(system: System, trajectory: Trajectory, names: Sequence[str]) -> list[Measurement]:
    """Return the measurements of the sensors with the given names, each once, in the order of the names.

    A name is that of a sensor, of a column, "sensor.column" or "sensor column", or of a coordinate, "joint.coordinate".
    The name of a joint stands for its coordinates and its reaction, that of a body for the position of its origin.
    In names of sensors and coordinates, * stands for any letters and ? for one letter; if none matches, also in
    "sensor.column".

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
            missing.append(f"{quoted(name)}: no sensor, column or coordinate fits{nearest(name, known)}")
        found |= {column.sensor: column for column in columns}
    if missing:
        lines = missing if len(missing) == 1 else ["", *(f"  {each}" for each in missing)]
        raise ModelError(f"system {system.name!r}: sensors that are not there: " + "\n".join(lines))
    return list(found.values())


def is_wild(name: str, known: Sequence[str]) -> bool:
    """Return whether a name is a pattern, and not an existing name that contains such a character."""
    return any(letter in name for letter in WILD) and name not in known


def pattern_of(name: str) -> str:
    """Return a pattern in which brackets are literal characters."""
    return name.replace("[", "[[]")


def measurements_of_part(system: System, trajectory: Trajectory, name: str) -> dict[str, Measurement]:
    """Return the measurements of a joint or a body of that name; none if there is neither."""
    for joint in system.joints:
        if joint.name == name:
            own: list[Sensor] = [CoordinateSensor(f"{name}.{each}", name, each) for each in joint.coordinates]
            return measured(system, trajectory, [*own, ReactionSensor(f"{name} reaction", name)])
    if name in trajectory.body_names:
        columns, units = vector_columns(trajectory.body(name).r, unit_words(system.units, "length"))
        return {f"{name} position": Measurement(f"{name} position", trajectory.t, columns, units)}
    return {}
