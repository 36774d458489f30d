"""Comparison of measured and computed modes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.optimize import linear_sum_assignment

from cms.assessment.correlation.errors import CorrelationError
from cms.assessment.correlation.measured import MeasuredModes
from cms.assessment.correlation.model_modes import ModelModes, at_rows
from cms.assessment.correlation.points import Placement, PointPairs, pair_points
from cms.assessment.quality.of_reduction.frequencies import mac
from cms.assessment.quality.record import QualityRecord, information, judge, plain, worst
from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.presentation import presented

__all__ = [
    "Correlation",
    "DampingFit",
    "ModePair",
    "Pairing",
    "comac",
    "correlate_modes",
    "fit_damping",
    "mac",
    "mass_at_rows",
    "orthogonality",
    "pair_modes",
    "scale_factors",
]


# measures of agreement between measured and computed shapes: MAC, COMAC, orthogonality, scale -------------------------
# Sources: Allemang (2003) for MAC and COMAC, O'Callahan, Avitabile and Riemer (1989) for the mass at the measured rows.


MOVING = 0.05  #: motion of a row over all pairs, as a share of the largest, below which it has no COMAC
LEAST_MAC = 0.5
WINDOW = 0.5  #: largest frequency difference between partners, divided by the measured frequency


@dataclass(frozen=True)
class ModePair:
    """Measured mode and its computed partner, by index from 0."""

    measured: int
    computed: int
    mac: float
    by_hand: bool = False


def pair_modes(
    measured: Array,
    computed: Array,
    likeness: Array,
    *,
    by_hand: tuple[tuple[int, int], ...] = (),
    least_mac: float = LEAST_MAC,
    window: float = WINDOW,
) -> tuple[ModePair, ...]:
    """Pair modes such that the sum of their MAC is largest; manual pairs have priority.

    Parameters
    ----------
    measured, computed
        Frequencies, (n_t,) and (n_m,) [Hz].
    likeness
        MAC, (n_t, n_m).
    by_hand
        Pairs of indices from 0; -1 as second index: the measured mode has no partner.

    Raises
    ------
    CorrelationError
        If a manual pair names a mode that does not exist, or names a mode twice.
    """
    taken_t, taken_m = set[int](), set[int]()
    pairs = []
    for k, j in by_hand:
        if not 0 <= k < len(measured) or not -1 <= j < len(computed):
            raise CorrelationError(
                f"pair of modes {k + 1}, {j + 1}: the test has {len(measured)} modes, the model {len(computed)}"
            )
        if k in taken_t or (j in taken_m and j >= 0):
            raise CorrelationError(f"pair of modes {k + 1}, {j + 1}: one of them stands in another pair")
        taken_t.add(k)
        if j >= 0:
            taken_m.add(j)
            pairs.append(ModePair(k, j, float(likeness[k, j]), True))
    ratio = computed[None, :] / measured[:, None]
    is_open = (np.abs(ratio - 1) <= window) & (likeness >= least_mac)
    is_open[list(taken_t)], is_open[:, list(taken_m)] = False, False
    rows, columns = linear_sum_assignment(np.where(is_open, -likeness, 0.0))
    pairs += [ModePair(int(k), int(j), float(likeness[k, j]))
              for k, j in zip(rows, columns, strict=True) if is_open[k, j]]  # fmt: skip
    return tuple(sorted(pairs, key=lambda pair: pair.measured))


def comac(A: Array, B: Array) -> Array:
    """Return the coordinate MAC of paired shapes at each row, (n_rows,): (Σ |a b|)² / (Σ a² Σ b²).

    Shapes are first scaled to unit length, so that every pair has equal weight. Rows whose motion over the pairs, in A
    and in B, is below `MOVING` of the largest hold noise, and have the value NaN.
    """
    a, b = A / np.linalg.norm(A, axis=0), B / np.linalg.norm(B, axis=0)
    of_a, of_b = (a * a).sum(axis=1), (b * b).sum(axis=1)
    moves = np.maximum(of_a / of_a.max(), of_b / of_b.max()) >= MOVING**2
    product = np.abs(a * b).sum(axis=1) ** 2
    size = of_a * of_b
    values = np.divide(product, size, out=np.zeros(len(a)), where=size > 0)
    return np.where(moves, values, np.nan)


def scale_factors(measured: Array, computed: Array) -> Array:
    """Return the least-squares factors, (n,), that scale measured shapes to computed ones, both (n_rows, n)."""
    return np.asarray(np.einsum("rk,rk->k", measured, computed) / np.einsum("rk,rk->k", measured, measured))


def mass_at_rows(shapes: Array) -> Array:
    """Return the model mass at the measured rows, (n_rows, n_rows): (Phi_a⁺)ᵀ Phi_a⁺ of M-orthonormal modes (SEREP).

    Its rank is the number of modes. It only measures the components of a shape along these modes.

    Raises
    ------
    CorrelationError
        If the rows do not distinguish the modes: there are fewer rows than modes, or modes look alike there.
    """
    if shapes.shape[0] < shapes.shape[1] or np.linalg.cond(shapes) > 1e6:
        raise CorrelationError(
            f"{shapes.shape[0]} measured rows cannot distinguish {shapes.shape[1]} modes of the model; no orthogonality"
        )
    inverse = np.linalg.pinv(shapes)
    return np.asarray(inverse.T @ inverse)


def orthogonality(measured: Array, M_a: Array, computed: Array | None = None) -> Array:
    """Return mass-weighted products of measured shapes with each other, or with computed shapes."""

    def scaled(X: Array) -> Array:
        mass = np.einsum("rk,rs,sk->k", X, M_a, X)
        return np.asarray(X / np.sqrt(np.where(mass > 0, mass, 1.0)))

    A = scaled(measured)
    return np.asarray(A.T @ M_a @ (A if computed is None else scaled(computed)))


# comparison of measured and computed modes ----------------------------------------------------------------------------


@dataclass(frozen=True)
class Pairing:
    """Rules for pairing modes."""

    #: pairs (measured, computed), counted from 1; computed 0: the measured mode has no partner
    by_hand: tuple[tuple[int, int], ...] = ()
    least_mac: float = LEAST_MAC
    window: float = WINDOW


@presented
@dataclass(frozen=True, eq=False)
class Correlation(Tabular):
    """Comparison of a test and a model."""

    measured: MeasuredModes
    model: ModelModes
    points: PointPairs
    mac: Array  #: MAC of measured and computed modes, (n_t, n_m)
    auto_mac: Array  #: MAC of the test with itself, (n_t, n_t); shows modes that its points do not distinguish
    pairs: tuple[ModePair, ...]
    comac: Array  #: COMAC of each measured row over the pairs, (n_rows,), NaN without motion; empty without pairs
    #: orthogonality of the paired measured shapes in the mass of the model, (n, n); None: unknown
    orthogonality: Array | None
    cross_orthogonality: Array | None  #: orthogonality of the paired measured shapes to their partners, (n, n)
    why_not: str = ""  #: reason if orthogonality is unknown

    @property
    def errors(self) -> Array:
        """Relative frequency error of each pair, computed / measured - 1, (n,)."""
        return np.array([self.model.frequencies[p.computed] / self.measured.frequencies[p.measured] - 1
                         for p in self.pairs])  # fmt: skip

    @property
    def shapes(self) -> Array:
        """Computed shapes at the measured rows, (n_rows, n_m)."""
        return at_rows(self.model, self.points.rows, self.points.directions)

    def to_table(self) -> Table:
        """Return measured and computed frequency, their relative error and the MAC, one row for each measured mode."""
        partner = {pair.measured: (pair, error) for pair, error in zip(self.pairs, self.errors, strict=True)}
        rows: list[tuple[Any, ...]] = []
        for k, frequency in enumerate(self.measured.frequencies.tolist()):
            if k not in partner:
                rows.append((k + 1, frequency, None, None, None, None))
                continue
            pair, error = partner[k]
            computed = float(self.model.frequencies[pair.computed])
            rows.append((k + 1, frequency, pair.computed + 1, computed, float(error), pair.mac))
        names = ("measured", "measured frequency", "computed", "computed frequency", "error", "MAC")
        return Table.of_rows(names, rows, {"measured frequency": "Hz", "computed frequency": "Hz"})

    @property
    def records(self) -> tuple[QualityRecord, ...]:
        """Verdicts about partners, frequencies, shapes and the orthogonality of the measured shapes."""
        paired, n = {pair.measured for pair in self.pairs}, self.measured.n_modes
        alone = ", ".join(str(k + 1) for k in range(n) if k not in paired)
        reason = f"{len(paired)} of {n} measured modes have a partner" + (f", not {alone}" if alone else "")
        found = [judge("test-partners", 1 - len(paired) / n, reason)]
        if self.pairs:
            errors, macs = self.errors, np.array([pair.mac for pair in self.pairs])
            k, j = int(np.abs(errors).argmax()), int(macs.argmin())
            reason = f"the model is {100 * errors[k]:+.2g} % off at measured mode {self.pairs[k].measured + 1}"
            found.append(judge("test-frequency", abs(errors[k]), reason, {"error": errors}))
            reason = f"least MAC {macs[j]:.3f}, of measured mode {self.pairs[j].measured + 1}"
            found.append(judge("test-mac", 1 - macs[j], reason, {"mac": macs}))
        if self.orthogonality is None:
            return (*found, information("test-orthogonality", f"not known: {self.why_not}"))
        off = np.abs(self.orthogonality - np.diag(np.diag(self.orthogonality)))
        k, j = (int(index) for index in np.unravel_index(off.argmax(), off.shape))
        modes = f"measured modes {self.pairs[k].measured + 1} and {self.pairs[j].measured + 1}"
        return (*found, judge("test-orthogonality", off[k, j], f"largest coupling {off[k, j]:.3f}, of {modes}"))

    def point_comac(self) -> list[tuple[int, str, float]]:
        """Return point, node and the smallest COMAC over its moving directions, worst point first."""
        if not self.comac.size:
            return []
        least = [np.fmin.reduce(self.comac[self.measured.points == point]) for point in self.points.points]
        rows = zip(self.points.points.tolist(), self.points.nodes, map(float, least), strict=True)
        return sorted((row for row in rows if not np.isnan(row[2])), key=lambda row: row[2])

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
            "verdict": worst(self.records),
            "records": [record.as_dict() for record in self.records],
        }  # fmt: skip


def correlate_modes(
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
    """Return measured and computed shapes of the pairs, with the measured ones scaled to fit, (n_rows, n) each."""
    a = measured.shapes[:, [pair.measured for pair in pairs]]
    b = shapes[:, [pair.computed for pair in pairs]]
    return a * scale_factors(a, b), b


# damping of a model from measured ratios by least squares: one ratio for all modes, or Rayleigh damping ---------------


@dataclass(frozen=True, eq=False)
class DampingFit:
    """Fitted damping with its uncertainty."""

    kind: str  #: "ratio" or "rayleigh"
    values: Array  #: damping ratio, or alpha [1/s] and beta [s]
    spread: Array  #: standard deviation of each value
    misfit: float  #: root mean square difference between measured and fitted ratio
    time: float = 1.0  #: time unit of the job that uses the damping [s]

    def table(self) -> str:
        """Return the table [damping] of a job in job units: alpha per time unit, beta in time units."""
        factors = {"ratio": 1.0} if self.kind == "ratio" else {"alpha": self.time, "beta": 1 / self.time}
        rows = (f"{name} = {v * factor:.6g}" for (name, factor), v in zip(factors.items(), self.values, strict=True))
        return "\n".join(["[damping]", *rows])


def fit_damping(frequencies: Array, ratios: Array, *, time: float = 1.0) -> tuple[DampingFit, ...]:
    """Fit zeta = const, and zeta = alpha / (4 pi f) + beta pi f, to measured ratios at frequencies [Hz].

    time: time unit of the job for which the fits write their table [s].

    The standard deviation follows from the residuals, divided by (n - number of constants). The Rayleigh constants are
    those of D = alpha M + beta K; a negative one is set to zero, because a job does not accept it.

    Raises
    ------
    CorrelationError
        If there are fewer than two ratios, or a ratio is negative.
    """
    f, zeta = np.asarray(frequencies, float), np.asarray(ratios, float)
    if len(zeta) < 2 or (zeta < 0).any():
        raise CorrelationError(f"damping: expected two or more measured ratios from 0, got {zeta}")
    fits = []
    for kind, A in (("ratio", np.ones((len(f), 1))), ("rayleigh", np.column_stack([1 / (4 * np.pi * f), np.pi * f]))):
        active = list(range(A.shape[1]))
        x = np.linalg.lstsq(A, zeta, rcond=None)[0]
        if (x < 0).any():
            active = [int(np.argmax(x))]
            x = np.zeros(A.shape[1])
            x[active] = np.linalg.lstsq(A[:, active], zeta, rcond=None)[0]
        left = zeta - A @ x
        freedom = max(len(f) - len(active), 1)
        spread = np.zeros(A.shape[1])
        spread[active] = np.sqrt(np.diag(np.linalg.inv(A[:, active].T @ A[:, active])) * (left @ left) / freedom)
        fits.append(DampingFit(kind, x, spread, float(np.sqrt(np.mean(left**2))), time))
    return tuple(fits)
