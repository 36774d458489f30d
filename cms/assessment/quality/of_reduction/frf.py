"""Error of the frequency response at the interfaces over a band."""

from dataclasses import dataclass

import numpy as np

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.record import QualityRecord, judge
from cms.assessment.quality.reference.full_reference import FullReference
from cms.assessment.quality.reference.port_model import FrequencyResponse, PortModel, modal_response
from cms.reduction.basis.free_basis import FreeBasis
from cms.reduction.error_estimates import DAMPING, LOWEST
from fe_models.foundation.arrays import Array, frozen

__all__ = [
    "ResponseComparison",
    "basis_ports",
    "compare_responses",
    "frequency_grid",
    "peaks",
    "resonance_grid",
    "response_comparison",
    "response_record",
]

MOST_POINTS = 1_000_000  #: largest number of frequencies of a response
POINTS = 400
#: distances of added points from a resonance, in half bandwidths
AROUND = np.array([0.0, 0.1, 0.25, 0.5, 0.75, 1.0, 1.5, 2.0, 3.0, 5.0, 8.0, 12.0])
UNDAMPED = 1e-4  #: relative frequency distance of points around an undamped resonance, whose peak is infinite


@dataclass(frozen=True, eq=False)
class ResponseComparison:
    """Responses of full model and reduced body with the same damping, compared."""

    full: FrequencyResponse
    reduced: FrequencyResponse
    error: Array  #: |H_reduced - H_full| / |H_full| at every frequency, Frobenius norm, (n_f,)
    reference_error: float  #: estimated relative error of the full response

    def __post_init__(self) -> None:
        object.__setattr__(self, "error", frozen(self.error))

    @property
    def mean_error(self) -> float:
        """Root mean square of the error over logarithmic frequency."""
        f = np.log(self.full.frequencies)
        if len(f) == 1:
            return float(self.error[0])
        return float(np.sqrt(np.trapezoid(self.error**2, f) / (f[-1] - f[0])))


def frequency_grid(lowest: float, highest: float, points: int = POINTS) -> Array:
    """Return frequencies that are evenly spaced on a logarithmic scale, (points,) [Hz].

    Raises
    ------
    QualityError
        Unless 0 < lowest < highest and there are two points or more.
    """
    if not (0 < lowest < highest < np.inf):
        raise QualityError(f"band {lowest:g}:{highest:g}: expected 0 < lowest < highest [Hz]")
    if not 2 <= points <= MOST_POINTS:
        raise QualityError(f"band {lowest:g}:{highest:g}: expected 2 to {MOST_POINTS} frequencies, got {points:g}")
    return np.geomspace(lowest, highest, points)


def resonance_grid(grid: Array, resonances: Array, ratios: Array) -> Array:
    """Add points around resonances to a grid, so that peaks have their full height at any damping, (n_f,) [Hz].

    A peak is at f_k sqrt(1 - 2 zeta²) with half bandwidth zeta f_k. Points are added at the distances `AROUND`, in half
    bandwidths, on both sides of the peak. The peak itself is omitted if the resonance is undamped.

    Parameters
    ----------
    grid
        Ascending frequencies, (n,) [Hz].
    resonances
        Natural frequencies f_k, (n_modes,) [Hz].
    ratios
        Damping ratios zeta_k, none negative, (n_modes,) [-].
    """
    in_band = (resonances > grid[0] / 2) & (resonances < 2 * grid[-1]) & (ratios < np.sqrt(0.5))
    f, zeta = resonances[in_band], ratios[in_band]
    has_peak = zeta > 0
    peak = f * np.sqrt(1 - 2 * zeta**2)
    width = f * np.where(has_peak, zeta, UNDAMPED)
    offsets = np.concatenate([-AROUND[:0:-1], AROUND])
    points = peak[:, None] + width[:, None] * offsets
    points = points[has_peak[:, None] | (offsets != 0)]
    return np.unique(np.concatenate([grid, points[(points > grid[0]) & (points < grid[-1])]]))


def basis_ports(reference: FullReference, basis: FreeBasis) -> PortModel:
    """Return the free modes of a mode set at the ports."""
    A = reference.ports.A
    return PortModel(reference.ports.names, basis.omega2, basis.is_massive, A @ basis.Phi, A @ basis.N)


def compare_responses(full: FrequencyResponse, reduced: FrequencyResponse, length: float) -> Array:
    """Return the relative error at each frequency, (n_f,), in the Frobenius norm.

    Rotations are multiplied by the length, and moments divided by it.
    """
    out, into = (
        np.array([length if label.rsplit(" ", 1)[1].startswith("r") else 1.0 for label in labels])
        for labels in (full.outputs, full.inputs)
    )
    scale = np.outer(out, into)
    size = np.linalg.norm(full.H * scale, axis=(1, 2))
    return np.asarray(np.linalg.norm((reduced.H - full.H) * scale, axis=(1, 2)) / np.where(size > 0, size, 1.0))


def response_comparison(
    reference: FullReference, model: PortModel, *, frequencies: Array | None = None
) -> ResponseComparison:
    """Compare responses at all interfaces, from well below the first elastic mode to the top of the band.

    Parameters
    ----------
    model
        The reduced body at its ports: `basis_ports` of a mode set, `port_model` of a file.
    frequencies
        Frequencies up to the band of the reference, (n_f,) [Hz]; None: the default grid.

    Raises
    ------
    QualityError
        If a frequency lies above the band, or the interfaces are not those of the model.
    """
    body = reference.body
    if model.names != reference.ports.names:
        raise QualityError(
            f"body {body.name!r}: the reduced body has the interfaces {', '.join(model.names)}, the full model "
            f"{', '.join(reference.ports.names)}; check with the job from which the file was made"
        )
    if frequencies is None:
        frequencies = frequency_grid(LOWEST * float(reference.frequencies[0]), reference.band)
    if np.max(frequencies) > reference.band * (1 + 1e-9):
        raise QualityError(
            f"body {body.name!r}: frequencies up to {np.max(frequencies):.5g} Hz, but the full model is known to "
            f"{reference.band:.5g} Hz; make the reference for a wider band"
        )
    known = reference.response
    time = body.units.time
    full = modal_response(known.model, frequencies, damping=DAMPING, time=time)
    reduced = modal_response(model, frequencies, damping=DAMPING, time=time)
    return ResponseComparison(full, reduced, compare_responses(full, reduced, body.length), known.error)


def peaks(frequencies: Array, magnitude: Array) -> list[tuple[float, float]]:
    """Return (frequency, magnitude) of the local maxima of a response, most prominent first."""
    from scipy.signal import find_peaks

    at, found = find_peaks(np.log(np.maximum(magnitude, np.finfo(float).tiny)), prominence=0.05)
    order = np.argsort(-found["prominences"])
    return [(float(frequencies[k]), float(magnitude[k])) for k in at[order]]


def response_record(comparison: ResponseComparison) -> QualityRecord:
    """Return the record "frequency-response"; its value is the mean over the band, its text names the largest error."""
    f, error = comparison.full.frequencies, comparison.error
    k = int(np.argmax(error))
    good = np.flatnonzero(error > 0.05)
    up_to = f[-1] if not len(good) else f[max(good[0] - 1, 0)]
    reason = (
        f"mean {100 * comparison.mean_error:.3g} % from {f[0]:.4g} to {f[-1]:.4g} Hz, largest {100 * error[k]:.3g} % "
        f"at {f[k]:.5g} Hz, below 5 % up to {up_to:.5g} Hz; {comparison.full.damping}"
    )
    data = {
        "frequencies_hz": f,
        "error": error,
        "full": np.linalg.norm(comparison.full.H, axis=(1, 2)),
        "reduced": np.linalg.norm(comparison.reduced.H, axis=(1, 2)),
        "largest": float(error[k]),
        "largest_at_hz": float(f[k]),
        "good_up_to_hz": float(up_to),
        "reference_error": comparison.reference_error,
    }
    return judge("frequency-response", comparison.mean_error, reason, data)
