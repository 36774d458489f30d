"""Checks that return read-only arrays for the description of a system; errors use the user's terms (`ModelError`)."""

from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.units import Quantity
from fe_models.foundation.words import quoted
from floatframe.errors import ModelError

__all__ = ["Array", "array_of_shape", "number", "rotation_of", "unit_vector"]

ORTHONORMAL_DEFECT = 1e-6  #: largest |R.T R - 1| that is accepted as rounding of typed numbers


def array_of_shape(where: str, values: Any, shape: tuple[int, ...]) -> Array:
    """Return a read-only float64 copy; raise `ModelError` with `where` if shape or values are invalid."""
    try:
        array = np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError, OverflowError):
        raise ModelError(f"{where}: expected numbers of shape {shape}, got {quoted(values)}") from None
    if array.shape != shape:
        raise ModelError(f"{where}: expected shape {shape}, got {array.shape}")
    if not np.isfinite(array).all():
        raise ModelError(f"{where}: expected finite numbers, got {array.tolist()}")
    array.flags.writeable = False
    return array


def number(where: str, value: Any, *, at_least: float | None = None, above: float | None = None) -> float:
    """Return a finite float, or an unset default unchanged; raise `ModelError` if it is not a number within bounds."""
    try:
        result = value if isinstance(value, Quantity) else float(value)
    except (TypeError, ValueError, OverflowError):
        raise ModelError(f"{where}: expected a number, got {quoted(value)}") from None
    if not np.isfinite(result):
        raise ModelError(f"{where}: expected a finite number, got {result}")
    if at_least is not None and result < at_least:
        raise ModelError(f"{where}: expected a number of {at_least:g} or more, got {result:g}")
    if above is not None and result <= above:
        raise ModelError(f"{where}: expected a number above {above:g}, got {result:g}")
    return result


def unit_vector(where: str, values: Any) -> Array:
    """Return the read-only unit vector in the direction of three given numbers, (3,)."""
    vector = array_of_shape(where, values, (3,))
    length = np.linalg.norm(vector)
    if length == 0:
        raise ModelError(f"{where}: expected a direction, got the zero vector")
    return array_of_shape(where, vector / length, (3,))


def rotation_of(where: str, values: Any) -> Array:
    """Return a read-only rotation matrix, (3, 3), orthonormal to roundoff; raise `ModelError` if it is far from one."""
    matrix = array_of_shape(where, values, (3, 3))
    defect = np.abs(matrix.T @ matrix - np.eye(3)).max()
    if defect > ORTHONORMAL_DEFECT or np.linalg.det(matrix) < 0:
        raise ModelError(
            f"{where}: expected orthonormal right-handed axes as columns, got |R.T R - 1| = {defect:.2e} "
            f"and determinant {np.linalg.det(matrix):.6g}"
        )
    left, _, right = np.linalg.svd(matrix)
    return array_of_shape(where, left @ right, (3, 3))
