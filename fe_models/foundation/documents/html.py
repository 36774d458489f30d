"""A document as one HTML page that works offline, light and dark, and prints on A4; its template is data/page.html."""

import base64
import json
from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import numpy as np

from fe_models.foundation.documents.charts import chart_record
from fe_models.foundation.documents.document import MARKS, Document, Figure, Markup, cells_of

if TYPE_CHECKING:
    from jinja2 import Template

__all__ = ["asset", "html_page", "text"]


def html_page(document: Document) -> str:
    """Return the page; it includes the script and data of charts if there are any."""
    charts = {block.key: chart_record(block.chart) for block in document.blocks() if isinstance(block, Figure)}
    extras = [block for block in document.blocks() if isinstance(block, Markup)]
    data = {key: words for block in extras for key, words in block.data.items()}
    if charts:
        data["charts"] = json.dumps(packed(charts), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
    scripts = [*([asset("chart.js")] if charts else []), asset("page.js"), *(e.script for e in extras if e.script)]
    return template().render(
        document=document, style=asset("page.css") + asset("dark.css"), scripts=scripts,
        # '<' is escaped, so that no text of a name can end the script
        data={key: words.replace("<", "\\u003c") for key, words in data.items()},
    )  # fmt: skip


def packed(charts: dict[str, Any]) -> dict[str, Any]:
    """Return charts whose lines name their arrays by index, and each different array once, 32-bit numbers in base64.

    The lines of a chart mostly share their x. None becomes NaN.
    """
    places: dict[str, int] = {}

    def index_of(values: list[float | None]) -> int:
        return places.setdefault(base64.b64encode(np.array(values, dtype="<f4").tobytes()).decode(), len(places))

    for line in (item for chart in charts.values() for item in chart["items"] if item["kind"] == "line"):
        for name in ("x", "y", "other_x"):
            if line[name] is not None:
                line[name] = index_of(line[name])
    return {"charts": charts, "arrays": list(places)}


@cache
def template() -> "Template":
    """Return the template of a page."""
    from jinja2 import Environment, StrictUndefined

    environment = Environment(autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True)
    environment.filters["unbroken"] = unbroken
    environment.filters["base64"] = lambda content: base64.b64encode(content).decode()
    environment.globals |= {"marks": MARKS, "cells_of": cells_of}
    environment.tests["kind"] = lambda block, name: type(block).__name__ == name
    return environment.from_string(asset("page.html"))


def unbroken(words: object) -> str:
    """Return text in which numbers are not separated from their percent signs."""
    return str(words).replace(" %", "\u00a0%")


def text(words: object) -> str:
    """Return text as HTML."""
    from html import escape

    return escape(unbroken(words))


def asset(name: str) -> str:
    """Return a file that is included with documents."""
    return (files("fe_models.foundation.documents") / "data" / name).read_text(encoding="utf-8")
