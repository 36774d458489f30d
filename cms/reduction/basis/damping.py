"""Damping of the modes of a reduced body: ratios by mode or by frequency, or Rayleigh damping.

A ratio zeta gives D_kk = 2 zeta omega_k M_kk, where omega_k is the frequency of mode k in the given body frame. In a
nodal frame the nodes of the frame are fixed; in the mean-axis frame the frequencies are free-free. Equal ratios in two
frames therefore give different damping.
"""

import ast
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.errors import ModeSetError
from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import checked_fields
from fe_models.foundation.units import UNIT_SYSTEMS

__all__ = [
    "CUSTOMARY_STEPS",
    "HEAVY",
    "Damping",
    "ModalDamping",
    "PerModeDamping",
    "RampDamping",
    "RayleighDamping",
    "damping_of_words",
    "for_readers",
    "heavy_words",
    "modal_damping",
    "provenance_for_readers",
    "stated_damping",
    "statement_of",
]

HEAVY = 0.2  #: damping ratio above which the user must confirm it: 0.5 may be a mistake for 0.5 %
#: (upper frequency [Hz], ratio): 1 % below 100 Hz, 10 % below 1 kHz, critical above
CUSTOMARY_STEPS = ((100.0, 0.01), (1000.0, 0.1))


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class ModalDamping:
    """Modal damping with the same ratio for every mode: D = diag(2 ratio omega).

    Parameters
    ----------
    ratio
        Ratio to critical damping, 0 to 1.
    heavy
        Whether a ratio above 0.2 is meant; without it such a ratio is refused.
    """

    ratio: float
    heavy: bool = field(default=False, kw_only=True, repr=False, compare=False)

    def __post_init__(self) -> None:
        _require_ratios("ratio", (self.ratio,), heavy=self.heavy)


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class PerModeDamping:
    """A damping ratio for each mode in the order of the reduced body; the last ratio holds for all further modes.

    Parameters
    ----------
    ratios
        Ratios to critical damping, 0 to 1.
    heavy
        Whether ratios above 0.2 are meant; without it such ratios are refused.
    """

    ratios: tuple[float, ...]
    heavy: bool = field(default=False, kw_only=True, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "ratios", tuple(float(ratio) for ratio in self.ratios))
        if not self.ratios:
            raise ModeSetError("damping: ratios: expected at least one, got none")
        _require_ratios("ratios", self.ratios, heavy=self.heavy)


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class RampDamping:
    """Damping ratios in steps of frequency. The default is customary: modes above the band of interest are suppressed.

    Each mode has the ratio of the first step whose frequency is above its own.

    Parameters
    ----------
    steps
        Pairs (frequency [Hz], ratio below it), by ascending frequency.
    above
        Ratio at and above the last frequency, 0 to 1.
    heavy
        Whether steps with a ratio above 0.2 are meant; without it they are refused. `above` needs no confirmation.
    """

    steps: tuple[tuple[float, float], ...] = CUSTOMARY_STEPS
    above: float = 1.0
    heavy: bool = field(default=False, kw_only=True, repr=False, compare=False)

    def __post_init__(self) -> None:
        steps = tuple((float(frequency), float(ratio)) for frequency, ratio in self.steps)
        object.__setattr__(self, "steps", steps)
        frequencies = [frequency for frequency, _ in steps]
        if not steps or not all(0 < f < np.inf for f in frequencies) or sorted(set(frequencies)) != frequencies:
            raise ModeSetError(f"damping: steps: expected pairs (frequency in Hz, ratio), ascending, got {self.steps}")
        _require_ratios("steps", tuple(ratio for _, ratio in steps), heavy=self.heavy)
        _require_ratios("above", (self.above,), heavy=True)


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class RayleighDamping:
    """Rayleigh damping, D = alpha M + beta K.

    Parameters
    ----------
    alpha
        Factor on the mass [1/time unit of the body].
    beta
        Factor on the stiffness [time unit of the body].
    """

    alpha: float = 0.0
    beta: float = 0.0

    def __post_init__(self) -> None:
        if not (0 <= self.alpha < np.inf and 0 <= self.beta < np.inf):
            raise ModeSetError(f"damping: alpha = {self.alpha}, beta = {self.beta}; expected 0 or more")


Damping = ModalDamping | PerModeDamping | RampDamping | RayleighDamping


def damping_of_words(words: str) -> Damping | None:
    """Return the damping whose `repr` is this text, as in the provenance; None for "none" and unknown texts."""
    known = {kind.__name__: kind for kind in (ModalDamping, PerModeDamping, RampDamping, RayleighDamping)}
    try:
        call = ast.parse(words, mode="eval").body
        if not isinstance(call, ast.Call) or not isinstance(call.func, ast.Name):
            return None
        values = {str(each.arg): ast.literal_eval(each.value) for each in call.keywords}
        confirmed = {} if call.func.id == "RayleighDamping" else {"heavy": True}
        kind: Any = known[call.func.id]
        made: Damping = kind(**values, **confirmed)
    except (SyntaxError, KeyError, TypeError, ValueError):
        return None
    return made


def for_readers(words: str) -> str:
    """Return a sentence for the text of a damping in the provenance; an unknown text is returned as it is."""
    match damping_of_words(words):
        case ModalDamping(ratio):
            return f"{percent(ratio)} of critical in every mode"
        case PerModeDamping((ratio,)):
            return f"{percent(ratio)} of critical in every mode"
        case PerModeDamping(ratios):
            return f"{', '.join(percent(each) for each in ratios)} of critical by mode, the last for all further modes"
        case RampDamping(steps, above):
            below = ", ".join(f"{percent(ratio)} below {frequency:g} Hz" for frequency, ratio in steps)
            return f"{below}, {percent(above)} above, of critical"
        case RayleighDamping(alpha, beta):
            return f"alpha M + beta K with alpha = {alpha:g}, beta = {beta:g}"
    return words


def provenance_for_readers(provenance: Mapping[str, str]) -> dict[str, str]:
    """Return a provenance whose damping is a sentence."""
    return {key: for_readers(words) if key == "damping" else words for key, words in provenance.items()}


def percent(ratio: float) -> str:
    """Return a ratio as percentage."""
    return f"{100 * ratio:.4g} %"


def stated_damping(body: ReducedBody) -> Damping | None:
    """Return the damping that the provenance of a body states, in the units of the body; None: none, or unknown text.

    The text stays as it is when units are converted.
    """
    damping = damping_of_words(body.provenance.get("damping", "none"))
    return None if damping is None else in_time_unit(damping, body.units.time / time_of_texts(body))


def statement_of(damping: Damping, body: ReducedBody) -> str:
    """Return the text of a damping in the units of the body for its provenance, see `stated_damping`."""
    return str(in_time_unit(damping, time_of_texts(body) / body.units.time))


def time_of_texts(body: ReducedBody) -> float:
    """Return the time unit of the texts in the provenance [s]: the one before conversions of units."""
    return UNIT_SYSTEMS.get(body.provenance.get("units converted from", ""), body.units).time


def in_time_unit(damping: Damping, ratio: float) -> Damping:
    """Return the damping with numbers for a time unit that is larger by a ratio."""
    if not isinstance(damping, RayleighDamping) or ratio == 1:
        return damping
    return RayleighDamping(damping.alpha * ratio, damping.beta / ratio)


def modal_damping(damping: Damping, M: Array, K: Array, *, second: float = 1.0) -> Array:
    """Return the damping matrix for diagonal M and K, (n_q, n_q) [1/s]; damping ratios do not damp massless shapes.

    Parameters
    ----------
    damping
        Kind of damping.
    M, K
        Modal mass and stiffness, diagonal, (n_q, n_q) [1] and [1/s²].
    second
        Time unit of K in seconds; needed because the steps of a ramp are in Hz.
    """
    mass, stiffness = np.diag(M), np.maximum(np.diag(K), 0.0)
    if isinstance(damping, RayleighDamping):
        return np.diag(damping.alpha * mass + damping.beta * stiffness)
    return np.diag(2 * damping_ratios(damping, mass, stiffness, second) * np.sqrt(stiffness * mass))


def damping_ratios(
    damping: ModalDamping | PerModeDamping | RampDamping, mass: Array, stiffness: Array, second: float
) -> Array:
    """Return the ratio of each mode, (n_q,)."""
    n_q = len(mass)
    if isinstance(damping, ModalDamping):
        return np.full(n_q, damping.ratio)
    if isinstance(damping, PerModeDamping):
        if len(damping.ratios) > n_q:
            raise ModeSetError(f"damping: {len(damping.ratios)} ratios, but only {n_q} modes; leave the last ones out")
        return np.array([damping.ratios[min(k, len(damping.ratios) - 1)] for k in range(n_q)])
    hertz = np.sqrt(np.divide(stiffness, mass, out=np.full(n_q, np.inf), where=mass > 0)) / (2 * np.pi * second)
    limits = np.array([frequency for frequency, _ in damping.steps])
    ratios = np.array([*(ratio for _, ratio in damping.steps), damping.above])
    return ratios[np.searchsorted(limits, hertz, side="right")]


def _require_ratios(key: str, ratios: tuple[float, ...], *, heavy: bool) -> None:
    for ratio in ratios:
        if not 0 <= ratio <= 1:
            raise ModeSetError(
                f"damping: {key} = {ratio}; expected 0 to 1 (0.01 is 1 % of critical damping, 1 is critical)"
            )
        if ratio > HEAVY and not heavy:
            raise ModeSetError(f"damping: {key} = {ratio}: {heavy_words(ratio)}")


def heavy_words(ratio: float) -> str:
    """Return the description of a damping ratio above `HEAVY` that the user has not confirmed."""
    return (
        f"this is {100 * ratio:g} % of critical damping; expected at most {HEAVY}. If it is meant, confirm it by "
        f"heavy = true in the table [damping] (heavy=True in Python, --heavy of a command); if {ratio:g} % is "
        f"meant, write {ratio / 100:g}"
    )
