"""Comparison of measured and computed modes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cms.assessment.correlation.criteria import (
    LEAST_MAC,
    WINDOW,
    ModePair,
    comac,
    mac,
    mass_at_rows,
    orthogonality,
    pair_modes,
    scale_factors,
)
from cms.assessment.correlation.errors import CorrelationError
from cms.assessment.correlation.measured import MeasuredModes
from cms.assessment.correlation.model_modes import ModelModes, at_rows
from cms.assessment.correlation.points import Placement, PointPairs, pair_points
from cms.assessment.quality.record import plain
from fe_models.foundation.arrays import Array

__all__ = ["Correlation", "Pairing", "correlate"]


@dataclass(frozen=True)
class Pairing:
    """Rules for pairing modes."""

    by_hand: tuple[tuple[int, int], ...] = ()  #: pairs (measured, computed), counted from 1; 0: no partner
    least_mac: float = LEAST_MAC
    window: float = WINDOW


@dataclass(frozen=True, eq=False)
class Correlation:
    """Comparison of a test and a model."""

    measured: MeasuredModes
    model: ModelModes
    points: PointPairs
    mac: Array  #: (n_t, n_m)
    auto_mac: Array  #: MAC of the test with itself, (n_t, n_t); shows modes that its points do not distinguish
    pairs: tuple[ModePair, ...]
    comac: Array  #: COMAC of each measured row over the pairs, (n_rows,); empty without pairs
    #: orthogonality of the paired measured shapes in the mass of the model, (n, n); None: unknown
    orthogonality: Array | None
    cross_orthogonality: Array | None  #: orthogonality of the paired measured shapes to their partners, (n, n)
    why_not: str = ""  #: reason why there is no orthogonality

    @property
    def errors(self) -> Array:
        """Relative frequency errors of the pairs, computed / measured - 1, (n,)."""
        return np.array([self.model.frequencies[p.computed] / self.measured.frequencies[p.measured] - 1
                         for p in self.pairs])  # fmt: skip

    @property
    def shapes(self) -> Array:
        """Computed shapes at the measured rows, (n_rows, n_m)."""
        return at_rows(self.model, self.points.rows, self.points.directions)

    def point_comac(self) -> list[tuple[int, str, float]]:
        """Return point, node, and the smallest COMAC of its directions, worst first."""
        if not self.comac.size:
            return []
        least = [float(self.comac[self.measured.points == point].min()) for point in self.points.points]
        rows = list(zip(self.points.points.tolist(), self.points.nodes, least, strict=True))
        return sorted(rows, key=lambda row: row[2])

    def as_dict(self) -> dict[str, Any]:
        """Return all results in plain types; modes are counted from 1."""
        paired = {pair.measured for pair in self.pairs}
        t, m = self.measured, self.model
        return {
            "test": t.source,
            "model": m.name,
            "points": len(self.points.points),
            "largest_distance": plain(float(np.nanmax(self.points.distances)))
            if np.isfinite(self.points.distances).any() else None,
            "measured_hz": t.frequencies.tolist(),
            "measured_damping": t.damping.tolist(),
            "phase_collinearity": t.collinearity.tolist(),
            "computed_hz": m.frequencies.tolist(),
            "pairs": [
                {"measured": pair.measured + 1, "computed": pair.computed + 1, "mac": pair.mac,
                 "frequency_error": float(error), "by_hand": pair.by_hand}
                for pair, error in zip(self.pairs, self.errors, strict=True)
            ],
            "without_partner": [k + 1 for k in range(t.n_modes) if k not in paired],
            "mac": self.mac.tolist(),
            "auto_mac": self.auto_mac.tolist(),
            "comac": [{"point": p, "node": node, "comac": value} for p, node, value in self.point_comac()],
            "orthogonality": plain(self.orthogonality),
            "cross_orthogonality": plain(self.cross_orthogonality),
            "orthogonality_note": self.why_not,
        }  # fmt: skip


def correlate(
    measured: MeasuredModes,
    model: ModelModes,
    *,
    placement: Placement | None = None,
    pairing: Pairing | None = None,
) -> Correlation:
    """Pair the points and modes of a test and a model, and measure their agreement.

    Raises
    ------
    CorrelationError
        If a point has no node, or a manual pair names a mode that does not exist.
    """
    pairing = pairing or Pairing()
    points = pair_points(measured, model, placement)
    shapes = at_rows(model, points.rows, points.directions)
    if not (np.linalg.norm(shapes, axis=0) > 0).all():
        k = int(np.argmin(np.linalg.norm(shapes, axis=0)))
        raise CorrelationError(f"computed mode {k + 1} moves no measured point; measure more, or end the band below it")
    likeness = mac(measured.shapes, shapes)
    pairs = pair_modes(
        measured.frequencies,
        model.frequencies,
        likeness,
        by_hand=tuple((k - 1, j - 1) for k, j in pairing.by_hand),
        least_mac=pairing.least_mac,
        window=pairing.window,
    )
    a, b = paired_shapes(measured, shapes, pairs)
    own: Array | None = None
    cross: Array | None = None
    why = "" if pairs else "no modes are paired"
    if pairs:
        try:
            M_a = mass_at_rows(shapes[:, : 1 + max(pair.computed for pair in pairs)])
            own, cross = orthogonality(a, M_a), orthogonality(a, M_a, b)
        except CorrelationError as error:
            why = str(error)
    return Correlation(
        measured, model, points, likeness, mac(measured.shapes, measured.shapes), pairs,
        comac(a, b) if pairs else np.zeros(0), own, cross, why,
    )  # fmt: skip


def paired_shapes(measured: MeasuredModes, shapes: Array, pairs: Sequence[ModePair]) -> tuple[Array, Array]:
    """Return measured and computed shapes of the pairs, the measured ones scaled to the computed, (n_rows, n) each."""
    a = measured.shapes[:, [pair.measured for pair in pairs]]
    b = shapes[:, [pair.computed for pair in pairs]]
    return a * scale_factors(a, b), b
