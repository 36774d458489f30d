"""Quality records: a dimensionless number, its tolerance, a verdict, the reason, and the next action.

Tests, command line, reports and plots read the same record; `LIMITS` defines all thresholds.
"""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from cms.assessment.quality.errors import QualityError
from cms.assessment.quality.limits import LIMITS, Verdict
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted

__all__ = ["VERDICTS", "QualityRecord", "Verdict", "has_failed", "information", "judge", "plain", "worst"]

VERDICTS: tuple[Verdict, ...] = ("info", "pass", "warn", "fail")  #: verdicts in order of severity


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class QualityRecord:
    """Result of one quality check of a reduced body.

    Parameters
    ----------
    name
        Key in `LIMITS`, such as "frequency-error".
    title
        Checked property in words.
    value
        Dimensionless value; NaN if the check does not apply.
    tolerance
        Largest value that passes; None: no verdict.
    verdict
        Verdict of the comparison of the value with the tolerance.
    reason
        Finding, in one sentence with its numbers.
    action
        Remedy; "" if none is needed.
    data
        Arrays, numbers and words from which the value follows, for tables and plots.
    """

    name: str
    title: str
    value: float
    tolerance: float | None
    verdict: Verdict
    reason: str
    action: str
    data: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        object.__setattr__(self, "data", MappingProxyType(dict(self.data)))

    def __reduce__(self) -> tuple[Any, ...]:
        """Reduce to a dict, because a view of a dict cannot be sent to another process."""
        values = (getattr(self, each.name) for each in fields(self))
        return type(self), tuple(dict(value) if isinstance(value, MappingProxyType) else value for value in values)

    def as_dict(self) -> dict[str, Any]:
        """Return the record in JSON types; non-finite numbers become None."""
        return {
            "name": self.name,
            "title": self.title,
            "value": plain(self.value),
            "tolerance": self.tolerance,
            "verdict": self.verdict,
            "reason": self.reason,
            "action": self.action,
            "data": {key: plain(value) for key, value in self.data.items()},
        }


def judge(
    name: str, value: float, reason: str, data: Mapping[str, Any] | None = None, *, action: str | None = None,
    tolerance: float | None = None,
) -> QualityRecord:  # fmt: skip
    """Return the record of a value, with its verdict according to the limit of this name; NaN fails.

    Parameters
    ----------
    action
        Remedy if the value does not pass; by default the action of the limit.
    tolerance
        Largest value that passes, if not that of the limit.

    Raises
    ------
    QualityError
        If there is no limit of that name.
    """
    if name not in LIMITS:
        raise QualityError(f"quality record {quoted(name)}: unknown{nearest(name, LIMITS)}")
    limit = LIMITS[name] if tolerance is None else replace(LIMITS[name], tolerance=tolerance)
    value = float(value)
    verdict = limit.verdict(value)
    todo = "" if verdict in ("pass", "info") else (action or limit.action)
    return QualityRecord(name, limit.title, value, limit.tolerance, verdict, reason, todo, data or {})


def information(name: str, reason: str, data: Mapping[str, Any] | None = None, *, action: str = "") -> QualityRecord:
    """Return the record of a check that is not applicable or only informs; its value is NaN."""
    limit = LIMITS[name]
    return QualityRecord(name, limit.title, math.nan, limit.tolerance, "info", reason, action, data or {})


def worst(records: Iterable[QualityRecord]) -> Verdict:
    """Return the worst verdict; "info" if there are no records."""
    return max((record.verdict for record in records), key=VERDICTS.index, default="info")


def has_failed(records: Iterable[QualityRecord]) -> bool:
    """Return whether any record failed."""
    return worst(records) == "fail"


def plain(value: Any) -> Any:
    """Return a value in JSON types: lists, numbers, text; non-finite numbers become None."""
    if isinstance(value, np.ndarray):
        if np.iscomplexobj(value):
            return {"real": plain(value.real), "imag": plain(value.imag)}
        return [plain(item) for item in value.tolist()]
    if isinstance(value, np.generic):
        return plain(value.item())
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    return value
