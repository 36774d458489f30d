"""Frequencies that resolve resonances, and integrals over them with error bounds.

Between two modes a response is smooth; at a mode it has a peak of half-power width 2 zeta f. The band is cut

    at its ends, at the corners of the levels, and at thirds of an octave,
    at every mode f, and at f (1 ± zeta k), k = 1, 3, 9, ... until zeta k reaches a tenth,

and each panel has the points of the Clenshaw-Curtis rule with 12 intervals (extremes of a Chebyshev polynomial, which
include the ends and the peak). The rule with half as many intervals is nested in it; the difference of both bounds the
error. A pole of the response is at a distance i zeta f from its mode, so that for each panel it is outside the
Bernstein ellipse whose half axes have the sum 4.2. The error is therefore of the order of 4.2^-12 = 3e-8 (Trefethen
(2008)).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError

__all__ = ["ResolvedBand", "resolved_band"]

INTERVALS = 12  #: number of intervals of a panel; even, so that half of them form a nested rule
GROWTH = 3.0  #: ratio of the distances of successive panel ends from a peak
WIDEST = 0.1  #: relative distance from a peak at which octave panels continue
PER_OCTAVE = 3
LEAST_DAMPING = 1e-4  #: smallest damping ratio for which a peak is resolved
APART = 1e-9  #: relative distance below which edges coincide


@dataclass(frozen=True, eq=False)
class ResolvedBand:
    """Points in a band, with the weights of two rules."""

    frequencies: Array  #: ascending frequencies, (n_f,) [Hz]
    weights: Array  #: quadrature weights of the frequencies, (n_f,) [Hz]
    coarse: Array  #: weights of the rule with half the intervals, (n_f,) [Hz]

    def integral(self, values: Array) -> Array:
        """Return the integral of values (n_f, ...) over the band, (...)."""
        return np.asarray(np.tensordot(self.weights, values, axes=(0, 0)))

    def error(self, values: Array) -> Array:
        """Return the difference of the integrals of both rules, (...), which bounds the error of `integral`."""
        return np.abs(np.tensordot(self.weights - self.coarse, values, axes=(0, 0)))


def resolved_band(
    first: float, last: float, modes: Array, damping: Array, corners: Sequence[float] | Array = ()
) -> ResolvedBand:
    """Return the points of a band.

    Parameters
    ----------
    first, last
        Ends of the band [Hz].
    modes, damping
        Frequencies [Hz] and damping ratios of the modes, (n_m,).
    corners
        Further frequencies at which panels end [Hz].
    """
    if not 0 < first < last:
        raise ModelError(f"shake: expected an ascending band above 0 Hz, got {first:g} to {last:g}")
    n = max(1, int(np.ceil(PER_OCTAVE * np.log2(last / first))))
    around = np.concatenate([np.zeros(0), *(edges_around(f, zeta) for f, zeta in zip(modes, damping, strict=True))])
    edges = np.concatenate([np.geomspace(first, last, n + 1), around, np.asarray(corners, dtype=float)])
    edges = np.sort(edges[(edges > first * (1 + APART)) & (edges < last * (1 - APART))])
    edges = np.concatenate([[first], edges, [last]])
    edges = edges[np.concatenate([[True], np.diff(edges) > APART * edges[1:]])]
    edges[-1] = last
    x, w, half = clenshaw_curtis()
    low, size = edges[:-1, None], np.diff(edges)[:, None] / 2
    points = low + size * (1 + x)
    n_panels = len(low)
    f, weights, coarse = (np.zeros(n_panels * INTERVALS + 1) for _ in range(3))
    for k in range(n_panels):
        own = slice(k * INTERVALS, (k + 1) * INTERVALS + 1)
        f[own] = points[k]
        weights[own] += size[k] * w
        coarse[own] += size[k] * half
    f[0], f[-1] = first, last
    return ResolvedBand(f, weights, coarse)


def edges_around(f: float, zeta: float) -> Array:
    """Return the ends of panels about a mode; their distances grow by powers of GROWTH from its half-width [Hz]."""
    width = max(zeta, LEAST_DAMPING)
    n = max(0, int(np.ceil(np.log(WIDEST / width) / np.log(GROWTH))))
    away = width * GROWTH ** np.arange(n + 1)
    return np.asarray(f * np.concatenate([1 - away[away < 1], [1.0], 1 + away]))


@cache
def clenshaw_curtis() -> tuple[Array, Array, Array]:
    """Return the points on -1..1, (13,), their weights, and the weights of the nested rule with every second point."""
    x = -np.cos(np.pi * np.arange(INTERVALS + 1) / INTERVALS)
    half = np.zeros(INTERVALS + 1)
    half[::2] = weights_of(INTERVALS // 2)
    return x, weights_of(INTERVALS), half


def weights_of(n: int) -> Array:
    """Return the weights of the Clenshaw-Curtis rule with an even number n of intervals."""
    angle = np.pi * np.arange(n + 1) / n
    orders = np.arange(0, n + 1, 2)
    moments = 2.0 / (1.0 - orders.astype(float) ** 2)  # integral of cos(k angle) over x
    factor = np.where((orders == 0) | (orders == n), 0.5, 1.0)
    w = 2.0 / n * (factor * moments) @ np.cos(np.outer(orders, angle))
    w[[0, -1]] /= 2
    return np.asarray(w)
