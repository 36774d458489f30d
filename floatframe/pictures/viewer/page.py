"""The page around a record: a single HTML file that contains everything."""

import json
from importlib.resources import files
from typing import Any

from cms.assessment.report.html import asset as report_asset
from cms.assessment.report.html import text
from floatframe.pictures.viewer.packing import Block

__all__ = ["OWN_PARTS", "fixed_size", "page_of"]

LIBRARIES = ("three.min.js", "uplot.min.js")
OWN_PARTS = ("unpack.js", "machine.js", "camera.js", "plots.js", "controls.js")
STYLES = ("uplot.min.css", "view.css")


def page_of(record: dict[str, Any], block: Block) -> str:
    """Return the page with a record and its numbers."""
    head = json.dumps(record, separators=(",", ":"), allow_nan=False).replace("<", "\\u003c")
    styles = report_asset("page.css") + "".join(asset(name) for name in STYLES)
    scripts = "".join(f"<script>{asset(name)}</script>\n" for name in (*LIBRARIES, *OWN_PARTS))
    return (
        '<!doctype html>\n<html lang="en"><head><meta charset="utf-8">'
        '<meta name="viewport" content="width=device-width, initial-scale=1, viewport-fit=cover">'
        f'<title>{text(record["title"])}</title><link rel="icon" href="data:,">\n'
        f"<!--\n{asset('LICENSES.txt')}-->\n<style>{styles}</style></head>\n"
        f'<body class="view">{asset("view.html")}'
        f'<script type="application/json" id="record">{head}</script>\n'
        f'<script type="text/plain" id="numbers">{block.text()}</script>\n{scripts}</body></html>\n'
    )


def fixed_size() -> int:
    """Return the size in bytes of an empty page."""
    names = (*LIBRARIES, *OWN_PARTS, *STYLES, "LICENSES.txt", "view.html")
    return sum(len(asset(name)) for name in names) + len(report_asset("page.css"))


def asset(name: str) -> str:
    """Return a file shipped with the viewer."""
    return (files("floatframe.pictures.viewer") / "data" / name).read_text(encoding="utf-8")
