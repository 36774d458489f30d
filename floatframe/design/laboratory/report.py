"""A laboratory study as a document: error over coordinates and over cost, the cases, and reasons of failures."""

import numpy as np

from cms.assessment.report.palette import style_of
from fe_models.foundation.documents.charts import Axis, Chart, Line
from fe_models.foundation.documents.document import Answer, Cell, Document, Figure, Gallery, Section, TextTable
from floatframe.design.laboratory.figures import FLOOR
from floatframe.design.laboratory.laboratory import CaseResult, LaboratoryResult

__all__ = ["laboratory_document"]


def laboratory_document(result: LaboratoryResult) -> Document:
    """Return the document of a laboratory study."""
    made = [row for row in result.cases if not row.failure]
    n_failed = len(result.cases) - len(made)
    words = f"{len(result.cases)} cases" + (f", {n_failed} of them without a motion." if n_failed else ".")
    figures = []
    if made:
        best = min(made, key=lambda row: row.error)
        n = best.case.n_modes
        words = f"{best.case.description} with {n} mode{'s'[: n != 1]} comes closest to the reference. {words}"
        figures = [(f"{100 * best.error:.3g} %", "smallest error"), (str(best.n_q), "its coordinates"),
                   (f"{best.seconds:.3g} s", "its processor time")]  # fmt: skip
    if result.settled is not None:
        figures.append((f"{100 * result.settled:.2g} %", "error of the reference itself"))
    return Document(
        f"Which description is good enough for {result.name}?",
        f"errors relative to the range of the reference, {result.reference}",
        Answer(words, "warn" if n_failed else "info", figures=figures),
        (convergence_section(made), cases_section(result)),
        brand=result.name,
        kind="laboratory",
        footer="Written by floatframe compare. Tables (-o NAME.csv, .json, .mat, .npz, .parquet) have all columns.",
    )


def convergence_section(made: list[CaseResult]) -> Section:
    """Return charts of the error over coordinates and over processor time, one line for each description."""
    over_coordinates: list[Line] = []
    over_time: list[Line] = []
    for k, family in enumerate(dict.fromkeys(row.case.family for row in made)):
        rows = sorted((row for row in made if row.case.family == family), key=lambda row: row.n_q)
        error, style, name = np.maximum([row.error for row in rows], FLOOR), style_of(k), rows[0].case.description
        for lines, x in ((over_coordinates, [row.n_q for row in rows]), (over_time, [row.seconds for row in rows])):
            lines.append(Line(x, error, name, style.color, style.dash, symbol=style.symbol))
    upwards = (Axis("largest error [-]", is_log=True),)
    time = Axis("processor time of the run [s]", range=(0.0, 1.1 * max((row.seconds for row in made), default=1.0)))
    charts = [
        Figure("coordinates", Chart(Axis("modal coordinates"), upwards, tuple(over_coordinates)), "", "Error and size"),
        Figure("cost", Chart(time, upwards, tuple(over_time)), "", "Error and cost"),
    ]
    return Section("convergence", "Convergence", (Gallery(charts),), "One line for each description over its modes.")


def cases_section(result: LaboratoryResult) -> Section:
    """Return the table of cases."""
    rows = []
    for row in result.cases:
        head = [Cell(row.case.description, "name", "; ".join(row.notes)), Cell(str(row.case.n_modes), "n")]
        if row.failure:
            rows.append([*head, Cell("none", "n fail"), *[Cell("\u2013", "n blank")] * 2, Cell(row.failure)])
            continue
        numbers = (f"{100 * row.error:.3g}", str(row.n_q), f"{row.seconds:.3g}")
        rows.append([*head, *(Cell(words, "n") for words in numbers), Cell(row.worst, note=row.fails_first)])
    headings = ("description", "modes>", "error %>", "coordinates>", "time [s]>", "worst column, cause")
    return Section("cases", "Cases", (TextTable(headings, rows),))
