"""A parameter study as a document: curves of all outputs, the table of points, and reasons of failures."""

import numpy as np

from cms.assessment.report.palette import style_of
from fe_models.foundation.documents.charts import Axis, Chart, Line
from fe_models.foundation.documents.document import Answer, Cell, Document, Figure, Gallery, Section, TextTable
from floatframe.design.studies.study import StudyTable
from floatframe.design.studies.study_plots import MOST_CURVES, curves_of, value_label

__all__ = ["study_document"]

MOST_ROWS = 400  #: largest number of points in the table


def study_document(table: StudyTable) -> Document:
    """Return the document of a study."""
    study, n = table.study, len(table.rows)
    words = f"{n} points, {table.n_failed} of them failed." if table.n_failed else f"{n} points, none failed."
    parameters = ", ".join(f"{p.name} ({p.path})" if p.name != p.path else p.path for p in study.parameters)
    sections = [curves_section(table), points_section(table)]
    if table.n_failed:
        sections.append(failures_section(table))
    return Document(
        "What the parameters change",
        f"{study.system}, analysis {study.analysis}; varied: {parameters}",
        Answer(words, "warn" if table.n_failed else "info", figures=ranges(table)),
        sections,
        brand=study.system,
        kind="parameter study",
        footer="Written by floatframe sweep. Tables (-o NAME.csv, .json, .mat, .npz, .parquet) have all digits.",
    )


def ranges(table: StudyTable) -> list[tuple[str, str]]:
    """Return the least and greatest value of each output."""
    found = []
    for output, unit in zip(table.study.outputs, table.units, strict=True):
        values = table.column(output.name)
        known = values[np.isfinite(values)]
        if len(known):
            found.append((f"{known.min():.4g} to {known.max():.4g}", f"{output.name} [{unit}]"))
    return found


def curves_section(table: StudyTable) -> Section:
    """Return a chart for each output."""
    figures = []
    for k, output in enumerate(table.study.outputs):
        drawn = curves_of(table, output.name)
        is_few = len(drawn.curves) <= MOST_CURVES
        lines = []
        for i, (words, x, y) in enumerate(drawn.curves):
            style = style_of(i if is_few else 0)
            lines.append(Line(x, y, words if is_few else "", style.color, style.dash, symbol=style.symbol))
        axis = Axis(drawn.x_label, is_log=drawn.is_log)
        choices = ", ".join(f"{i}: {words}" for i, words in enumerate(drawn.choices))
        chart = Chart(axis, (Axis(drawn.y_label),), tuple(lines), has_legend=is_few and bool(drawn.curves[0][0]))
        figures.append(Figure(f"output-{k}", chart, choices, output.name))
    blocks = (Gallery(figures),) if len(figures) > 1 else tuple(figures)
    lead = "One curve for each combination of the other parameters." if len(table.study.parameters) > 1 else ""
    return Section("outputs", "Outputs", blocks, lead)


def points_section(table: StudyTable) -> Section:
    """Return the table of points."""
    heads = table.to_table().heads[:-1]
    rows = [
        [
            *(Cell(value_label(value), "n") for value in row.values),
            *(Cell("failed", "n fail") if row.error else Cell(f"{value:.6g}", "n") for value in row.outputs),
        ]
        for row in table.rows[:MOST_ROWS]
    ]
    lead = "" if len(table.rows) <= MOST_ROWS else f"The first {MOST_ROWS} of {len(table.rows)} points."
    return Section("points", "Points", (TextTable([f"{head}>" for head in heads], rows),), lead)


def failures_section(table: StudyTable) -> Section:
    """Return the reasons of failed points."""
    names = [parameter.name for parameter in table.study.parameters]
    rows = [
        (", ".join(f"{n} = {value_label(v)}" for n, v in zip(names, row.values, strict=True)), row.error)
        for row in table.rows
        if row.error
    ]
    return Section("failures", "Failures", (TextTable(("point", "reason"), rows[:MOST_ROWS]),))
