"""Shocks and transients: histories of bases and forces, responses over time, and shock response spectra."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as la

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from floatframe.durability.shaking.loads.inputs import input_index
from floatframe.durability.shaking.loads.pulses import Synthesis
from floatframe.durability.shaking.loads.uncertainty import Uncertainty
from floatframe.durability.shaking.responses.response_spectrum import octave_frequencies, shock_response_spectrum
from floatframe.durability.shaking.responses.scalars import scalar_outputs, stress_groups
from floatframe.durability.shaking.responses.stresses import VON_MISES
from floatframe.durability.shaking.responses.time_steps import base_motions, histories
from floatframe.durability.shaking.structure.model import Output, ShakenModel
from floatframe.errors import ModelError

__all__ = ["SpectrumRequest", "TimeRun", "TimeTest", "time_run", "time_runs"]

POINTS_A_CYCLE = 20  #: points per cycle of the highest vibrating mode
AFTER = 10.0  #: cycles of the lowest mode that are computed after the end of an input
MOST_SAMPLES = 2_000_000
ON_GRID = 1e-6  #: fraction of a step by which a time may deviate from the time grid
COARSE_DIGIT = (
    0.25  #: rounding of the last digit of times, as a fraction of a step, above which the step cannot be identified
)
LOST = 0.01  #: change of a history by resampling, relative to its largest value, above which there is a note


@dataclass(frozen=True)
@checked_fields(ModelError)
class SpectrumRequest:
    """A request for shock response spectra of accelerations.

    Parameters
    ----------
    Q
        Quality factors, each above 0.5.
    kind
        "acceleration", "displacement" or "pseudo-velocity".
    first
        First frequency [Hz]; None: a tenth of the frequency of the lowest mode, at most 10 Hz.
    last
        Last frequency [Hz]; None: twice the frequency of the highest mode, at most 10000 Hz.
    per_octave
        Number of frequencies in an octave.
    """

    Q: Sequence[float] = (10.0,)
    kind: str = "acceleration"
    first: float | None = None
    last: float | None = None
    per_octave: int = 12

    def __post_init__(self) -> None:
        where = "shake: spectra"
        if not len(self.Q) or not all(math.isfinite(Q) and Q > 0.5 for Q in self.Q):
            raise ModelError(f"{where}: Q: expected numbers above 0.5, got {list(self.Q)}")
        for name, value in (("first", self.first), ("last", self.last)):
            if value is not None and not (math.isfinite(value) and value > 0):
                raise ModelError(f"{where}: {name}: expected a frequency above 0 [Hz], got {value:g}")
        if self.first is not None and self.last is not None and not self.first < self.last:
            raise ModelError(f"{where}: first, last: expected rising frequencies, got {self.first:g} and {self.last:g}")


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class TimeTest:
    """Histories of inputs, linear between their samples.

    `history` excites one direction after the other, with one run for each; `inputs` act at once in a single run.

    Parameters
    ----------
    name
        Name of the test.
    time
        Rising times, (n_t,) [s].
    history
        Acceleration in SI, (n_t,) [m/s², rad/s²].
    directions
        Directions that `history` excites, one after the other.
    inputs
        Inputs by name, in SI [m/s², rad/s², N, N m], (n_t,) each.
    after
        Time to compute after the end of the history [s]; None: 10 cycles of the lowest mode, or 0 for a transient.
    spectra
        The requested shock response spectra.
    kind
        "shock" or "transient", for the report.
    words
        Description of the history.
    synthesis
        The synthesis that made the history for a spectrum; None: the history was given.
    """

    name: str
    time: Array
    history: Array | None = None
    directions: Sequence[str] = ("x", "y", "z")
    inputs: Mapping[str, Array] | None = None
    after: float | None = None
    spectra: SpectrumRequest = field(default_factory=SpectrumRequest)
    kind: str = "transient"
    words: str = ""
    synthesis: Synthesis | None = None

    def __post_init__(self) -> None:
        where = f"shake: {self.kind} {self.name!r}"
        t = np.asarray(self.time, dtype=float)
        if (self.history is None) == (self.inputs is None):
            raise ModelError(
                f"{where}: expected either a history (one direction after the other) or inputs (all at once)"
            )
        if t.ndim != 1 or len(t) < 2 or not np.isfinite(t).all():
            raise ModelError(f"{where}: time: expected two finite times at least, got {t.shape}")
        if (np.diff(t) <= 0).any():
            k = int(np.flatnonzero(np.diff(t) <= 0)[0])
            raise ModelError(f"{where}: time: row {k + 2}: {t[k + 1]:g} s after {t[k]:g} s; expected rising times")
        for name, values in (
            {"history": self.history} if self.history is not None else dict(self.inputs or {})
        ).items():
            values = np.asarray(values, dtype=float)
            if values.shape != t.shape:
                raise ModelError(f"{where}: {name}: expected {len(t)} values, one per time, got {values.shape}")
            if not np.isfinite(values).all():
                k = int(np.flatnonzero(~np.isfinite(values))[0])
                raise ModelError(f"{where}: {name}: row {k + 1}: expected a finite number; fill or cut the gap")


@dataclass(frozen=True, eq=False)
class TimeRun:
    """Outputs over time."""

    test: str
    kind: str
    direction: str
    outputs: tuple[Output, ...]
    t: Array  #: output times, (n_t,) [s]
    inputs: tuple[str, ...]
    input_values: Array  #: histories of the inputs, (n_act, n_t) [units of the model]
    values: Array  #: histories of the outputs, (n_out, n_t) [units of the model]
    uncertain: Array  #: largest |value| with uncertainty, (n_out,)
    #: velocities of the bases at the end of each input, (n_act,) [units of the model]; NaN for forces
    velocity_left: Array
    displacement_left: Array  #: displacements of the bases at the end of each input, (n_act,)
    spectra_frequencies: Array  #: frequencies of the shock spectra, (n_f,) [Hz]
    spectra: Mapping[str, Mapping[float, Array]]  #: spectra by name of the input or acceleration, then by Q, (n_f,)
    spectra_kind: str = "acceleration"
    words: str = ""
    synthesis: Synthesis | None = None
    notes: tuple[str, ...] = ()

    @property
    def peaks(self) -> Array:
        """Largest |value|, (n_out,)."""
        return np.asarray(np.abs(self.values).max(axis=1))

    @property
    def peak_times(self) -> Array:
        """Times of the peaks, (n_out,) [s]."""
        return np.asarray(self.t[np.abs(self.values).argmax(axis=1)])


def time_runs(model: ShakenModel, test: TimeTest, uncertainty: Uncertainty | None = None) -> list[TimeRun]:
    """Return the runs of a test: one for each direction, or a single one."""
    if test.history is not None:
        return [time_run(model, test, {d: test.history}, uncertainty) for d in test.directions]
    return [time_run(model, test, dict(test.inputs or {}), uncertainty)]


def time_run(
    model: ShakenModel, test: TimeTest, inputs: Mapping[str, Array], uncertainty: Uncertainty | None = None
) -> TimeRun:
    """Return the outputs for histories of some inputs, starting from rest.

    (1) the inputs are sampled densely enough for the highest mode; samples are on the given linear pieces
    (2) modes are integrated one by one, exactly from sample to sample; with uncertain frequencies, the largest value of
        three runs is taken

    Raises
    ------
    ModelError
        If there is no such input, or too many samples are needed.
    """
    where, uncertainty = f"shake: {test.kind} {test.name!r}", uncertainty or Uncertainty()
    columns = np.array([input_index(model, name, where) for name in inputs])
    given = np.asarray(test.time, dtype=float) - test.time[0]
    n_d = len(model.omega) - model.n_residual
    f = model.frequencies[:n_d]
    after = (AFTER / float(f[0]) if test.kind == "shock" else 0.0) if test.after is None else test.after
    h = min(1 / (POINTS_A_CYCLE * float(f[-1])), float(given[-1]) / 200)
    notes: list[str] = []
    n_t = math.ceil((given[-1] + after) / h) + 1
    if n_t > MOST_SAMPLES:
        raise ModelError(
            f"{where}: {n_t:.2g} samples are needed for the highest mode, {f[-1]:.4g} Hz, over "
            f"{given[-1] + after:.4g} s, expected "
            f"up to {MOST_SAMPLES:.0e}; let higher modes respond statically (residual_above), or shorten the history"
        )
    rows = np.stack(
        [
            model_factor(model, int(k)) * np.asarray(v, dtype=float)
            for k, v in zip(columns, inputs.values(), strict=True)
        ]
    )
    t, values, words = sampled(given, rows, h, after)
    if words:
        notes.append(f"{where}: {words}")
    for k, row in zip(columns, rows, strict=True):
        if after > 0 and abs(row[-1]) > 1e-3 * np.abs(row).max():
            notes.append(f"{where}: {model.inputs[k]} ends at {row[-1]:.4g} and is zero from the next sample on")
    step = float(t[1] - t[0]) / model.units.time
    out = with_von_mises(model, histories(model, values, step, columns))
    factor, share = uncertainty.largest
    largest = np.abs(out).max(axis=1)
    for scale in (1 - share, 1 + share) if share else ():
        shifted = with_von_mises(model, histories(model.with_frequencies(scale), values, step, columns))
        largest = np.maximum(largest, np.abs(shifted).max(axis=1))
    left = [left_over(values[j], step) if model.rates[k] == 2 else (math.nan, math.nan) for j, k in enumerate(columns)]
    outputs = scalar_outputs(model)
    request = test.spectra
    low = min(10.0, float(f[0]) / 10) if request.first is None else request.first
    high = min(1e4, 2 * float(f[-1])) if request.last is None else request.last
    if not low < high:
        raise ModelError(
            f"{where}: spectra: first, last: expected increasing frequencies, got {low:g} and {high:g} Hz; give both"
        )
    frequencies = octave_frequencies(low, high, request.per_octave)
    signals = {model.inputs[k]: values[j] for j, k in enumerate(columns) if model.rates[k] == 2}
    signals |= {o.name: out[i] for i, o in enumerate(outputs) if o.kind == "acceleration"}
    seconds = float(t[1] - t[0])
    spectra = {
        name: {float(Q): shock_response_spectrum(signal, seconds, frequencies, Q, request.kind) for Q in request.Q}
        for name, signal in signals.items()
        if np.abs(signal).max() > 1e-9 * max(np.abs(s).max() for s in signals.values())
    }
    return TimeRun(
        test=test.name,
        kind=test.kind,
        direction=" and ".join(model.inputs[k] for k in columns),
        outputs=outputs,
        t=t,
        inputs=tuple(model.inputs[k] for k in columns),
        input_values=values,
        values=out,
        uncertain=factor * largest,
        velocity_left=np.array([v for v, _ in left]),
        displacement_left=np.array([d for _, d in left]),
        spectra_frequencies=frequencies,
        spectra=spectra,
        spectra_kind=request.kind,
        words=test.words,
        synthesis=test.synthesis,
        notes=tuple(notes),
    )


def sampled(given: Array, values: Array, h: float, after: float) -> tuple[Array, Array, str]:
    """Return equal time steps of at most h, the values there, and a note if the times were changed, otherwise "".

    (1) If times are multiples of a step, exactly or rounded to their last digit, this step is divided.
    (2) Otherwise, steps are half the shortest given step. The values are the least-squares fit to the given linear
        pieces, which preserves areas and first moments and does not alias content faster than the steps.

    After the last given time the values are zero, from the next step on.

    Parameters
    ----------
    given
        Increasing times from 0, (n,).
    values
        Values at these times, (n_act, n), linear between them.
    """
    words = ""
    if (equal := equal_steps(given)) is not None:  # (1)
        step, counts, miss = equal
        if miss > ON_GRID * step:
            words = f"times deviate by up to {miss:.2g} s from equal steps of {step:.6g} s; taken as equal steps"
        step, places = step / math.ceil(step / h * (1 - ON_GRID)), step * counts
        n = round(places[-1] / step)
    else:  # (2)
        places = given
        room = MOST_SAMPLES * given[-1] / (given[-1] + after)
        n = math.ceil(given[-1] / min(h, max(float(np.diff(given).min()) / 2, given[-1] / room)))
        step = given[-1] / n
        words = f"unequal times were resampled every {step:.4g} s; areas under the linear pieces are preserved"
    t = np.arange(n + math.ceil(after / step) + 1) * step
    found = np.zeros((len(values), len(t)))
    for row, new in zip(values, found, strict=True):
        if equal is not None:
            new[: n + 1] = np.interp(t[: n + 1], places, row)
            continue
        new[: n + 1] = nearest_straight(places, row, t[: n + 1])
        if abs(np.abs(new).max() - np.abs(row).max()) > LOST * np.abs(row).max():
            words += f"; the largest {np.abs(row).max():.4g} became {np.abs(new).max():.4g}"
    return t, found, words


def equal_steps(given: Array) -> tuple[float, Array, float] | None:
    """Return the step of equally spaced times, the multiples, and the largest deviation; None if there is no such step.

    Deviations up to `ON_GRID` of a step, or up to the rounding of the last digit of the times, are accepted.
    """
    distances = np.diff(given)
    least = float(distances.min())
    counts = np.round(given / least)
    if np.abs(given / least - counts).max() < ON_GRID:
        return least, counts, 0.0
    counts = np.concatenate([[0], np.cumsum(np.round(distances / np.median(distances)))])
    step = float(counts @ given / (counts @ counts)) if counts.any() else 0.0
    miss = float(np.abs(given - counts * step).max())
    digit = next((10.0**-d for d in range(13) if np.abs(given * 10**d - np.round(given * 10**d)).max() < 1e-3), 0.0)
    is_rounding = (np.diff(counts) > 0).all() and miss <= digit and digit < COARSE_DIGIT * step
    return (step, counts, miss) if is_rounding else None


def nearest_straight(places: Array, values: Array, t: Array) -> Array:
    """Return the least-squares fit, linear between equal times t, to values linear between `places`, (n_t,).

    It solves M v = b. With hat functions N_k on t, M_kl is the integral of N_k N_l, and b_k is the integral of N_k
    times the given pieces. Simpson's rule between all times of both grids is exact, because the product is a parabola.
    """
    step, n = float(t[1]), len(t)
    ends = np.union1d(places, t)
    ends = ends[np.concatenate([[True], np.diff(ends) > ON_GRID * 1e-3 * step])]
    a, c = ends[:-1], ends[1:]
    left = np.minimum(np.searchsorted(t, (a + c) / 2) - 1, n - 2)
    b = np.zeros(n)
    for at, weight in ((a, 1.0), ((a + c) / 2, 4.0), (c, 1.0)):
        part = (c - a) / 6 * weight * np.interp(at, places, values)
        share = (at - t[left]) / step
        b += np.bincount(left, part * (1 - share), n) + np.bincount(left + 1, part * share, n)
    bands = np.zeros((2, n))
    bands[0, 1:], bands[1] = step / 6, 2 * step / 3
    bands[1, [0, -1]] = step / 3
    return np.asarray(la.solveh_banded(bands, b))


def model_factor(model: ShakenModel, k: int) -> float:
    """Return the factor from SI units of an input to units of the model."""
    units, direction = model.units, model.inputs[k].rpartition(":")[2]
    turns = direction.startswith("r")
    if model.rates[k] == 2:
        return 1 / units.to_si(time=-2) if turns else 1 / units.to_si(length=1, time=-2)
    if model.inputs[k].startswith("load case "):
        return 1.0
    return 1 / units.to_si(mass=1, length=2 if turns else 1, time=-2)


def with_von_mises(model: ShakenModel, values: Array) -> Array:
    """Return the outputs, followed by the von Mises stress of each place, (n_out, n_t)."""
    extra = []
    for rows in stress_groups(model):
        s = values[rows]
        extra.append(np.sqrt(np.maximum(np.einsum("at,ab,bt->t", s, VON_MISES, s, optimize=True), 0.0))[None])
    return np.concatenate([values, *extra])


def left_over(values: Array, step: float) -> tuple[float, float]:
    """Return the velocity and displacement of a base at the end of its acceleration."""
    motion = base_motions(values, step)
    return float(motion.rate[-1]), float(motion.value[-1])
