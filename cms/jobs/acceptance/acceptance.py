"""Acceptance of a reduced body: all information that is needed for its approval."""

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
from fe_models.foundation.presentation import presented

__all__ = ["VERDICT_WORDS", "Acceptance", "LeftOut", "MeshError"]

VERDICT_WORDS: Mapping[Verdict, str] = {
    "pass": "accepted",
    "warn": "accepted with reservations",
    "fail": "not accepted",
    "info": "nothing was judged",
}


@dataclass(frozen=True)
class LeftOut:
    """Kind of cards of the deck that the full model omits."""

    name: str
    count: int
    consequence: str
    is_body: bool  #: whether the cards have mass or stiffness


@dataclass(frozen=True, eq=False)
class MeshError:
    """Estimate of the error due to the mesh."""

    words: str  #: description of the estimate, or the reason why there is none
    estimate: MeshConvergence | MeshRefinement | None = None  #: estimate by a refined mesh
    of_file: float = float("nan")  #: largest estimate of the file for the lowest frequencies; NaN: none

    @property
    def largest(self) -> float:
        """Largest estimated relative error of the lowest frequencies; NaN if there is no estimate."""
        return self.of_file if self.estimate is None else float(np.abs(self.estimate.error).max())


@presented
@dataclass(frozen=True, eq=False)
class Acceptance:
    """A body, its origin, every check, and its range of use."""

    body: ReducedBody
    records: tuple[QualityRecord, ...]  #: records of all checks
    range: RangeOfUse
    masses: tuple[EffectiveMass, ...]  #: effective masses for each interface that can be fixed
    compared_with: str  #: description of the full model; "": no full model was given
    mesh_error: MeshError
    left_out: tuple[LeftOut, ...] | None  #: omitted cards of the deck; None: no deck was given
    file: str = ""  #: path of the modal file
    digest: str = ""  #: digest of the contents of the file
    sources: tuple[SourceFile, ...] = ()
    made: str = ""  #: time of the acceptance, ISO 8601 with time zone

    @property
    def verdict(self) -> Verdict:
        """Worst verdict of all checks."""
        return worst(self.records)

    @property
    def words(self) -> str:
        """Verdict as text, with its basis."""
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
        return {"largest": plain(error.largest)}
    return {
        "largest": plain(error.largest),
        "n_dof": list(error.estimate.n_dof),
        "frequencies_hz": plain(error.estimate.frequencies),
        "error": plain(error.estimate.error),
    }


def now() -> str:
    """Return the current time, rounded to seconds."""
    return datetime.now(UTC).astimezone().isoformat(timespec="seconds")
