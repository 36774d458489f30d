"""What a comparison of mode sets found: plain numbers and sentences, which reports only have to write down."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from cms.assessment.quality.record import QualityRecord
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.units import Units

__all__ = ["Comparison", "Drawing", "FullResults", "Point", "SetResult"]


@dataclass(frozen=True, eq=False)
class Point:
    """A mode set with one number of vibration modes."""

    n_modes: int  #: number of requested vibration modes
    n_columns: int  #: columns of the set
    n_q: int  #: number of remaining independent elastic shapes: generalised coordinates of the reduced body
    dropped: tuple[str, ...]  #: labels of redundant columns
    records: tuple[QualityRecord, ...]
    is_good: bool  #: whether every deciding record passes

    def record(self, name: str) -> QualityRecord:
        """Return the record of that name; `KeyError` if there is none."""
        for record in self.records:
            if record.name == name:
                return record
        raise KeyError(name)


@dataclass(frozen=True, eq=False)
class SetResult:
    """A mode set with several numbers of vibration modes."""

    name: str  #: key in the registry
    words: str  #: what its columns are
    points: tuple[Point, ...]  #: by ascending number of modes; empty where the set could not be made
    shown: int | None  #: index of the point with details; None if there is none
    verdict: Literal["pass", "warn", "fail", "error"]  #: the worst that decides, at the shown point; "error": not made
    sentence: str  #: why, in words
    columns: Mapping[str, int] = field(default_factory=dict)  #: family -> number of columns of the shown point
    seconds: float = 0.0  #: to make it with the most modes and to judge all numbers of modes

    @property
    def detail(self) -> Point | None:
        """The point that details are given for."""
        return None if self.shown is None else self.points[self.shown]


@dataclass(frozen=True, eq=False)
class FullResults:
    """What the full model answers, as far as reports show it."""

    frequencies_hz: Array  #: elastic free modes that were found, (n_modes,)
    n_band: int  #: number of them in the band
    band_hz: float  #: highest frequency of the comparison
    response_hz: Array  #: frequencies of the response, (n_f,)
    response: Array  #: magnitude of the entry that is drawn, (n_f,) [length / force]
    response_words: str  #: which that is
    response_error: float  #: estimated error of the full model's own response, over its size
    damping: float  #: ratio of every mode in response and motion
    t: Array  #: of the motion, (n_t,) [s]
    force: Array | None  #: of the pulse, its peak 1, (n_t,); None for a given motion
    motion_words: str
    mass: Array  #: of the body in x, y, z and about those axes through the centre of mass, (6,)
    held_mass: Array  #: part of it that moves while the interfaces are held, (6,)
    was_cached: bool  #: whether it came from the file of an earlier comparison
    digest: str  #: of what it depends on


@dataclass(frozen=True, eq=False)
class Drawing:
    """A surface, or lines if there is none, and the free modes of the full model on it."""

    nodes: Array  #: (n, 3) [length unit]
    triangles: IntArray  #: (n_tri, 3)
    lines: IntArray  #: sharp edges of the surface, or the elements of a body without one, (n_lines, 2)
    shapes: Array  #: free modes in the band, largest displacement 1, (n_modes, n, 3)
    n_triangles_full: int  #: of the surface before it was thinned out for the screen


@dataclass(frozen=True, eq=False)
class Comparison:
    """Mode sets of one body against its full model."""

    name: str  #: of the body
    units: Units
    n_dof: int
    n_nodes: int
    interfaces: tuple[tuple[str, str, int], ...]  #: name, kind, number of nodes
    full: FullResults
    sets: tuple[SetResult, ...]
    ranking: tuple[str, ...]  #: sets that are good enough, the smallest reduced body first
    sentence: str  #: the answer: which set, with how many modes, and why
    drawing: Drawing
    seconds: Mapping[str, float]  #: of the stages
    provenance: Mapping[str, str]

    def set(self, name: str) -> SetResult:
        """Return the result of the set of that name; `KeyError` if there is none."""
        for result in self.sets:
            if result.name == name:
                return result
        raise KeyError(name)
