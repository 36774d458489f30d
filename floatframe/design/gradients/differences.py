"""Finite differences of fourth order: offsets and weights.

f'(p) = Σ weights f(p + offsets step)/step + O(step⁴): central if f exists on both sides, otherwise one-sided, as
for a damping of zero.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["CENTRAL", "CENTRAL_FIRST", "Stencil"]


@dataclass(frozen=True, eq=False)
class Stencil:
    """Offsets of the evaluations, in steps, and their weights."""

    offsets: tuple[float, ...]
    weights: tuple[float, ...]

    def derivative(self, values: list[Array], step: float) -> Array:
        """Return the derivative from the values at the offsets."""
        return np.asarray(sum(w * np.asarray(v) for w, v in zip(self.weights, values, strict=True)) / step)


CENTRAL = Stencil((-2, -1, 1, 2), (1 / 12, -8 / 12, 8 / 12, -1 / 12))
FORWARD = Stencil((0, 1, 2, 3, 4), (-25 / 12, 4, -3, 4 / 3, -1 / 4))
BACKWARD = Stencil((0, -1, -2, -3, -4), (25 / 12, -4, 3, -4 / 3, 1 / 4))
CENTRAL_FIRST = (CENTRAL, FORWARD, BACKWARD)
