"""Columns of linearised outputs, with the same names as the columns measured over time."""

from collections.abc import Callable, Sequence

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError, ResultsError
from floatframe.model.system import System
from floatframe.results.sensors.measurement import AnyOutput, LinearSensor, Measurement, unit_words
from floatframe.results.small_motions.nearby import slopes_of
from floatframe.results.small_motions.rows import LinearColumns, Rows
from floatframe.results.small_motions.small_motions import SmallMotions, SmallPlace
from floatframe.results.trajectory import Trajectory

__all__ = ["NO_SIZE", "differentiated", "linear_columns", "load_linear", "scalar_columns", "vector_linear"]

NO_SIZE = "the magnitude of a zero vector has no derivative"
NO_DERIVATIVE = "it has no derivative here, like the magnitude of a zero vector"
NUMBERS = "numbers of places have no derivative"
ROUNDING = 1e-12  #: magnitude, relative to the largest wrench, below which a load is a rounding error


def linear_columns(sensor: AnyOutput, small: SmallMotions) -> LinearColumns:
    """Return what a sensor measures as linear functions of small motions, by its own `linear` if it has one."""
    return sensor.linear(small) if isinstance(sensor, LinearSensor) else differentiated(sensor.measure, small)


def differentiated(measure: Callable[[System, Trajectory], Measurement], small: SmallMotions) -> LinearColumns:
    """Return the derivatives of what the function of a sensor measures by small motions."""
    try:
        now = measure(small.system, small.now)
    except ResultsError as error:
        raise ModelError(str(error)) from error
    units, not_linear = dict(now.units), dict.fromkeys(now.numbers, NUMBERS)
    try:
        columns, without = slopes_of(lambda *given: measure(*given).quantities, small)
    except ResultsError as error:
        return LinearColumns({}, units, dict.fromkeys(units, str(error)))
    return LinearColumns(columns, units, not_linear | dict.fromkeys(without, NO_DERIVATIVE))


def vector_linear(rows: Rows, value: Array, unit: str, *, prefix: str = "", least: float = 0.0) -> LinearColumns:
    """Return columns x, y, z and size of a vector, see `vector_columns`, from three rows and the present value, (3,).

    least: magnitude below which the vector counts as zero; its size is then not linear.
    """
    columns = {f"{prefix}{axis}": rows[k] for k, axis in enumerate("xyz")}
    units = dict.fromkeys((*columns, f"{prefix}size"), unit)
    size = float(np.linalg.norm(value))
    if size <= least:
        return LinearColumns(columns, units, {f"{prefix}size": NO_SIZE})
    return LinearColumns(columns | {f"{prefix}size": rows.mapped(value / size)}, units, {})


def load_linear(
    small: SmallMotions, rows: Sequence[Rows], values: Sequence[Array], place: SmallPlace | None
) -> LinearColumns:
    """Return the columns of a force and a moment, see `load_columns`, from three rows and the present value of each.

    Rows and values are in ground axes, the columns in the axes of `place`; None: in ground axes.
    """
    columns: dict[str, Rows] = {}
    units: dict[str, str] = {}
    not_linear: dict[str, str] = {}
    for key, part, value in zip(("force", "moment"), rows, values, strict=True):
        if place is not None:
            part, value = place.in_axes(part, value), place.axes.T @ value
        unit = unit_words(small.system.units, key)
        found = vector_linear(part, value, unit, prefix=f"{key} ", least=ROUNDING * small.largest_wrench)
        columns |= found.columns
        units |= found.units
        not_linear |= found.not_linear
    return LinearColumns(columns, units, not_linear)


def scalar_columns(columns: dict[str, Rows], units: dict[str, str]) -> LinearColumns:
    """Return linear columns that consist of one row each."""
    return LinearColumns(columns, units, {})
