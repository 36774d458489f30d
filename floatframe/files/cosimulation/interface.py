"""The interface of a unit: parameters, inputs and outputs as variables with units and initial values."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from fe_models.foundation.parametric_file import read_parametric
from fe_models.foundation.toml_file import first_key
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import FloatframeError, ModelError, SystemFileError
from floatframe.files.cosimulation.unit import Unit
from floatframe.files.system_file.read_system import read_system
from floatframe.files.system_file.run_section import RunOptions, required_run
from floatframe.results.sensors import (
    AngleSensor,
    DisplacementSensor,
    ElongationSensor,
    JointCoordinate,
    ModeSensor,
    MomentumSensor,
    PlaceSensor,
    StrainGauge,
    StressSensor,
    VonMisesSensor,
)

__all__ = ["Variable", "interface", "parameter_paths", "read_unit", "value_at"]

#: sensors that depend only on the state; other sensors respond immediately to forces
OF_THE_STATE = (
    AngleSensor, DisplacementSensor, ElongationSensor, ModeSensor, MomentumSensor, StrainGauge, StressSensor,
    VonMisesSensor,
)  # fmt: skip
COLUMNS_OF_THE_STATE = ("value", "rate")  #: columns of a joint coordinate that depend only on the state
TABLES_OF_NUMBERS = ("bodies", "forces", "couplers")  #: tables whose numbers are parameters by default


@dataclass(frozen=True)
class Variable:
    """A real variable of a unit."""

    name: str
    causality: str  #: causality: parameter, input, output, local or independent
    unit: str = ""  #: unit in the symbols of the system, "" for none
    words: str = ""  #: description of the variable
    start: float = 0.0
    path: str = ""  #: key path of a parameter in the system file
    feeds_through: bool = False  #: whether an output has direct feedthrough from force inputs
    is_drive: bool = False  #: whether an input prescribes a motion
    is_tunable: bool = False  #: whether a parameter may change during a motion
    is_state: bool = False  #: whether the variable is a continuous state with an initial value
    derivative_of: str = ""  #: name of the state of which the variable is the derivative
    #: names of states and inputs on which it depends; None: force inputs if `feeds_through`
    depends_on: tuple[str, ...] | None = None


def value_at(content: Mapping[str, Any], path: str, where: str) -> float:
    """Return the number at a key path of a system file; `SystemFileError` if it does not exist."""
    here: Any = content
    left = path
    while True:
        key, rest = first_key(here, left)
        if rest is None:
            key = int(left) if isinstance(here, list) and left.isdigit() else left
            break
        if key is None or not isinstance(here[key], dict | list):
            raise SystemFileError(
                f"{where}: parameter {path!r}: there is no such key{nearest(path, paths_in(content))}"
            )
        here, left = here[key], rest
    try:
        value = here[key]
    except (KeyError, IndexError):
        raise SystemFileError(
            f"{where}: parameter {path!r}: there is no such key{nearest(path, paths_in(content))}"
        ) from None
    if isinstance(value, bool) or not isinstance(value, int | float):
        raise SystemFileError(f"{where}: parameter {path!r}: expected a number, got {quoted(str(value))}")
    return float(value)


def paths_in(content: Mapping[str, Any]) -> list[str]:
    """Return the key paths of all numbers that are parameters by default."""
    found = [f"system.gravity.{k}" for k in range(len(content.get("system", {}).get("gravity", ())))]
    for table in TABLES_OF_NUMBERS:
        for name, section in content.get(table, {}).items():
            for part, keys in (("", section), ("parameters.", section.get("parameters", {}))):
                numbers = (key for key, x in keys.items() if isinstance(x, int | float) and not isinstance(x, bool))
                found += [f"{table}.{name}.{part}{key}" for key in numbers]
    return found


def parameter_paths(content: Mapping[str, Any], given: Mapping[str, str] | None, where: str) -> dict[str, str]:
    """Return key paths of parameters by name: those given, or all numbers of bodies, forces, couplers and gravity."""
    paths = {path: path for path in paths_in(content)} if given is None else dict(given)
    for path in paths.values():
        value_at(content, path, where)
    return paths


def read_unit(
    path: Path,
    *,
    changes: Mapping[str, float] | None = None,
    inputs: Sequence[str] | None = None,
    outputs: Sequence[str] | None = None,
) -> tuple[Unit, RunOptions]:
    """Read a system file as a unit, with some numbers changed by key path.

    Raises
    ------
    FloatframeError
        If the file or a value is impossible, or an input or output does not exist.
    """
    system, given = read_system(path, changes)
    run = required_run(given, path)
    try:
        return Unit(system, run.integrator, run.h, inputs, outputs), run
    except FloatframeError as error:
        raise SystemFileError(f"{path}: {error}") from error


def interface(unit: Unit, content: Mapping[str, Any], paths: Mapping[str, str], where: str) -> tuple[Variable, ...]:
    """Return the variables of a unit at its start: time, parameters, inputs, outputs; all names are unique.

    Raises
    ------
    ModelError
        If two variables have one name.
    """
    system = unit.system
    found = [Variable("time", "independent", system.units.time_symbol, "time")]
    for name, path in paths.items():
        symbol = system.units.mass_symbol if path.startswith("bodies.") and path.endswith(".mass") else ""
        words = f"{path} of the system file, in its units ({system.units.name})"
        found.append(Variable(name, "parameter", symbol, words, value_at(content, path, where), path))
    for held in unit.held:
        for k, (name, symbol) in enumerate(held.variables(system.units.time_symbol)):
            start = held.start if k == 0 else 0.0
            found.append(Variable(name, "input", symbol, held.words, start, is_drive=held.is_drive))
    found += output_variables(unit)
    seen: set[str] = set()
    for each in found:
        if each.name in seen:
            raise ModelError(f"{where}: two variables are called {each.name!r}; rename a sensor, input or parameter")
        seen.add(each.name)
    return tuple(found)


def output_variables(unit: Unit) -> Iterator[Variable]:
    """Yield the outputs of an initialised unit."""
    for (sensor, _), measurement in zip(unit.sensors, unit.measured(), strict=True):
        is_of_state = isinstance(sensor, OF_THE_STATE) or (
            isinstance(sensor, PlaceSensor) and sensor.quantity != "acceleration"
        )
        for column, values in measurement.columns.items():
            feeds = not (is_of_state or (isinstance(sensor, JointCoordinate) and column in COLUMNS_OF_THE_STATE))
            name, words = f"{sensor.name}.{column}", f"{column} of sensor {sensor.name}"
            unit_words = measurement.units[column]
            symbol = "" if unit_words == "-" or column in measurement.numbers else unit_words
            yield Variable(name, "output", symbol, words, float(values[-1]), feeds_through=feeds)


def content_of(path: Path) -> dict[str, Any]:
    """Return the tables of a system file."""
    return dict(read_parametric(path, SystemFileError))
