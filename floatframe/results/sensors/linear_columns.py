"""Columns of linearised outputs, with the same names as the columns measured over time."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.results.small_motions.rows import LinearColumns, Rows

__all__ = ["NO_SIZE", "scalar_columns", "vector_linear"]

NO_SIZE = "the magnitude of a zero vector has no derivative"


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


def scalar_columns(columns: dict[str, Rows], units: dict[str, str]) -> LinearColumns:
    """Return linear columns that consist of one row each."""
    return LinearColumns(columns, units, {})
