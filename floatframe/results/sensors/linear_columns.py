"""Columns of linearised outputs, with the same names as the columns measured over time."""

from collections.abc import Sequence

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.results.sensors.measurement import unit_words
from floatframe.results.small_motions.rows import LinearColumns, Rows
from floatframe.results.small_motions.small_motions import SmallMotions, SmallPlace

__all__ = ["NO_SIZE", "load_linear", "scalar_columns", "vector_linear"]

NO_SIZE = "the magnitude of a zero vector has no derivative"
ROUNDING = 1e-12  #: magnitude, relative to the largest wrench, below which a load is a rounding error


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
