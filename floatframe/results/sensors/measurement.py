"""The measurement of a sensor: named columns over time, each with its unit."""

from collections.abc import Iterable, Mapping
from dataclasses import Field, dataclass, replace
from typing import Any, ClassVar, Protocol, runtime_checkable

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import Summary, presented
from fe_models.foundation.records import FrozenMapping, frozen_copies
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError, ResultsError
from floatframe.model.forces import Force, JointForce
from floatframe.model.system import System
from floatframe.results.small_motions.rows import LinearColumns
from floatframe.results.small_motions.small_motions import SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = [
    "AnyOutput",
    "LinearSensor",
    "Measurement",
    "Sensor",
    "amplitude_unit",
    "load_columns",
    "owner_and_column",
    "unit_words",
    "vector_columns",
]


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
class Measurement:
    """Columns over time, by name, such as x, y, z, size: `measurement.x`, `measurement["von Mises"]`."""

    sensor: str
    t: Array  #: times, (n_t,) [s]
    columns: Mapping[str, Array]  #: values of each column, (n_t,)
    units: Mapping[str, str]  #: unit of each column, in the symbols of the system
    places: tuple[str, ...] = ()  #: descriptions of the measured points, if they depend on the motion
    numbers: tuple[str, ...] = ()  #: columns that number a place (node, instance) and are not quantities over time

    def __post_init__(self) -> None:
        object.__setattr__(self, "columns", FrozenMapping(dict(self.columns)))
        object.__setattr__(self, "units", FrozenMapping(dict(self.units)))

    def summary(self) -> Summary:
        """Return the content shown by `repr` and notebooks: the times, and the range of each column with its unit."""
        t = f"{len(self.t)}, {self.t[0]:.6g} to {self.t[-1]:.6g}" if len(self.t) else "none"
        table = [
            (name, self.units[name], *((f"{values.min():.6g}", f"{values.max():.6g}") if len(values) else ("", "")))
            for name, values in self.columns.items()
        ]
        rows = [("times", t), *(("place", words) for words in self.places)]
        return Summary(f"Measurement {self.sensor!r}", rows, ("column", "unit", "least", "greatest"), table)

    def __getitem__(self, column: str) -> Array:
        """Return a column by its name, (n_t,); `ResultsError` if there is none."""
        if column not in self.columns:
            raise ResultsError(
                f"sensor {self.sensor!r}: no column {quoted(column)}{nearest(column, list(self.columns))}; it has "
                f"{', '.join(self.columns)}"
            )
        return self.columns[column]

    def __getattr__(self, name: str) -> Array:
        columns = self.__dict__.get("columns", {})
        if name not in columns:
            raise AttributeError(
                f"sensor {self.__dict__.get('sensor')!r} has no {name!r}; columns: {', '.join(columns)}"
            )
        values: Array = columns[name]
        return values

    def __dir__(self) -> list[str]:
        return [*super().__dir__(), *(name for name in self.columns if name.isidentifier())]

    @property
    def quantities(self) -> dict[str, Array]:
        """The columns that are quantities over time, by name."""
        return {name: values for name, values in self.columns.items() if name not in self.numbers}

    def only(self, column: str = "") -> str:
        """Return the name of a column; "" means the only one, or the value of a coordinate.

        Raises
        ------
        ModelError
            If there is no such column, or several.
        """
        if not column and (len(self.columns) == 1 or "value" in self.columns):
            return next(iter(self.columns))
        if not column:
            first = quoted(f"{self.sensor}.{next(iter(self.columns))}")
            raise ModelError(
                f"sensor {self.sensor!r} has the columns {', '.join(self.columns)}; name one, such as {first}"
            )
        if column not in self.columns:
            raise ModelError(f"sensor {self.sensor!r}: no column {quoted(column)}{nearest(column, list(self.columns))}")
        return column

    def alone(self, column: str, name: str = "") -> "Measurement":
        """Return the measurement of one column alone, under a name; "": that of the sensor."""
        column = self.only(column)
        return replace(
            self, sensor=name or self.sensor, columns={column: self.columns[column]},
            units={column: self.units[column]},
            numbers=(column,) if column in self.numbers else (),
        )  # fmt: skip

    def head(self, column: str) -> str:
        """Return the name of a column in the table of a motion."""
        return f"{self.sensor} {column}".strip()

    def channel(self, column: str) -> str:
        """Return the name of a column among all sensors, "sensor column"; a chosen column keeps its name."""
        is_chosen = self.sensor.endswith((f".{column}", f" {column}")) and len(self.columns) == 1
        return self.sensor if is_chosen else f"{self.sensor} {column}"


class AnyOutput(Protocol):
    """What measures motions; its linear outputs are the derivatives of what it measures (`linear_columns`)."""

    @property
    def name(self) -> str:
        """Name of the sensor in its system."""

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the measurement during a motion of the system."""


class Sensor(AnyOutput, Protocol):
    """A frozen dataclass that measures motions; all of them are in `floatframe.results.sensors.SENSORS`."""

    __dataclass_fields__: ClassVar[dict[str, Field[Any]]]


@runtime_checkable
class LinearSensor(AnyOutput, Protocol):
    """A sensor whose linear outputs differences cannot find."""

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return its columns as linear functions of small motions."""


def owner_and_column(name: str, owners: Iterable[str]) -> tuple[str, str]:
    """Return ("tip", "x") for "tip.x" or "tip x", and ("tip", "") for "tip"; ("", "") if it begins with no owner."""
    known = set(owners)
    if name in known:
        return name, ""
    fitting = [each for each in known if name.startswith((f"{each}.", f"{each} "))]
    owner = max(fitting, key=len, default="")
    return owner, name[len(owner) + 1 :] if owner else ""


def vector_columns(values: Array, unit: str, *, prefix: str = "") -> tuple[dict[str, Array], dict[str, str]]:
    """Return the columns x, y, z and size of a vector over time, (n_t, 3), and their units."""
    columns = {f"{prefix}{axis}": values[:, k] for k, axis in enumerate("xyz")}
    columns[f"{prefix}size"] = np.linalg.norm(values, axis=1)
    return columns, dict.fromkeys(columns, unit)


def load_columns(units: Units, force: Array, moment: Array) -> tuple[dict[str, Array], dict[str, str]]:
    """Return the columns of a force and a moment over time, (n_t, 3) each, and their units."""
    of_force = vector_columns(force, unit_words(units, "force"), prefix="force ")
    of_moment = vector_columns(moment, unit_words(units, "moment"), prefix="moment ")
    return of_force[0] | of_moment[0], of_force[1] | of_moment[1]


def unit_words(units: Units, what: str) -> str:
    """Return the unit of a quantity: "length", "speed", "acceleration", "force", "moment", "power", "stress", ..."""
    m, s, F = units.length_symbol, units.time_symbol, units.force_symbol
    return {
        "length": m,
        "speed": f"{m}/{s}",
        "acceleration": f"{m}/{s}²",
        "angle": "rad",
        "angular speed": f"rad/{s}",
        "force": F,
        "moment": f"{F} {m}",
        "energy": f"{F} {m}",
        "momentum": f"{units.mass_symbol} {m}/{s}",
        "angular momentum": f"{units.mass_symbol} {m}²/{s}",
        "stress": units.stress_symbol,
        "modal": f"{units.mass_symbol}^(1/2) {m}",
    }[what]


def amplitude_unit(units: Units, force: Force) -> str:
    """Return the unit of the amplitude of a force.

    For a joint force it is the unit of the field `motor`. For other loads it is "1": their amplitude is a factor.
    """
    if not isinstance(force, JointForce):
        return "1"
    return unit_words(units, "moment" if force.is_angular else "force")
