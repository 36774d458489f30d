"""A document as a PDF on A4, with page numbers and lines to sign; charts are drawn by matplotlib."""

import io
from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.sax.saxutils import escape

import numpy as np

from fe_models.foundation.documents.charts import Bars, Chart, Line, Matrix
from fe_models.foundation.documents.document import (
    MARKS,
    Block,
    Cell,
    Document,
    Figure,
    Gallery,
    Heading,
    Markup,
    Paragraph,
    Picture,
    Section,
    Terms,
    TextTable,
    cells_of,
)
from fe_models.foundation.extras import extra_module
from fe_models.foundation.words import shortened

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as Drawing

__all__ = ["pdf_pages"]

INK, TEXT, SOFT, LINE = "#1b1f24", "#3d4650", "#66727e", "#dde2e7"
GROUNDS = {"pass": "#e4f3ec", "warn": "#fdf1dd", "fail": "#fbe8e3", "error": "#fbe8e3", "info": "#eef1f4"}
WORDS = {"pass": "#0a6b4d", "warn": "#8a5300", "fail": "#a32a12", "error": "#a32a12", "info": "#66727e"}
MARGIN = 15.0  #: page margin [mm]
PADDING = 6.0  #: padding of the frame of reportlab on each side [points]
FOOTER = 6.5  #: font size of the footer [points]
LONGEST_FOOTER = 230  #: largest number of characters in the footer: two lines next to the page number
DPI = 150  #: resolution of charts [dots per inch]
HIGHEST = 560.0  #: largest height of a picture on a page [points]
WIDEST = 150.0  #: largest text width that counts for the width of a column [points]


def pdf_pages(document: Document) -> bytes:
    """Return the document as a PDF.

    Raises
    ------
    MissingExtraError
        If reportlab (extra `pdf`) is not installed.
    """
    extra_module("reportlab", extra="pdf", purpose="write a document as PDF")
    from reportlab.lib.pagesizes import A4
    from reportlab.lib.units import mm
    from reportlab.lib.utils import simpleSplit
    from reportlab.platypus import SimpleDocTemplate

    fonts()
    target = io.BytesIO()
    template = SimpleDocTemplate(
        target, pagesize=A4, leftMargin=MARGIN * mm - PADDING, rightMargin=MARGIN * mm - PADDING, topMargin=MARGIN * mm,
        bottomMargin=(MARGIN + 4) * mm, title=document.title, subject=document.facts, creator="floatframe",
    )  # fmt: skip
    width = A4[0] - 2 * MARGIN * mm
    flow = head(document, width)
    for section in document.sections:
        flow += section_flow(section, width)

    def foot(canvas: Any, _: Any) -> None:
        canvas.saveState()
        canvas.setFont("Report", FOOTER)
        canvas.setFillColor(SOFT)
        lines = simpleSplit(shortened(document.footer, LONGEST_FOOTER), "Report", FOOTER, width - 15 * mm)
        for k, line in enumerate(reversed(lines)):
            canvas.drawString(MARGIN * mm, 10 * mm + 1.2 * FOOTER * k, line)
        canvas.drawRightString(A4[0] - MARGIN * mm, 10 * mm, f"page {canvas.getPageNumber()}")
        canvas.restoreState()

    template.build(flow, onFirstPage=foot, onLaterPages=foot)
    return target.getvalue()


def fonts() -> None:
    """Register the fonts included in matplotlib, which have Greek letters, superscripts and symbols."""
    import matplotlib
    from reportlab.pdfbase import pdfmetrics
    from reportlab.pdfbase.ttfonts import TTFont

    if "Report" in pdfmetrics.getRegisteredFontNames():
        return
    folder = Path(matplotlib.get_data_path()) / "fonts" / "ttf"
    pdfmetrics.registerFont(TTFont("Report", str(folder / "DejaVuSans.ttf")))
    pdfmetrics.registerFont(TTFont("Report-Bold", str(folder / "DejaVuSans-Bold.ttf")))


def words_of(words: str, *, size: float = 8.0, bold: bool = False, color: str = TEXT, right: bool = False) -> Any:
    """Return a paragraph."""
    from reportlab.lib.enums import TA_LEFT, TA_RIGHT
    from reportlab.lib.styles import ParagraphStyle
    from reportlab.platypus import Paragraph as Flowing

    style = ParagraphStyle(
        "words", fontName="Report-Bold" if bold else "Report", fontSize=size, leading=1.3 * size, textColor=color,
        alignment=TA_RIGHT if right else TA_LEFT, wordWrap="LTR", splitLongWords=1,
    )  # fmt: skip
    return Flowing(escape(words).replace("\n", "<br/>"), style)


def head(document: Document, width: float) -> list[Any]:
    """Return title, verdict, facts and signature lines."""
    from reportlab.platypus import Spacer
    from reportlab.platypus import Table as Grid

    told = document.answer
    rows = [[words_of(told.text, size=9)], *([words_of(note, size=8)] for note in told.notes)]
    if told.badge:
        rows.insert(0, [words_of(f"{MARKS[told.verdict]} {told.badge}", size=13, bold=True, color=WORDS[told.verdict])])
    answer = Grid(
        rows,
        colWidths=[width],
        style=[
            ("BACKGROUND", (0, 0), (-1, -1), GROUNDS[told.verdict]),
            ("LINEBEFORE", (0, 0), (0, -1), 3, WORDS[told.verdict]),
            ("LEFTPADDING", (0, 0), (-1, -1), 10), ("TOPPADDING", (0, 0), (-1, 0), 8),
            ("BOTTOMPADDING", (0, -1), (-1, -1), 9),
        ],
    )  # fmt: skip
    flow = [words_of(document.title, size=17, bold=True, color=INK), Spacer(1, 4)]
    flow += [words_of(document.facts, size=8.5, color=SOFT), Spacer(1, 10), answer, Spacer(1, 10)]
    if told.figures:
        flow += [
            Grid(
                [[words_of(value, size=12, bold=True, color=INK) for value, _ in told.figures],
                 [words_of(words, size=7, color=SOFT) for _, words in told.figures]],
                colWidths=column_widths([[(value, 12.0), (words, 7.0)] for value, words in told.figures], width),
                style=[("VALIGN", (0, 0), (-1, -1), "TOP"), ("LEFTPADDING", (0, 0), (-1, -1), 0)],
            ),
            Spacer(1, 8),
        ]  # fmt: skip
    if document.signatures:
        sign = Grid(
            [[words_of(each, size=7, color=SOFT) for each in ("", "name", "date", "signature")]]
            + [[words_of(each, bold=True), "", "", ""] for each in document.signatures],
            colWidths=[0.16 * width, 0.32 * width, 0.2 * width, 0.32 * width],
            rowHeights=[14] + [26] * len(document.signatures),
            style=[("GRID", (0, 1), (-1, -1), 0.6, LINE), ("VALIGN", (0, 0), (-1, -1), "MIDDLE")],
        )
        flow.append(sign)
    return flow


def section_flow(section: Section, width: float) -> list[Any]:
    """Return the blocks of a section; its title stays together with the first block."""
    from reportlab.platypus import CondPageBreak, Spacer

    first = next((block for block in section.blocks if not isinstance(block, Markup)), None)
    is_tall = isinstance(first, Figure | Gallery | Picture)
    flow: list[Any] = [CondPageBreak(330 if is_tall else 110), Spacer(1, 14)]
    flow += [words_of(section.title, size=12.5, bold=True, color=INK), Spacer(1, 5)]
    if section.lead:
        flow += [words_of(section.lead, size=8.5), Spacer(1, 5)]
    for block in section.blocks:
        flow += block_flow(block, width)
    return flow


def block_flow(block: Block, width: float, is_inside: bool = False) -> list[Any]:
    """Return a block as elements of the PDF."""
    from reportlab.platypus import Spacer

    match block:
        case Paragraph():
            return [words_of(block.text, size=7.5 if block.kind == "why" else 8.5), Spacer(1, 5)]
        case Heading():
            return [Spacer(1, 3), words_of(block.text, size=9.5, bold=True, color=INK), Spacer(1, 3)]
        case Terms():
            items = [(Cell(term, "name"), words) for term, words in block.items]
            return table_flow(TextTable(("", ""), items, (0.25, 0.75)), width)
        case Picture():
            return image_flow(block.png, block.share * width, "", block.caption, is_inside)
        case Figure():
            share = 0.5 if width > 400 and any(isinstance(item, Matrix) for item in block.chart.items) else 0.97
            png = chart_png(block.chart, share * width)
            return image_flow(png, share * width, block.title, block.caption, is_inside)
        case Gallery():
            return gallery_flow(block, width)
        case Markup():
            return []
        case TextTable():
            return table_flow(block, width)


def gallery_flow(block: Gallery, width: float) -> list[Any]:
    """Return blocks side by side."""
    from reportlab.platypus import Table as Grid

    n = block.columns
    each = width / n
    cells = [block_flow(inner, each - 8, is_inside=True) for inner in block.blocks]
    cells += [[]] * (-len(cells) % n)
    style = [("VALIGN", (0, 0), (-1, -1), "TOP"), ("LEFTPADDING", (0, 0), (-1, -1), 0)]
    return [Grid([cells[k : k + n]], colWidths=[each] * n, style=style, hAlign="LEFT") for k in range(0, len(cells), n)]


def image_flow(png: bytes, shown: float, title: str, caption: str, is_inside: bool) -> list[Any]:
    """Return a picture with its title and caption, on one page; inside a gallery the row keeps them together."""
    from reportlab.lib.utils import ImageReader
    from reportlab.platypus import Image, KeepTogether, Spacer

    wide, high = ImageReader(io.BytesIO(png)).getSize()
    shown = min(shown, HIGHEST * wide / high)
    parts = [words_of(title, size=9.5, bold=True, color=INK)] if title else []
    parts += [Image(io.BytesIO(png), width=shown, height=shown * high / wide, hAlign="LEFT")]
    parts += [words_of(caption, size=7, color=SOFT), Spacer(1, 6)]
    return parts if is_inside else [KeepTogether(parts)]


def table_flow(block: TextTable, width: float) -> list[Any]:
    """Return a table whose headings repeat on every page."""
    from reportlab.platypus import Spacer
    from reportlab.platypus import Table as Grid

    right = [heading.endswith(">") for heading in block.headings]
    lines: list[list[Any]] = []
    if any(block.headings):
        lines.append(
            [words_of(heading.removesuffix(">"), size=6.8, bold=True, color=SOFT, right=right[k])
             for k, heading in enumerate(block.headings)]
        )  # fmt: skip
    style: list[Any] = [
        ("VALIGN", (0, 0), (-1, -1), "TOP"), ("LINEBELOW", (0, 0), (-1, 0), 0.8, "#b9c2cb"),
        ("LINEBELOW", (0, 1), (-1, -1), 0.4, LINE), ("TOPPADDING", (0, 0), (-1, -1), 2),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 2.5), ("LEFTPADDING", (0, 0), (-1, -1), 3),
        ("RIGHTPADDING", (0, 0), (-1, -1), 3),
    ]  # fmt: skip
    rows = cells_of(block)
    for row in rows:
        i, line = len(lines), []
        for k, cell in enumerate(row):
            kinds = cell.kind.split()
            kind = next((each for each in (cell.badge, *kinds) if each in GROUNDS), "")
            color, bold = WORDS.get(kind, TEXT), bool(kind) or "name" in kinds
            if kind:
                style.append(("BACKGROUND", (k, i), (k, i), GROUNDS[kind]))
            words = words_of(cell.text, size=7, bold=bold, color=color, right=right[k])
            note = words_of(cell.note, size=6.3, color=SOFT, right=right[k] and cell.span == 1)
            line.append([words, note] if cell.note and cell.text else note if cell.note else words)
            if cell.span > 1:
                style.append(("SPAN", (k, i), (k + cell.span - 1, i)))
                line += [""] * (cell.span - 1)
        lines.append(line)
    if not lines:
        return []
    widths = [share * width for share in block.widths] or column_widths(texts_of(block.headings, rows), width)
    grid = Grid(
        lines, colWidths=widths, repeatRows=int(any(block.headings)), style=style,
        hAlign="LEFT",
    )  # fmt: skip
    caption = [words_of(block.caption, size=8, color=TEXT), Spacer(1, 2)] if block.caption else []
    return [*caption, grid, Spacer(1, 7)]


def texts_of(headings: Sequence[str], rows: Sequence[Sequence[Cell]]) -> list[list[tuple[str, float]]]:
    """Return the texts of each column with their font sizes."""
    texts = [[(heading.removesuffix(">"), 6.8)] for heading in headings]
    for row in rows:
        if len(row) == len(headings):
            for k, cell in enumerate(row):
                texts[k] += [(cell.text, 7.0), (cell.note, 6.3)]
    return texts


def column_widths(texts: Sequence[Sequence[tuple[str, float]]], width: float) -> list[float]:
    """Return column widths for texts with their font sizes.

    If every text fits on one line, columns are as wide in proportion. Otherwise each fits its longest word, and the
    remaining width follows the longest texts.
    """
    from reportlab.pdfbase.pdfmetrics import stringWidth

    def wide(words: str, size: float) -> float:
        return float(stringWidth(words, "Report-Bold", size)) + 7.5

    natural = np.array([max(wide(words, size) for words, size in column) for column in texts])
    if natural.sum() <= width:
        return (natural * width / natural.sum()).tolist()
    least = np.array([
        max(wide(word, size) for words, size in column for word in (words.split() or [""])) for column in texts
    ])  # fmt: skip
    if least.sum() >= width:
        return (least * width / least.sum()).tolist()
    more = np.maximum(np.minimum(natural, WIDEST) - least, 0.0) + 1e-3
    return (least + more * (width - least.sum()) / more.sum()).tolist()


# charts ---------------------------------------------------------------------------------------------------------------


STYLES: dict[str, Any] = {
    "solid": "-", "dash": (0, (5, 3)), "dot": (0, (1.2, 1.8)), "dashdot": (0, (5, 2, 1.2, 2)), "longdash": (0, (8, 3)),
    "longdashdot": (0, (8, 3, 1.2, 3)),
}  # fmt: skip
SYMBOLS = {
    "": None, "circle": "o", "square": "s", "diamond": "D", "triangle-up": "^", "cross": "P", "x": "X",
    "triangle-down": "v", "star": "*",
}  # fmt: skip


def chart_png(chart: Chart, width: float) -> bytes:
    """Return a chart as a PNG of this width [points]."""
    from matplotlib.figure import Figure as Drawing

    high = min(max(1.6, chart.height / 110), HIGHEST / 72)
    for item in chart.items:
        if isinstance(item, Matrix):  # square cells, and room for the labels below
            high = min(high, width / 72 * item.values.shape[0] / item.values.shape[1] + 0.5)
    drawing = Drawing(figsize=(width / 72, high), dpi=DPI, layout="constrained")
    panels = list(drawing.subplots(len(chart.panels), 1, sharex=True, squeeze=False)[:, 0])
    for axes, panel in zip(panels, chart.panels, strict=True):
        axes.set_ylabel(panel.label, fontsize=7)
        axes.tick_params(labelsize=7, which="both")
        axes.grid(color="#e3e7eb", linewidth=0.6)
        axes.set_axisbelow(True)
        for side in ("top", "right"):
            axes.spines[side].set_visible(False)
        if panel.is_log:
            axes.set_yscale("log")
        if chart.x.is_log:
            axes.set_xscale("log")
    draw_items(chart, panels)
    for axes, panel in zip(panels, chart.panels, strict=True):
        if panel.range is not None:
            axes.set_ylim(*panel.range)
    if chart.x.range is not None:
        panels[-1].set_xlim(*chart.x.range)
    panels[-1].set_xlabel(chart.x.label, fontsize=7)
    if chart.has_legend or chart.other_label:
        put_legend(drawing, panels)
    target = io.BytesIO()
    drawing.savefig(target, format="png")
    return target.getvalue()


def put_legend(drawing: "Drawing", panels: Sequence["Axes"]) -> None:
    """Draw one legend for all panels above them, with as many columns as fit, at most three."""
    named: dict[str, Any] = {}
    for axes in panels:
        for handle, name in zip(*axes.get_legend_handles_labels(), strict=True):
            named.setdefault(name, handle)
    for n_columns in (3, 2, 1) if named else ():
        legend = drawing.legend(
            list(named.values()), list(named), fontsize=6.5, ncols=n_columns, frameon=False, loc="outside upper left"
        )
        if legend.get_window_extent().width <= drawing.bbox.width or n_columns == 1:
            return
        legend.remove()


def draw_items(chart: Chart, panels: Sequence["Axes"]) -> None:
    """Draw lines, bars or a matrix, and limits."""
    bars = [item for item in chart.items if isinstance(item, Bars)]
    for item in chart.items:
        if isinstance(item, Matrix):
            panels[0].grid(visible=False)
            panels[0].matshow(
                np.asarray(item.values), vmin=0, vmax=1, cmap="Blues",
                extent=(0.5, item.values.shape[1] + 0.5, item.values.shape[0] + 0.5, 0.5),
            )  # fmt: skip
            panels[0].xaxis.tick_bottom()
        elif isinstance(item, Line):
            draw_line(item, panels[item.panel])
    for k, bar in enumerate(bars):
        places = np.arange(len(chart.names)) + (k - (len(bars) - 1) / 2) * 0.8 / len(bars)
        panels[0].bar(places, np.asarray(bar.values, dtype=float), 0.8 / len(bars), color=bar.color, label=bar.name)
        panels[0].set_xticks(np.arange(len(chart.names)), chart.names)
    for limit in chart.limits:
        axes = panels[limit.panel]
        if limit.low is not None:
            axes.axhspan(limit.low, limit.value, color="#9aa5b1", alpha=0.2, linewidth=0)
        else:
            axes.axhline(limit.value, color="#5b6770", linewidth=1, linestyle=(0, (5, 3)))
            across = axes.get_yaxis_transform()
            ground = {"facecolor": "white", "edgecolor": "none", "alpha": 0.8, "pad": 0.6}
            axes.text(1, limit.value, limit.label, transform=across, ha="right", va="bottom", fontsize=6.5, bbox=ground)


def draw_line(line: Line, axes: "Axes") -> None:
    """Draw a line."""
    x, y = np.asarray(line.x, dtype=float), np.asarray(line.y, dtype=float)
    if line.is_hill:
        beside = axes.twinx()
        beside.fill_between(x, y, color="#9aa5b1", alpha=0.22, linewidth=0)
        beside.set_ylim(0, 4 * (float(np.nanmax(y, initial=0.0)) or 1.0))
        beside.set_axis_off()
        return
    draw = partial(axes.step, where="post") if line.is_step else axes.plot
    draw(
        x, y, color=line.color, linewidth=0.6 * line.width, alpha=line.opacity, linestyle=STYLES[line.dash],
        marker=SYMBOLS[line.symbol], markersize=3.2, label=line.name or None,
    )  # fmt: skip
