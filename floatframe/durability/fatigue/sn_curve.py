"""S-N curves: cycles to failure N over the stress amplitude S, as straight lines in a log-log diagram."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import FatigueError, ModelError

__all__ = ["BELOW", "LEAST_CYCLES", "SNCurve", "basquin_curve", "normal_quantile", "table_curve"]

#: damage of cycles below the last point of a curve, by name
BELOW = {
    "limit": "no damage (fatigue limit; original Miner's rule)",
    "haibach": "the slope k changes to 2k - 1",
    "elementary": "the slope k continues",
}
LEAST_CYCLES = 1000.0  #: first number of cycles of a curve given by a slope; fewer cycles are low-cycle fatigue


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class SNCurve:
    """Cycles to failure at constant amplitude: N = N_j (S / S_j)^(-k_j) for S between the corners j + 1 and j.

    S is the stress amplitude, half the range, in stress units of the body. Line j holds from the amplitude `bottom[j]`
    up to `bottom[j - 1]`. Below the last line there is no damage. Above `greatest` the curve was not measured: cycles
    there are refused, or counted on the first line with a note.

    Parameters
    ----------
    amplitude
        S_j, one point on each line, beginning with the highest load, (n_lines,) [Pa].
    cycles
        N_j at that point, (n_lines,).
    slope
        Slopes k_j >= 1, (n_lines,).
    bottom
        Smallest amplitude of each line, (n_lines,) [Pa]; 0 for the last line means no fatigue limit.
    greatest
        Largest amplitude for which the curve is known [Pa].
    stress_ratio
        R, the smallest stress in the tests divided by the largest.
    notes
        Notes on applied factors and conversions.
    """

    amplitude: Array
    cycles: Array
    slope: Array
    bottom: Array
    greatest: float
    stress_ratio: float = -1.0
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("amplitude", "cycles", "slope", "bottom"):
            object.__setattr__(self, name, frozen(getattr(self, name)))
        n = len(self.amplitude)
        if n == 0 or any(getattr(self, name).shape != (n,) for name in ("cycles", "slope", "bottom")):
            raise FatigueError("S-N curve: expected one slope, number of cycles and least amplitude for each amplitude")
        if not (np.isfinite(self.amplitude).all() and (self.amplitude > 0).all() and (self.cycles > 0).all()):
            raise FatigueError("S-N curve: expected amplitudes and cycles above 0")
        if not (np.isfinite(self.slope).all() and (self.slope >= 1).all()):
            raise FatigueError(
                f"S-N curve: expected slopes k of 1 or more, N ~ S^-k, got {least_words(self.slope)}; in a table "
                "the amplitudes must decrease with the cycles"
            )
        if (np.diff(self.bottom) >= 0).any() or self.bottom[-1] < 0:
            raise FatigueError("S-N curve: expected least amplitudes that decrease from line to line")
        steps = [self.line(j, self.bottom[j]) - self.line(j + 1, self.bottom[j]) for j in range(n - 1)]
        if any(step < -1e-9 * self.line(j, self.bottom[j]) for j, step in enumerate(steps)):
            raise FatigueError("S-N curve: expected lines that meet, or fewer cycles above a corner than below it")
        if not -1 <= self.stress_ratio < 1:
            raise FatigueError(f"S-N curve: stress ratio: expected R with -1 <= R < 1, got {self.stress_ratio:g}")

    @property
    def mean_over_amplitude(self) -> float:
        """Mean stress divided by amplitude in the tests: (1 + R) / (1 - R)."""
        return (1 + self.stress_ratio) / (1 - self.stress_ratio)

    @property
    def fatigue_limit(self) -> float:
        """Amplitude below which there is no damage [Pa]; 0 if there is no limit."""
        return float(self.bottom[-1])

    def line(self, j: int, amplitude: float) -> float:
        """Return 1/N of line j at an amplitude within the range of the line."""
        return float((amplitude / self.amplitude[j]) ** self.slope[j] / self.cycles[j])

    def damage(self, amplitude: Array | float) -> Array:
        """Return the damage 1/N of one cycle of amplitudes at the stress ratio of the curve, same shape."""
        S = np.asarray(amplitude, dtype=float)
        found = np.zeros(S.shape)
        upper = np.inf
        for S_j, N_j, k, low in zip(self.amplitude, self.cycles, self.slope, self.bottom, strict=True):
            on_line = (S > 0) & (S >= low) & (S < upper)
            found[on_line] = (S[on_line] / S_j) ** k / N_j
            upper = low
        return found

    def life(self, amplitude: Array | float) -> Array:
        """Return the cycles to failure at amplitudes, same shape; inf below the fatigue limit."""
        with np.errstate(divide="ignore"):
            return np.asarray(1.0 / self.damage(amplitude))

    def scaled(self, factor: float, reason: str) -> "SNCurve":
        """Return the curve with all amplitudes multiplied by a factor, such as a surface or size factor."""
        if not (math.isfinite(factor) and factor > 0):
            raise FatigueError(f"S-N curve: {reason}: expected a factor above 0, got {factor:g}")
        if factor == 1:
            return self
        return replace(
            self, amplitude=factor * self.amplitude, bottom=factor * self.bottom, greatest=factor * self.greatest,
            notes=(*self.notes, f"{reason}: amplitudes times {factor:.6g}"),
        )  # fmt: skip

    def for_survival(self, wanted: float, *, of_curve: float = 0.5, deviation: float) -> "SNCurve":
        """Return the curve for another probability of survival; log10 N is normally distributed about the median curve.

        Parameters
        ----------
        wanted, of_curve
            Probabilities of survival of the curve returned and of this one, between 0 and 1.
        deviation
            Standard deviation of log10 N.
        """
        for name, value in (("survival", wanted), ("survival of the curve", of_curve)):
            if not 0 < value < 1:
                raise FatigueError(f"S-N curve: {name}: expected a probability between 0 and 1, got {value:g}")
        if not (math.isfinite(deviation) and deviation >= 0):
            raise FatigueError(f"S-N curve: deviation of log10 N: expected a number of 0 or more, got {deviation:g}")
        decades = deviation * (normal_quantile(of_curve) - normal_quantile(wanted))
        words = f"survival {wanted:g} from {of_curve:g}: cycles times {10**decades:.4g}"
        return replace(self, cycles=self.cycles * 10**decades, notes=(*self.notes, words))


def normal_quantile(probability: float) -> float:
    """Return x with Phi(x) = probability, the standard normal distribution."""
    from statistics import NormalDist

    return NormalDist().inv_cdf(probability)


def basquin_curve(
    amplitude: float,
    cycles: float,
    slope: float,
    *,
    second_slope: float | None = None,
    below: str = "elementary",
    stress_ratio: float = -1.0,
    least_cycles: float = LEAST_CYCLES,
) -> SNCurve:
    """Return the curve through a knee, with slope k above it, and a second slope or `below` below it.

    N = cycles (S / amplitude)^-k (Basquin 1910); amplitude is half the range.

    Parameters
    ----------
    amplitude, cycles
        The knee [Pa].
    slope
        Exponent k above the knee, positive.
    second_slope
        Slope below the knee, without a fatigue limit; `below` is then ignored.
    below
        One of `BELOW`.
    stress_ratio
        Ratio R of the smallest to the largest stress in the tests of the curve.
    least_cycles
        Number of cycles at which the curve begins; cycles of larger amplitude are beyond the curve.

    Raises
    ------
    FatigueError
        If a number is out of range.
    """
    for name, value in (("amplitude", amplitude), ("cycles", cycles), ("least_cycles", least_cycles)):
        if not (math.isfinite(value) and value > 0):
            raise FatigueError(f"S-N curve: {name}: expected a number above 0, got {value:g}")
    if not (math.isfinite(slope) and slope >= 1):
        raise FatigueError(f"S-N curve: slope: expected k of 1 or more, N ~ S^-k, got {slope:g}")
    if least_cycles > cycles:
        raise FatigueError(
            f"S-N curve: least_cycles: expected no more than the {cycles:g} cycles of the knee, got {least_cycles:g}"
        )
    greatest = amplitude * (cycles / least_cycles) ** (1 / slope)
    k_2 = slope_below(slope, below) if second_slope is None else second_slope
    if k_2 is None:
        return SNCurve([amplitude], [cycles], [slope], [amplitude], greatest, stress_ratio)  # type: ignore[arg-type]
    if second_slope is not None and not second_slope >= slope:
        raise FatigueError(f"S-N curve: second_slope: expected at least the slope {slope:g}, got {second_slope:g}")
    return SNCurve(
        [amplitude, amplitude], [cycles, cycles], [slope, k_2], [amplitude, 0.0], greatest,  # type: ignore[arg-type]
        stress_ratio,
    )  # fmt: skip


def table_curve(
    cycles: Sequence[float], amplitudes: Sequence[float], *, below: str = "elementary", stress_ratio: float = -1.0
) -> SNCurve:
    """Return the curve through points, linear in log S over log N; `below` continues it beyond the last point.

    Parameters
    ----------
    cycles
        Ascending, (n_points,).
    amplitudes
        Descending, half the ranges, (n_points,) [Pa].
    below
        One of `BELOW`: how the curve continues below its last point.
    stress_ratio
        Ratio R of the smallest to the largest stress in the tests of the curve.

    Raises
    ------
    FatigueError
        If there are fewer than two points, or the amplitudes do not decrease; the message names the point.
    """
    N, S = np.asarray(cycles, dtype=float), np.asarray(amplitudes, dtype=float)
    if N.ndim != 1 or N.shape != S.shape or len(N) < 2:
        raise FatigueError(f"S-N table: expected two points or more, got {N.size} cycles and {S.size} amplitudes")
    if not (np.isfinite(N).all() and np.isfinite(S).all() and (N > 0).all() and (S > 0).all()):
        raise FatigueError("S-N table: expected finite numbers above 0")
    for j in range(1, len(N)):
        if not (N[j] > N[j - 1] and S[j] < S[j - 1]):
            raise FatigueError(
                f"S-N table: point {j + 1}: expected more cycles at a smaller amplitude than {N[j - 1]:g} cycles at "
                f"{S[j - 1]:g}, got {N[j]:g} at {S[j]:g}; order the points by cycles"
            )
    k = -np.diff(np.log(N)) / np.diff(np.log(S))
    if (k < 1).any():
        j = int(np.argmin(k))
        raise FatigueError(f"S-N table: points {j + 1} and {j + 2}: slope k = {k[j]:.3g}, N ~ S^-k; expected 1 or more")
    k_next = slope_below(float(k[-1]), below)
    if k_next is None:
        return SNCurve(S[:-1], N[:-1], k, S[1:], float(S[0]), stress_ratio)
    return SNCurve(S, N, np.r_[k, k_next], np.r_[S[1:], 0.0], float(S[0]), stress_ratio)


def slope_below(slope: float, below: str) -> float | None:
    """Return the slope below the last point; None for a fatigue limit."""
    if below not in BELOW:
        from fe_models.foundation.words import nearest, quoted

        raise FatigueError(f"S-N curve: below: unknown {quoted(below)}{nearest(below, BELOW)}")
    return {"limit": None, "haibach": 2 * slope - 1, "elementary": slope}[below]


def least_words(values: Array) -> str:
    """Return the smallest of some numbers as text."""
    return f"{float(np.min(values)):g}"
