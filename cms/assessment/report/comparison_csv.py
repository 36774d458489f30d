"""A comparison as CSV: one row for every set and number of modes."""

import csv
import io
import math

from cms.assessment.compare.comparison import Comparison

__all__ = ["comparison_csv"]


def comparison_csv(comparison: Comparison) -> str:
    """Return the values of all records as CSV, comma-separated, with one heading row; non-finite values are empty.

    A set that could not be made has one row, with the reason as its verdict.
    """
    names = list(
        dict.fromkeys(record.name for result in comparison.sets for p in result.points for record in p.records)
    )
    text = io.StringIO(newline="")
    table = csv.writer(text, lineterminator="\n")
    table.writerow(["set", "n_modes", "n_columns", "n_coordinates", "n_dropped", "verdict", *names])
    for result in comparison.sets:
        if not result.points:
            table.writerow([result.name, "", "", "", "", result.sentence, *[""] * len(names)])
        for point in result.points:
            values = {record.name: record.value for record in point.records}
            table.writerow(
                [
                    result.name, point.n_modes, point.n_columns, point.n_q, len(point.dropped),
                    "good enough" if point.is_good else "not good enough",
                    *[repr(values[n]) if n in values and math.isfinite(values[n]) else "" for n in names],
                ]
            )  # fmt: skip
    return text.getvalue()
