"""Weighted sums of records: arrays entry by entry; everything else must agree."""

from collections.abc import Mapping, Sequence
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from cms.errors import BodyError
from fe_models.foundation.arrays import Array

__all__ = ["blended"]

TRIADS = ("axes", "triad")  #: fields that are rotation matrices, whose sums are made orthogonal again


def blended(values: Sequence[Any], weights: Array, where: str, names: Sequence[str]) -> Any:
    """Return the weighted sum of numbers, arrays, or records of them.

    Parameters
    ----------
    values
        One value of each sample: a number, an array, a record, or a tuple or mapping of these.
    weights
        Weight of each sample, with sum 1, (n_samples,).
    where
        Name of the value in messages, such as "interfaces.tip".
    names
        What messages call the samples.

    Raises
    ------
    BodyError
        If shapes differ, or whole numbers, texts or the number of records do.
    """
    first = values[0]
    for other, name in zip(values[1:], names[1:], strict=True):
        require_alike(first, other, where, (names[0], name))
    if is_dataclass(first) and not isinstance(first, type):
        parts = {
            field.name: blended(
                [getattr(value, field.name) for value in values], weights, f"{where}.{field.name}", names
            )
            for field in fields(first)
            if field.init
        }
        return replace(first, **parts | {name: rotation(parts[name]) for name in TRIADS if name in parts})
    if isinstance(first, Mapping):
        return {key: blended([value[key] for value in values], weights, f"{where}.{key}", names) for key in first}
    if isinstance(first, tuple):
        return tuple(blended(each, weights, f"{where}.{k}", names) for k, each in enumerate(zip(*values, strict=True)))
    if not isinstance(first, float | np.ndarray) or all(np.array_equal(first, other) for other in values[1:]):
        return first  # without rounding
    return sum(weight * value for weight, value in zip(weights, values, strict=True))


def require_alike(first: Any, other: Any, where: str, names: tuple[str, str]) -> None:
    """Raise `BodyError` unless two values have the same kind and shape, and are equal if they are not real numbers."""
    if type(first) is not type(other):
        differ = True
    elif isinstance(first, np.ndarray):
        differ = first.shape != other.shape or (first.dtype.kind != "f" and not np.array_equal(first, other))
    elif isinstance(first, Mapping):
        differ = list(first) != list(other)
    elif isinstance(first, tuple):
        differ = len(first) != len(other)
    else:
        differ = not isinstance(first, float) and not is_dataclass(first) and first != other
    if differ:
        raise BodyError(
            f"parametric body: samples {names[0]} and {names[1]} differ in {where}; expected the same mesh, interfaces "
            "and options of the reduction. A parameter may move nodes, but not change their number or order"
        )


def rotation(matrix: Array) -> Array:
    """Return the rotation matrix nearest to a matrix, (3, 3); exactly the matrix if it is a rotation."""
    if np.array_equal(matrix, np.eye(3)):
        return matrix
    left, _, right = np.linalg.svd(matrix)
    return np.asarray(left @ right)
