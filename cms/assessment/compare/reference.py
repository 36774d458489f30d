"""Request of a comparison to the full model, its solution, and the file that stores the solution."""

import hashlib
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cms.assessment.compare.comparison import FullResults
from cms.assessment.compare.evaluation import SharedReference, drawn_entry
from cms.assessment.compare.full_model import (
    ReferenceSolution,
    read_full_model,
    reference_digest,
    solve_full_model,
    write_full_model,
)
from cms.assessment.compare.pulse import Pulse
from cms.assessment.quality.of_reduction.frf import frequency_grid
from cms.assessment.quality.reference.full_reference import static_labels
from cms.assessment.quality.reference.port_model import modal_response
from cms.assessment.quality.reference.transient import Snapshots
from cms.errors import CompareError
from cms.modes.families.families import Families
from cms.reduction.error_estimates import LOWEST

__all__ = ["Question", "Solution", "full_results", "reference_of", "solution"]

POINTS = 800  #: number of frequencies in the response; enough for smooth peaks


@dataclass(frozen=True, eq=False)
class Question:
    """Request to the full model."""

    pulse: Pulse  #: pulse of the default motion
    damping: float  #: damping ratio of every mode in response and motion
    band: float | None = None  #: highest frequency [Hz]; None: the frequency of mode n_reference
    n_reference: int = 10  #: number of elastic free modes in the band if no band is given
    motion: Snapshots | None = None  #: reference motion; None: the response to the pulse

    def __post_init__(self) -> None:
        if self.band is not None and not (np.isfinite(self.band) and self.band > 0):
            raise CompareError(f"band: expected a frequency above 0 Hz, got {self.band:g}")
        if self.n_reference < 1:
            raise CompareError(f"reference modes: expected 1 or more, got {self.n_reference}")
        if not 0 < self.damping < 1:
            raise CompareError(f"damping: expected a ratio between 0 and 1 (0.02 is 2 %), got {self.damping:g}")

    @property
    def key(self) -> str:
        """Identification of this request."""
        motion = hashlib.sha256()
        if self.motion is not None:
            for part in (self.motion.columns, self.motion.amplitudes, self.motion.t):
                motion.update(np.ascontiguousarray(part).data)
        return repr((self.pulse.at, self.damping, self.band, self.n_reference, motion.hexdigest()))


@dataclass(frozen=True, eq=False)
class Solution:
    """Solution of the full model, and whether it was computed or read."""

    full: ReferenceSolution
    was_cached: bool
    digest: str


def solution(families: Families, question: Question, *, n_expected: int = 0, cache: Path | None = None) -> Solution:
    """Return the solution of the full model, from the file of an earlier comparison if its request was the same.

    Parameters
    ----------
    n_expected
        Number of free modes that the mode sets will need.
    cache
        File of the solution; None: no file is read or written.
    """
    body = families.body
    digest = reference_digest(body, question.key)
    found = None if cache is None else read_full_model(cache, digest)
    if found is not None:
        return Solution(found, True, digest)
    full = solve_full_model(
        families, question.pulse, n_modes=question.n_reference, damping=question.damping, motion=question.motion,
        band=None if question.band is None else question.band * body.units.time, n_expected=n_expected,
    )  # fmt: skip
    if cache is not None:
        write_full_model(cache, full, digest)
    return Solution(full, False, digest)


def reference_of(families: Families, full: ReferenceSolution, damping: float) -> SharedReference:
    """Return the reference data for the assessment of all sets."""
    body = families.body
    time_ = body.units.time
    names = tuple(interface.name for interface in body.interfaces)
    grid = frequency_grid(LOWEST * float(full.frequencies[0]) / time_, full.band / time_, POINTS)
    response = modal_response(full.ports(names), grid, damping=damping, time=time_)
    return SharedReference(
        full=full,
        response=response,
        drawn=drawn_entry(response),
        damping=damping,
        port_names=names,
        static_labels=static_labels(families),
        length=body.length,
        time=time_,
    )


def full_results(reference: SharedReference, question: Question, solved: Solution) -> FullResults:
    """Return the data of the full model for reports."""
    full, response, time_ = solved.full, reference.response, reference.time
    out, into = reference.drawn
    pulse, is_default = question.pulse, question.motion is None
    words = f"{pulse.words}, {1e3 * pulse.duration(full.band) * time_:.3g} ms long" if is_default else "a given motion"
    return FullResults(
        frequencies_hz=full.frequencies / time_,
        n_band=full.n_band,
        band_hz=full.band / time_,
        response_hz=response.frequencies,
        response=np.abs(response.H[:, out, into]),
        response_words=f"force at {place(response.inputs[into])}, displacement at {place(response.outputs[out])}",
        response_error=full.port_error,
        damping=question.damping,
        t=full.t * time_,
        force=pulse.force(full.t, full.band) if is_default else None,
        motion_words=words,
        mass=full.mass,
        held_mass=full.held_mass,
        was_cached=solved.was_cached,
        digest=solved.digest,
    )


def place(label: str) -> str:
    """Return 'small_end along z', given 'small_end uz'."""
    name, component = label.rsplit(" ", 1)
    return f"{name} {'about' if component.startswith('r') else 'along'} {component[-1]}"
