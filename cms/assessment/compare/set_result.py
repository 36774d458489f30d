"""Result of one mode set: a point for each number of modes and a verdict, or the reason why there is none."""

import inspect
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cms.assessment.compare.comparison import Point, SetResult
from cms.assessment.compare.coordinates import Coordinates, ReferenceBasis
from cms.assessment.compare.evaluation import SharedReference, judge_subset
from cms.assessment.compare.free_shapes import judged_subset
from cms.assessment.compare.subsets import SUBSETS
from cms.assessment.compare.verdicts import is_good, set_sentence, severity, shown_point
from cms.errors import CmsError
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS
from fe_models.foundation.arrays import Array
from fe_models.foundation.tall.columns import in_memory

__all__ = ["SetPart", "counts_of_parts", "joined_parts", "set_part"]


@dataclass(frozen=True, eq=False)
class SetPart:
    """Result of a mode set for some of the numbers of modes."""

    points: tuple[Point, ...]  #: results by ascending number of modes
    columns: tuple[dict[str, int], ...]  #: number of columns of each family, for each point
    refused: Mapping[int, str]  #: reason for each number of modes that is impossible
    error: str  #: reason if the set cannot be assessed at all
    seconds: float


def joined_parts(name: str, parts: Sequence[SetPart]) -> SetResult:
    """Join the parts of one set, which together contain all numbers of modes, into its result."""
    words = first_sentence(MODE_SETS[name].__doc__)
    refused = {n_modes: why for part in parts for n_modes, why in part.refused.items()}
    found = [pair for part in parts for pair in zip(part.points, part.columns, strict=True)]
    found.sort(key=lambda pair: pair[0].n_modes)
    points, columns = [point for point, _ in found], [each for _, each in found]
    errors = [part.error for part in parts if part.error]
    if errors or not points:
        reasons = [refused[n_modes] for n_modes in sorted(refused, reverse=True)]
        told = errors[0] if errors else "; ".join(dict.fromkeys(reasons))
        return SetResult(name, words, (), None, "error", f"could not be made: {told}")
    shown = shown_point(points)
    kept = tuple(point if k == shown else without_curves(point) for k, point in enumerate(points))
    chosen = columns[shown] if shown is not None else {}
    sentence = set_sentence(points) + refused_words(refused)
    seconds = sum(part.seconds for part in parts)
    return SetResult(name, words, kept, shown, severity(points), sentence, chosen, seconds)


def counts_of_parts(name: str, counts: Sequence[int]) -> list[tuple[int, ...]]:
    """Return numbers of modes to assess together: all of them if smaller sets are columns of the largest."""
    asked = tuple(sorted(set(counts)))
    is_one = name in SUBSETS or "n_modes" not in inspect.signature(MODE_SETS[name]).parameters
    return [asked] if is_one else [(n_modes,) for n_modes in asked]


def set_part(
    name: str,
    options: Mapping[str, Any],
    counts: Sequence[int],
    families: Families,
    basis: ReferenceBasis,
    reference: SharedReference,
) -> SetPart:
    """Return the points of one set, the column count of each family, and why other numbers are impossible."""
    began = time.perf_counter()
    make = MODE_SETS[name]
    takes = inspect.signature(make).parameters
    body = families.body
    asked = sorted(set(counts)) if "n_modes" in takes else [0]
    points: list[Point] = []
    families_of_columns: list[dict[str, int]] = []
    refused: dict[int, str] = {}

    def made(n_modes: int) -> ModeSet:
        counted = {"n_modes": n_modes} if "n_modes" in takes else {}
        return make(families, **counted, **options)

    def judge(n_modes: int, c: Coordinates, T: Array, labels: tuple[str, ...], groups: Sequence[str]) -> None:
        rigid = c.reference[:, reference.full.parts["rigid"]]
        subset = judged_subset(c, T, labels, rigid, basis.omega2)
        records = judge_subset(reference, c, subset)
        points.append(Point(n_modes, len(labels), subset.n_q, subset.basis.dropped, records, is_good(records)))
        families_of_columns.append({group: list(groups).count(group) for group in dict.fromkeys(groups)})

    most: tuple[ModeSet, Coordinates] | None = None
    for n_modes in reversed(asked):
        try:
            if most is None or name not in SUBSETS:
                modes = made(n_modes)
                most = modes, basis.coordinates(in_memory(modes.columns))
            modes, c = most
            if name in SUBSETS:
                C, labels = SUBSETS[name](modes, np.asarray(modes.columns[body.b]), n_modes)
                group_of = dict(zip(modes.labels, modes.groups, strict=True))
                judge(n_modes, c, c.columns @ C, labels, [group_of[label] for label in labels])
            else:
                judge(n_modes, c, c.columns, modes.labels, modes.groups)
        except CmsError as error:
            refused[n_modes] = str(error)
        except np.linalg.LinAlgError as error:
            return SetPart((), (), {}, str(error), time.perf_counter() - began)
    return SetPart(tuple(points[::-1]), tuple(families_of_columns[::-1]), refused, "", time.perf_counter() - began)


def refused_words(refused: Mapping[int, str]) -> str:
    """Name the numbers of modes that were impossible, with the first reason."""
    if not refused:
        return ""
    numbers = ", ".join(str(n) for n in sorted(refused))
    return f"; not possible with {numbers}: {refused[max(refused)]}"


def without_curves(point: Point) -> Point:
    """Return the point without curves: values and sentences of its records, frequencies and effective masses."""
    kept = ("frequency-error", "effective-mass")
    records = (record if record.name in kept else replace(record, data={}) for record in point.records)
    return replace(point, records=tuple(records))


def first_sentence(text: str | None) -> str:
    """Return the first line of a docstring without its marks."""
    line = (text or "").strip().split("\n")[0]
    return line.split(" [1]_")[0].rstrip(".")
