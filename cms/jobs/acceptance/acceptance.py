"""The acceptance of a reduced body: all information that is needed before it is approved."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from datetime import UTC, datetime
from typing import Any

import numpy as np

from cms.assessment.quality.body_record import body_record
from cms.assessment.quality.mesh_refinement import MeshRefinement
from cms.assessment.quality.of_body.effective_mass import EffectiveMass, mass_record
from cms.assessment.quality.record import QualityRecord, Verdict, plain, worst
from cms.body.reduced_body import ReducedBody
from cms.jobs.acceptance.origin import SourceFile, origin_groups
from cms.jobs.acceptance.range_of_use import RangeOfUse
from cms.jobs.studies.mesh_convergence import MeshConvergence

__all__ = ["VERDICT_WORDS", "Acceptance", "LeftOut", "MeshError"]

VERDICT_WORDS: Mapping[Verdict, str] = {
    "pass": "accepted",
    "warn": "accepted with reservations",
    "fail": "not accepted",
    "info": "nothing was judged",
}


@dataclass(frozen=True)
class LeftOut:
    """A kind of cards of the deck that the full model does not take over."""

    name: str
    count: int
    consequence: str
    is_body: bool  #: whether it carries mass or stiffness


@dataclass(frozen=True, eq=False)
class MeshError:
    """What is known of the error that the mesh makes."""

    words: str  #: how it was estimated, or why it was not
    estimate: MeshConvergence | MeshRefinement | None = None

    @property
    def largest(self) -> float:
        """Largest estimated relative error of the lowest frequencies; NaN if there is no estimate."""
        return float("nan") if self.estimate is None else float(np.abs(self.estimate.error).max())


@dataclass(frozen=True, eq=False)
class Acceptance:
    """A body, its origin, every check, and its range of use."""

    body: ReducedBody
    records: tuple[QualityRecord, ...]  #: all checks
    range: RangeOfUse
    masses: tuple[EffectiveMass, ...]  #: for each interface that can be held
    compared_with: str  #: description of the full model; "": none was given
    mesh_error: MeshError
    left_out: tuple[LeftOut, ...] | None  #: of the deck; None: there is no deck
    file: str = ""  #: the modal file
    digest: str = ""  #: of its contents
    sources: tuple[SourceFile, ...] = ()
    made: str = ""  #: when, ISO 8601 with the zone

    @property
    def verdict(self) -> Verdict:
        """The worst verdict of all checks."""
        return worst(self.records)

    @property
    def words(self) -> str:
        """The verdict as text, with its basis."""
        counts = {kind: sum(record.verdict == kind for record in self.records) for kind in ("pass", "warn", "fail")}
        said = ", ".join(f"{count} {kind}" for kind, count in counts.items() if count)
        against = self.compared_with or "no full model: the file was judged by itself"
        return f"{self.body.name} is {VERDICT_WORDS[self.verdict]} ({said}); compared with {against}"

    def as_dict(self) -> dict[str, Any]:
        """Return everything in plain types, ready for JSON."""
        body = body_record(self.body)
        range_of_use = {
            "band_hz": plain(self.range.band.highest),
            "band": self.range.band.words,
            "band_is_compared": self.range.band.is_compared,
            "speed": None if self.range.speed is None else {k: plain(v) for k, v in asdict(self.range.speed).items()},
            "loads": [{key: plain(value) for key, value in asdict(load).items()} for load in self.range.loads],
            "limits": {k: plain(v) for k, v in asdict(self.range.limits).items()},
            "limits_with_geometric_stiffness": None
            if self.range.stiffened_limits is None
            else {k: plain(v) for k, v in asdict(self.range.stiffened_limits).items()},
        }
        return {
            "acceptance": 1,
            "verdict": self.verdict,
            "words": self.words,
            "made": self.made,
            "file": self.file,
            "digest": self.digest,
            "sources": [asdict(source) for source in self.sources],
            "body": body,
            "origin": origin_groups(self.body.provenance),
            "compared_with": self.compared_with,
            "records": [record.as_dict() for record in self.records],
            "effective_mass": [mass_record(each) for each in self.masses],
            "range_of_use": range_of_use,
            "left_out": None if self.left_out is None else [asdict(each) for each in self.left_out],
            "mesh_error": {"words": self.mesh_error.words, **mesh_record(self.mesh_error)},
        }


def mesh_record(error: MeshError) -> dict[str, Any]:
    """Return the estimate of the mesh error in plain types."""
    if error.estimate is None:
        return {"largest": None}
    return {
        "largest": plain(error.largest),
        "n_dof": list(error.estimate.n_dof),
        "frequencies_hz": plain(error.estimate.frequencies),
        "error": plain(error.estimate.error),
    }


def now() -> str:
    """Return the time, to the second."""
    return datetime.now(UTC).astimezone().isoformat(timespec="seconds")
