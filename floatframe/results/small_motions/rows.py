"""Outputs as linear functions of small motions.

    y = X x + V x' + A x'' + W dw

with x = (xi, s), the small motions of all bodies and of prescribed inputs (bases, drives), and dw the change of the
wrenches of the connections; all in axes that rotate with a steady rotation.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["LinearColumns", "Rows", "joined"]


@dataclass(frozen=True, eq=False)
class Rows:
    """Coefficients of linear outputs, each (n_rows, ...)."""

    x: Array  #: coefficients of small motions, (n_rows, n_x)
    v: Array  #: coefficients of the rates of small motions, (n_rows, n_x)
    a: Array  #: coefficients of the second rates of small motions, (n_rows, n_x)
    w: Array  #: coefficients of wrenches, (n_rows, n_w)

    def __add__(self, other: "Rows") -> "Rows":
        """Return the sum, row by row."""
        return Rows(self.x + other.x, self.v + other.v, self.a + other.a, self.w + other.w)

    def __sub__(self, other: "Rows") -> "Rows":
        """Return the difference, row by row."""
        return Rows(self.x - other.x, self.v - other.v, self.a - other.a, self.w - other.w)

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.x)

    def __getitem__(self, chosen: int | slice | list[int]) -> "Rows":
        """Return the selected rows."""
        part = slice(chosen, chosen + 1) if isinstance(chosen, int) else chosen
        return Rows(self.x[part], self.v[part], self.a[part], self.w[part])

    def mapped(self, A: Array) -> "Rows":
        """Return A times the rows, (len(A), ...)."""
        A = np.atleast_2d(A)
        return Rows(A @ self.x, A @ self.v, A @ self.a, A @ self.w)

    @property
    def size(self) -> "Rows":
        """The magnitude of each coefficient."""
        return Rows(abs(self.x), abs(self.v), abs(self.a), abs(self.w))

    def without(self, least: "Rows") -> "Rows":
        """Return the rows with zero in place of coefficients below a magnitude, which are rounding errors."""
        pairs = ((getattr(self, name), getattr(least, name)) for name in ("x", "v", "a", "w"))
        return Rows(*(np.where(abs(own) <= bound, 0.0, own) for own, bound in pairs))

    @property
    def rate(self) -> "Rows":
        """The rows of the rate y', which exist only for rows without second rates."""
        assert not self.a.any()  # small motions have no third rates
        assert not self.w.any()
        return Rows(np.zeros_like(self.x), self.x, self.v, self.w)


def joined(parts: list[Rows]) -> Rows:
    """Return rows stacked below each other."""
    return Rows(*(np.concatenate([getattr(part, name) for part in parts]) for name in ("x", "v", "a", "w")))


@dataclass(frozen=True, eq=False)
class LinearColumns:
    """The linearised outputs of a sensor: columns with the names and units of its measurement."""

    columns: Mapping[str, Rows]  #: coefficients of each column, as one row
    units: Mapping[str, str]
    not_linear: Mapping[str, str]  #: columns of the measurement that are not linear here, with the reason
