"""Comparison as plain types, with every number that the other reports show, and as a table."""

import json
import math
from dataclasses import asdict
from typing import Any

from cms.assessment.compare.comparison import Comparison, Point, SetResult
from cms.assessment.quality.record import plain
from fe_models.foundation.documents.table import Table

__all__ = ["FORMAT", "comparison_json", "comparison_record", "comparison_table"]


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


def comparison_table(comparison: Comparison) -> Table:
    """Return the values of all records, one row for every set and number of modes; non-finite values are missing.

    A set that could not be made has one row, with the reason as its verdict.
    """
    names = list(
        dict.fromkeys(record.name for result in comparison.sets for p in result.points for record in p.records)
    )
    rows: list[tuple[Any, ...]] = []
    for result in comparison.sets:
        if not result.points:
            rows.append((result.name, None, None, None, None, result.sentence, *[None] * len(names)))
        for point in result.points:
            values = {record.name: record.value for record in point.records if math.isfinite(record.value)}
            verdict = "good enough" if point.is_good else "not good enough"
            counts = (point.n_modes, point.n_columns, point.n_q, len(point.dropped))
            rows.append((result.name, *counts, verdict, *map(values.get, names)))
    return Table.of_rows(("set", "n_modes", "n_columns", "n_coordinates", "n_dropped", "verdict", *names), rows)
