"""Results of a comparison of mode sets: plain numbers and sentences, which the reports present."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

from cms.assessment.quality.record import QualityRecord
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.presentation import presented
from fe_models.foundation.units import Units

__all__ = ["Comparison", "Drawing", "FullResults", "Point", "SetResult"]


@presented
@dataclass(frozen=True, eq=False)
class Point:
    """Result of a mode set with one number of vibration modes."""

    n_modes: int  #: number of requested vibration modes
    n_columns: int  #: number of columns of the set
    n_q: int  #: number of independent elastic shapes: the generalised coordinates of the reduced body
    dropped: tuple[str, ...]  #: labels of redundant columns
    records: tuple[QualityRecord, ...]
    is_good: bool  #: whether every deciding record passes

    def record(self, name: str) -> QualityRecord:
        """Return the record with this name; `KeyError` if there is none."""
        for record in self.records:
            if record.name == name:
                return record
        raise KeyError(name)


@presented
@dataclass(frozen=True, eq=False)
class SetResult:
    """Results of a mode set for several numbers of vibration modes."""

    name: str  #: name of the set in the registry `MODE_SETS`
    words: str  #: description of the columns of the set
    points: tuple[Point, ...]  #: results by ascending number of modes; empty if the set could not be computed
    shown: int | None  #: index of the point for which reports give details; None if there is none
    #: worst deciding verdict at the shown point; "error": the set could not be computed
    verdict: Literal["pass", "warn", "fail", "error"]
    sentence: str  #: reason for the verdict
    columns: Mapping[str, int] = field(default_factory=dict)  #: number of columns of each family at the shown point
    seconds: float = 0.0  #: time to compute the largest set and to assess all numbers of modes [s]

    @property
    def detail(self) -> Point | None:
        """Point for which reports give details."""
        return None if self.shown is None else self.points[self.shown]


@dataclass(frozen=True, eq=False)
class FullResults:
    """Results of the full model that reports show."""

    frequencies_hz: Array  #: frequencies of the computed elastic free modes, (n_modes,) [Hz]
    n_band: int  #: number of these modes in the band
    band_hz: float  #: highest frequency of the comparison [Hz]
    response_hz: Array  #: frequencies of the frequency response, (n_f,) [Hz]
    response: Array  #: magnitude of the response entry in the chart, (n_f,) [length / force]
    response_words: str  #: description of this response entry
    response_error: float  #: estimated relative error of the response of the full model
    damping: float  #: damping ratio of every mode in response and motion
    t: Array  #: times of the reference motion, (n_t,) [s]
    force: Array | None  #: force of the pulse divided by its peak, (n_t,); None for a given motion
    motion_words: str
    mass: Array  #: mass of the body along x, y, z, then inertia about these axes through the centre of mass, (6,)
    held_mass: Array  #: part of this mass that moves while the interfaces are fixed, (6,)
    was_cached: bool  #: whether the results were read from the file of an earlier comparison
    digest: str  #: digest of all input data of the full model


@dataclass(frozen=True, eq=False)
class Drawing:
    """Surface of the full model, or lines if it has none, with its free modes."""

    nodes: Array  #: node positions, (n, 3) [length unit]
    triangles: IntArray  #: corner nodes of the triangles, (n_tri, 3)
    lines: IntArray  #: sharp edges of the surface, or elements of a body without surface, (n_lines, 2)
    shapes: Array  #: free modes in the band, scaled to a largest displacement of 1, (n_modes, n, 3)
    n_triangles_full: int  #: number of triangles of the surface before it was thinned for the screen


@presented
@dataclass(frozen=True, eq=False)
class Comparison(Tabular):
    """Comparison of mode sets of one body with its full model."""

    name: str  #: name of the body
    units: Units
    n_dof: int
    n_nodes: int
    interfaces: tuple[tuple[str, str, int], ...]  #: name, kind and number of nodes of each interface
    full: FullResults
    sets: tuple[SetResult, ...]
    ranking: tuple[str, ...]  #: names of the sets that are good enough, ordered by size of the reduced body
    sentence: str  #: recommended set, its number of modes, and the reason
    drawing: Drawing
    seconds: Mapping[str, float]  #: time of each stage [s]
    provenance: Mapping[str, str]

    def set(self, name: str) -> SetResult:
        """Return the result of the set with this name; `KeyError` if there is none."""
        for result in self.sets:
            if result.name == name:
                return result
        raise KeyError(name)

    is_indexed = False

    def to_table(self) -> Table:
        """Return the values of all records, one row for every set and number of modes; non-finite values are missing.

        A set that could not be made has one row, with the reason as its verdict.
        """
        names = list(dict.fromkeys(record.name for result in self.sets for p in result.points for record in p.records))
        rows: list[tuple[Any, ...]] = []
        for result in self.sets:
            if not result.points:
                rows.append((result.name, None, None, None, None, result.sentence, *[None] * len(names)))
            for point in result.points:
                values = {record.name: record.value for record in point.records if math.isfinite(record.value)}
                verdict = "good enough" if point.is_good else "not good enough"
                counts = (point.n_modes, point.n_columns, point.n_q, len(point.dropped))
                rows.append((result.name, *counts, verdict, *map(values.get, names)))
        return Table.of_rows(("set", "n_modes", "n_columns", "n_coordinates", "n_dropped", "verdict", *names), rows)
