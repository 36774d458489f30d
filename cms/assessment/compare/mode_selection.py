"""Automatic selection: the fewest modes with which a set meets a stated error over a stated band."""

import inspect
from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from types import MappingProxyType
from typing import Any, Protocol

import numpy as np

from cms.assessment.compare.coordinates import ReferenceBasis
from cms.assessment.compare.free_shapes import judged_subset
from cms.assessment.compare.subsets import SUBSETS
from cms.assessment.quality.of_reduction.frf import compare_responses, frequency_grid
from cms.assessment.quality.reference.full_reference import FullReference
from cms.assessment.quality.reference.port_model import PortModel, modal_response
from cms.body.error_estimates import are_uncertain
from cms.errors import ModeSetError
from cms.modes.families.families import Families, families_of
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.basis.free_basis import FreeBasis, free_basis
from cms.reduction.error_estimates import DAMPING, LOWEST, frequency_errors
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.tall.columns import in_memory
from fe_models.foundation.words import nearest, quoted

__all__ = ["ESTIMATE", "MEASURES", "Selection", "Trial", "select_modes"]

FEWEST = 8  #: number of modes of the first set that is computed
MOST = 300  #: default number of modes above which the search fails
ESTIMATE = "estimate"  #: the measure that needs no solution of the full model
SAFETY = 2.0  #: allowed ratio of a true error to its estimate, which is at most the true error


@dataclass(frozen=True)
class Trial:
    """Result of a set with one number of modes."""

    n_modes: int
    n_columns: int  #: number of columns of the mode set, including static columns
    error: float  #: error in the chosen measure; inf if a mode of the band is missing, or the set could not be computed
    where: str  #: place of the largest error, for messages


@presented
@dataclass(frozen=True, eq=False)
class Selection:
    """Chosen mode set and the reason for the choice."""

    modes: ModeSet
    n_modes: int
    error: float  #: error with the chosen number of modes
    history: tuple[Trial, ...]  #: results for all numbers of modes that were tried, ascending
    sentence: str  #: the choice and its reason in words
    options: Mapping[str, str] = field(default_factory=dict)  #: options that the caller gave

    def __post_init__(self) -> None:
        object.__setattr__(self, "options", MappingProxyType(dict(self.options)))


def select_modes(
    body: FEBody | Families,
    *,
    set: str = "craig-bampton",
    error: float,
    band: tuple[float, float],
    measure: str = "frequency",
    options: Mapping[str, Any] | None = None,
    added: Callable[[ModeSet], ModeSet] | None = None,
    most: int = MOST,
) -> Selection:
    """Find the fewest modes with which a set meets an error over a band.

    (1) solve the full model once: free modes of the band, and its response at the interfaces if the measure is "frf"
    (2) if smaller sets are columns of larger ones: compute the set once with many modes, and assess its subspaces with
        0, 1, 2, … modes in small coordinates until one meets the error; if none does, repeat with twice as many modes
    (3) for other sets: try 0, 1, 2, 4, … modes until one meets the error, then find the fewest by bisection
    (4) with the measure "estimate", in place of all this: count the exact modes of the band by the inertia of
        K - sigma M; try 8, 16, 32, … modes until as many frequencies have small estimated errors and lie in the band,
        so that the set lacks none; then find the fewest by bisection

    Parameters
    ----------
    body
        A coupled body with at least one interface, or its `Families`.
    set
        Name in `MODE_SETS` of a set with a number of modes.
    error
        Largest accepted error, such as 1e-3.
    band
        Frequencies (from, to) [Hz].
    measure
        "frequency": largest relative error of the elastic free-free frequencies in the band.
        "frf": root mean square, over the logarithm of frequency, of the relative error of the receptance of all
        interfaces, 1 % modal damping (`cms.assessment.quality.of_reduction.frf`).
        "estimate": twice the estimated error of these frequencies (`cms.reduction.error_estimates`), the largest error
        of uncertain ones, with a count of the exact modes, without a solution of the full model.
    options
        Options of the set other than the number of modes.
    added
        Function that is applied to the set before the assessment, such as `with_load_cases`.
    most
        Largest number of modes; the search fails beyond it.

    Raises
    ------
    ModeSetError
        If numbers or names are wrong, the band holds no mode, or no number of modes meets the error. In the last case
        the message contains the best result.
    """
    _check(set, error, band)
    if measure not in (*MEASURES, ESTIMATE):
        raise ModeSetError(f"select_modes: unknown measure {quoted(measure)}{nearest(measure, [*MEASURES, ESTIMATE])}")
    options = dict(options or {})
    with ExitStack() as stack:
        families = stack.enter_context(families_of(body))
        make = _Maker(set, families, options, added, most)
        if measure == ESTIMATE:
            words, trials = "an estimated error of the free frequencies", _by_estimate(make, band, error)
        else:
            reference = stack.enter_context(FullReference(families, band=band[1]))
            judge = MEASURES[measure](reference, band)
            search = _by_subspaces if set in SUBSETS and added is None else _by_recomputation
            words, trials = judge.words, search(make, judge, reference, error)
        tried = {trial.n_modes: trial for trial in trials}
        history = tuple(tried[n] for n in sorted(tried))
        met = [trial for trial in history if trial.error <= error]
        if not met:
            best = min(history, key=lambda trial: trial.error)
            raise ModeSetError(
                f"select_modes: mode set {set!r} does not meet {words} of {error:g} from {band[0]:g} to "
                f"{band[1]:g} Hz with up to {history[-1].n_modes} modes; the best was {best.error:.3g} with "
                f"{best.n_modes}, {best.where}; accept a larger error, or take another set or a lower band"
            )
        chosen = met[0]
        sentence = _sentence(set, chosen, tried.get(chosen.n_modes - 1), words, error, band)
        asked = {"selected": sentence, "error": f"{error:g}", "band": f"{band[0]:g} to {band[1]:g} Hz"}
        modes = make(chosen.n_modes)
        return Selection(
            replace(modes, options={**modes.options, **asked}), chosen.n_modes, chosen.error, history, sentence, asked
        )


class _Judge(Protocol):
    """Error measure of mode sets, prepared for one body and one band."""

    words: str  #: description of the measure

    def __call__(self, basis: FreeBasis, at_ports: Array) -> tuple[float, str]:
        """Return the error of the free-free modes of a set, and the place of the largest error."""


class _FrequencyError:
    words = "a frequency error"

    def __init__(self, reference: FullReference, band: tuple[float, float]) -> None:
        full = np.asarray(reference.frequencies)
        self.full, self.time = full, reference.body.units.time
        self.index = np.flatnonzero((full >= band[0]) & (full <= band[1]))
        if not len(self.index):
            raise ModeSetError(
                f"select_modes: no elastic free mode of body {reference.body.name!r} lies from {band[0]:g} to "
                f"{band[1]:g} Hz; the first is at {full[0]:.6g} Hz; widen the band, or measure the frf"
            )

    def __call__(self, basis: FreeBasis, at_ports: Array) -> tuple[float, str]:
        found = basis.frequencies(self.time)
        if len(found) <= self.index[-1]:
            return np.inf, f"has {len(found)} elastic modes, the band holds mode {self.index[-1] + 1}"
        errors = np.abs(found[self.index] / self.full[self.index] - 1)
        k = self.index[int(np.argmax(errors))]
        return float(errors.max()), f"largest at free mode {k + 1}, {self.full[k]:.5g} Hz"


class _ResponseError:
    words = "a frequency response error"

    def __init__(self, reference: FullReference, band: tuple[float, float]) -> None:
        body = reference.body
        self.time, self.length, self.names = body.units.time, body.length, reference.ports.names
        low = band[0] or min(LOWEST * float(reference.frequencies[0]), band[1] / 2)
        self.grid = frequency_grid(low, band[1])
        self.full = modal_response(reference.response.model, self.grid, damping=DAMPING, time=self.time)

    def __call__(self, basis: FreeBasis, at_ports: Array) -> tuple[float, str]:
        model = PortModel(self.names, basis.omega2, basis.is_massive, at_ports @ basis.Phi, at_ports @ basis.N)
        reduced = modal_response(model, self.grid, damping=DAMPING, time=self.time)
        errors = compare_responses(self.full, reduced, self.length)
        f = np.log(self.grid)
        k = int(np.argmax(errors))
        mean = float(np.sqrt(np.trapezoid(errors**2, f) / (f[-1] - f[0])))
        return mean, f"largest {errors[k]:.3g} at {self.grid[k]:.5g} Hz"


MEASURES: dict[str, Callable[[FullReference, tuple[float, float]], _Judge]] = {
    "frequency": _FrequencyError,
    "frf": _ResponseError,
}


@dataclass(frozen=True, eq=False)
class _Maker:
    """Function that computes the set with a given number of modes."""

    name: str
    families: Families
    options: Mapping[str, Any]
    added: Callable[[ModeSet], ModeSet] | None
    most: int

    def __call__(self, n_modes: int) -> ModeSet:
        modes = MODE_SETS[self.name](self.families, n_modes=n_modes, **self.options)
        return modes if self.added is None else self.added(modes)

    @property
    def n_most(self) -> int:
        """Largest number of modes for which the set can be computed."""
        body = self.families.body
        return min(self.most, max(0, body.n_dof - len(body.b) - 1))


def _by_subspaces(make: _Maker, judge: _Judge, reference: FullReference, error: float) -> Iterator[Trial]:
    """Step (2): assess all numbers of modes, in ascending order, as subspaces of the largest set."""
    basis, n_r = _reference_basis(make, reference)
    n, first = min(make.n_most, max(FEWEST, 2 * reference.n_band)), 0
    while True:
        modes = make(n)
        c = basis.coordinates(in_memory(modes.columns))
        at_b = np.asarray(modes.columns[make.families.body.b])
        for k in range(first, n + 1):
            C, labels = SUBSETS[make.name](modes, at_b, k)
            try:
                subset = judged_subset(c, c.columns @ C, labels, c.reference[:, :n_r], basis.omega2)
            except ModeSetError as problem:  # the set of normal modes with no modes
                yield Trial(k, len(labels), np.inf, str(problem))
                continue
            found, where = judge(subset.basis, c.at_ports)
            yield Trial(k, len(labels), found, where)
            if found <= error:
                return
        if n >= make.n_most:
            return
        n, first = min(make.n_most, 2 * n), n + 1


def _by_recomputation(make: _Maker, judge: _Judge, reference: FullReference, error: float) -> Iterator[Trial]:
    """Step (3): recompute the set for each number of modes, and find the smallest by doubling and bisection."""
    basis, n_r = _reference_basis(make, reference)

    def tried(n: int) -> Trial:
        try:
            modes = make(n)
            c = basis.coordinates(in_memory(modes.columns))
            subset = judged_subset(c, c.columns, modes.labels, c.reference[:, :n_r], basis.omega2)
        except ModeSetError as problem:
            return Trial(n, 0, np.inf, str(problem))
        return Trial(n, len(modes.labels), *judge(subset.basis, c.at_ports))

    yield from _by_bisection(tried, 0, make.n_most, error)


def _by_estimate(make: _Maker, band: tuple[float, float], error: float) -> Iterator[Trial]:
    """Step (4): estimate the errors of the frequencies of each set, and find the smallest set.

    Raises
    ------
    ModeSetError
        If the band holds no mode.
    EigenError
        If the modes cannot be counted.
    """
    families, time = make.families, make.families.body.units.time
    n_band = families.free.count_below((2 * np.pi * band[1] * time) ** 2)
    if not n_band:
        raise ModeSetError(
            f"select_modes: no elastic free mode of body {families.body.name!r} lies below {band[1]:g} Hz; widen the "
            "band, or measure the frf"
        )

    def tried(n: int) -> Trial:
        try:
            modes = make(n)
            basis = free_basis(families.body, modes, families)
        except ModeSetError as problem:
            return Trial(n, 0, np.inf, str(problem))
        n_columns, found = len(modes.labels), basis.frequencies(time)
        if len(found) < n_band:
            return Trial(n, n_columns, np.inf, f"has {len(found)} elastic modes, the band holds mode {n_band}")
        judged = frequency_errors(families, basis, n_band, modes)
        if found[n_band - 1] / (1 + judged.frequency[-1]) > (1 + error) * band[1]:
            return Trial(n, n_columns, np.inf, f"lacks one of the {n_band} elastic modes of the band")
        uncertain, errors = np.flatnonzero(are_uncertain(judged.frequency, judged.largest)), SAFETY * judged.frequency
        errors[uncertain] = np.nan_to_num(judged.largest[uncertain], nan=np.inf)
        errors[found[:n_band] < band[0]] = 0.0
        k = int(np.argmax(errors))
        words = "its limit, because modes are close" if k in uncertain else "twice its estimate"
        where = (
            f"largest at free mode {k + 1}, {found[k]:.5g} Hz, and {words}; all {n_band} elastic modes up "
            f"to {band[1]:g} Hz are there, as counted"
        )
        return Trial(n, n_columns, float(errors[k]), where)

    yield from _by_bisection(tried, min(FEWEST, make.n_most), make.n_most, error)


def _by_bisection(tried: Callable[[int], Trial], first: int, n_most: int, error: float) -> Iterator[Trial]:
    """Yield the results of doubled numbers of modes until one meets the error, then those of a bisection."""
    low, high = -1, first
    while True:
        trial = tried(high)
        yield trial
        if trial.error <= error:
            break
        if high >= n_most:
            return
        low, high = high, min(n_most, max(1, 2 * high))
    while high - low > 1:
        middle = (low + high) // 2
        trial = tried(middle)
        yield trial
        low, high = (low, middle) if trial.error <= error else (middle, high)


def _reference_basis(make: _Maker, reference: FullReference) -> tuple[ReferenceBasis, int]:
    """Return coordinates of rigid-body and free modes in the small basis, and the number of rigid-body modes."""
    N = make.families.free.N
    columns, n_r = np.hstack([N, reference.modes.Phi]), N.shape[1]
    return ReferenceBasis(make.families, reference.ports, columns, n_r, float(reference.modes.omega2[0])), n_r


def _sentence(
    name: str, chosen: Trial, before: Trial | None, words: str, error: float, band: tuple[float, float]
) -> str:
    modes = "no vibration modes are" if chosen.n_modes == 0 else f"{chosen.n_modes} modes are the fewest"
    text = (
        f"{name}: {modes} needed for {words} of at most {error:g} from {band[0]:g} to {band[1]:g} Hz: "
        f"{chosen.error:.3g} with these {chosen.n_columns} columns, {chosen.where}"
    ).replace("fewest needed", "fewest")
    if before is not None:
        text += f"; {before.error:.3g} with one mode less"
    return text


def _check(name: str, error: float, band: tuple[float, float]) -> None:
    if name not in MODE_SETS:
        raise ModeSetError(f"select_modes: unknown mode set {quoted(name)}{nearest(name, MODE_SETS)}")
    if "n_modes" not in inspect.signature(MODE_SETS[name]).parameters:
        raise ModeSetError(f"select_modes: mode set {name!r} has no number of modes to choose")
    if not 0 < error < 1:
        raise ModeSetError(f"select_modes: error = {error}; expected a number between 0 and 1, such as 1e-3")
    if len(band) != 2 or not 0 <= band[0] < band[1] < np.inf:
        raise ModeSetError(f"select_modes: band = {tuple(band)}; expected two frequencies (from, to), 0 <= from < to")
