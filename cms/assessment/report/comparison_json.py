"""Comparison as plain types, with every number that the other reports show."""

import json
from dataclasses import asdict
from typing import Any

from cms.assessment.compare.comparison import Comparison, Point, SetResult
from cms.assessment.quality.record import plain

__all__ = ["FORMAT", "comparison_json", "comparison_record"]


FORMAT = "cms-comparison"
VERSION = 1


def comparison_json(comparison: Comparison) -> str:
    """Return a comparison as JSON text; non-finite numbers become null."""
    return json.dumps(comparison_record(comparison), ensure_ascii=False, allow_nan=False)


def comparison_record(comparison: Comparison) -> dict[str, Any]:
    """Return a comparison in plain types; frequencies are in Hz, times in s, the rest in units of the body.

    The drawing is omitted, because it contains no results.
    """
    return {
        "format": FORMAT,
        "version": VERSION,
        "name": comparison.name,
        "units": asdict(comparison.units),
        "n_dof": comparison.n_dof,
        "n_nodes": comparison.n_nodes,
        "interfaces": [{"name": n, "kind": kind, "nodes": count} for n, kind, count in comparison.interfaces],
        "answer": comparison.sentence,
        "ranking": list(comparison.ranking),
        "sets": [set_record(result) for result in comparison.sets],
        "full_model": plain(vars(comparison.full)),
        "seconds": plain(comparison.seconds),
        "provenance": dict(comparison.provenance),
    }


def set_record(result: SetResult) -> dict[str, Any]:
    """Return the result of one set in plain types."""
    return {
        "name": result.name,
        "words": result.words,
        "verdict": result.verdict,
        "sentence": result.sentence,
        "columns": dict(result.columns),
        "seconds": result.seconds,
        "shown": result.shown,
        "points": [point_record(point) for point in result.points],
    }


def point_record(point: Point) -> dict[str, Any]:
    """Return the result for one number of modes in plain types."""
    return {
        "n_modes": point.n_modes,
        "n_columns": point.n_columns,
        "n_coordinates": point.n_q,
        "dropped": list(point.dropped),
        "is_good": point.is_good,
        "records": [record.as_dict() for record in point.records],
    }
