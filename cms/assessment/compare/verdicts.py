"""Verdict of each mode set: whether it is good enough, with how few modes, and why, in sentences from records."""

import math
from collections.abc import Sequence
from typing import Literal

from cms.assessment.compare.comparison import Point, SetResult
from cms.assessment.quality.limits import LIMITS
from cms.assessment.quality.numbers import share
from cms.assessment.quality.record import QualityRecord

__all__ = [
    "DECIDING",
    "DOUBTS",
    "accuracy",
    "answer",
    "crossings",
    "is_good",
    "modes_words",
    "number_words",
    "ranking",
    "set_sentence",
    "severity",
    "shown_point",
]

EXACT = 1e-8  #: value below which a sentence says "exact"
#: records that decide whether a set is good enough, and their names in a sentence
DECIDING = {
    "frequency-error": "free frequencies",
    "mac": "mode shapes (1 - MAC)",
    "static-interface": "static interface loads",
    "static-inertia": "static inertia loads",
    "static-load-cases": "static load cases",
    "frequency-response": "frequency response",
    "deformation-error": "deformation in the motion",
}
#: further reported records, which do not decide
DOUBTS = {
    "residual-bound": "residual bound",
    "effective-mass": "missing effective mass",
    "conditioning": "condition",
    "dropped-columns": "dropped columns",
}


def is_good(records: Sequence[QualityRecord]) -> bool:
    """Return whether every deciding record passes; "info" (not applicable) does not decide."""
    return all(record.verdict in ("pass", "info") for record in records if record.name in DECIDING)


def severity(points: Sequence[Point]) -> Literal["pass", "warn", "fail"]:
    """Return the worst verdict of the deciding records at the displayed point, as in `cms check`."""
    shown = shown_point(points)
    if shown is None:
        return "fail"
    verdicts = {record.verdict for record in points[shown].records if record.name in DECIDING}
    return "fail" if "fail" in verdicts else "warn" if "warn" in verdicts else "pass"


def accuracy(point: Point) -> float:
    """Return the largest ratio of a deciding value to its limit, with three digits; smaller is more accurate."""
    shares = [
        record.value / record.tolerance
        for record in point.records
        if record.name in DECIDING and record.tolerance and record.verdict != "info"
    ]
    largest = max(shares, default=0.0)
    return float(f"{largest:.3g}") if largest > EXACT else 0.0


def shown_point(points: Sequence[Point]) -> int | None:
    """Return the index of the smallest sufficient point, else of the largest point; None if there are no points."""
    if not points:
        return None
    return next((k for k, point in enumerate(points) if point.is_good), len(points) - 1)


def set_sentence(points: Sequence[Point]) -> str:
    """State how many modes suffice, and which limits fewer modes exceed; else the limits that the largest exceeds."""
    shown = shown_point(points)
    if shown is None:
        return "it has no columns to judge"
    point = points[shown]
    if not point.is_good:
        most = f"even with {modes_words(point.n_modes)}" if len(points) > 1 else f"with {modes_words(point.n_modes)}"
        what = "not good enough" if severity(points) == "fail" else "misses a limit, though not by far,"
        sentence = f"{what} {most}: {'; '.join(miss(record) for record in missed(point))}"
        is_inertia = any(record.name == "static-inertia" for record in missed(point))
        return f"{sentence}; {LIMITS['static-inertia'].action}" if is_inertia else sentence
    text = f"good enough with {modes_words(point.n_modes)}, {point.n_q} coordinates"
    if shown == 0:
        return f"{text}, the fewest that were tried"
    before = points[shown - 1]
    return f"{text}; with {before.n_modes}: {'; '.join(miss(record) for record in missed(before))}"


def missed(point: Point) -> list[QualityRecord]:
    """Return the deciding records that do not pass."""
    return [record for record in point.records if record.name in DECIDING and record.verdict not in ("pass", "info")]


def miss(record: QualityRecord) -> str:
    """State by how much a record exceeds its limit."""
    return f"{DECIDING[record.name]} {number_words(record.value)}, limit {number_words(LIMITS[record.name].tolerance)}"


def ranking(sets: Sequence[SetResult]) -> tuple[str, ...]:
    """Return the sets that are good enough: fewest coordinates first, then most accurate, then fewest modes.

    Sets that are equal in all three, such as sets with the same span, keep the given order.
    """
    good = [(result.name, result.detail) for result in sets if result.verdict == "pass" and result.detail is not None]
    good.sort(key=lambda found: (found[1].n_q, accuracy(found[1]), found[1].n_modes))
    return tuple(name for name, _ in good)


def answer(sets: Sequence[SetResult], order: Sequence[str], band_hz: float) -> str:
    """State which set is recommended."""
    band = f"up to {band_hz:.5g} Hz"
    if not order:
        tried = [result for result in sets if result.detail is not None]
        if not tried:
            return "No mode set could be made; the reasons stand below."
        severe = ("pass", "warn", "fail", "error")
        nearest_ = min(
            tried,
            key=lambda result: (severe.index(result.verdict), len(missed(result.detail))),  # type: ignore[arg-type]
        )
        assert nearest_.detail is not None
        what = ", ".join(DECIDING[record.name] for record in missed(nearest_.detail))
        return (
            f"No mode set that was tried is good enough {band}. Nearest comes {nearest_.name} with "
            f"{modes_words(nearest_.detail.n_modes)}, which misses: {what}. Try more modes, or a lower band."
        )
    best = next(result for result in sets if result.name == order[0])
    point = best.detail
    assert point is not None
    records = {record.name: record for record in point.records}
    told = [
        f"{DECIDING[name]} {'exact' if records[name].value < EXACT else 'to ' + number_words(records[name].value)}"
        for name in ("frequency-error", "frequency-response", "deformation-error")
        if name in records and records[name].verdict == "pass"
    ]
    text = (
        f"Take {best.name} with {modes_words(point.n_modes)}: {point.n_q} coordinates are good enough {band} "
        f"({', '.join(told)})."
    )
    details = {result.name: result.detail for result in sets}
    equal = [name for name in order[1:] if details[name].n_q == point.n_q]  # type: ignore[union-attr]
    if equal:
        text += f" {listed(equal)} {'needs' if len(equal) == 1 else 'need'} as many."
    others = [name for name in order[1:] if name not in equal]
    if others:
        text += f" {listed([f'{name} needs {details[name].n_q}' for name in others])}."  # type: ignore[union-attr]
    return text


def listed(words: Sequence[str]) -> str:
    """Return the words as a list: 'a', 'a and b', or 'a, b and c'."""
    return " and ".join(filter(None, [", ".join(words[:-1]), words[-1]]))


def crossings(sets: Sequence[SetResult], name: str) -> str:
    """State the number of modes from which on each set keeps the limit of a record."""
    limit = LIMITS[name].tolerance
    if limit is None:
        return ""
    kept: dict[int, list[str]] = {}
    never, not_judged = [], []
    for result in sets:
        verdicts = [point.record(name).verdict for point in result.points]
        if not verdicts:
            continue
        last = max((k for k, verdict in enumerate(verdicts) if verdict != "pass"), default=-1)
        if last + 1 < len(verdicts):
            kept.setdefault(result.points[last + 1].n_modes, []).append(result.name)
        elif verdicts[-1] == "info":
            not_judged.append(result.name)
        else:
            never.append(result.name)
    parts = [f"{listed(names)} from {n_modes} modes on" for n_modes, names in sorted(kept.items())]
    if never:
        parts.append(f"not {listed(never)}")
    if not_judged:
        parts.append(f"not judged: {listed(not_judged)}")
    return f"Within the limit of {number_words(limit)}: {'; '.join(parts)}." if parts else ""


def modes_words(n_modes: int) -> str:
    """Return '1 vibration mode', '4 vibration modes', 'no vibration modes'."""
    return f"{n_modes or 'no'} vibration mode{'' if n_modes == 1 else 's'}"


def number_words(value: float | None) -> str:
    """Return a dimensionless number as in reports, or words if it is missing."""
    if value is None:
        return "none"
    return share(value) if math.isfinite(value) else "with modes missing"
