"""Write an acceptance as PDF, HTML or JSON, by the suffix of the file."""

import io
import json
from pathlib import Path
from typing import Any
from xml.sax.saxutils import escape

from cms.assessment.quality.errors import QualityError
from cms.jobs.acceptance.acceptance import Acceptance
from cms.jobs.acceptance.document import Document, Paragraph, Part, Picture, Table, document_of
from cms.jobs.acceptance.html_page import MARKS, html_page, verdict_kind
from fe_models.foundation.extras import extra_module
from fe_models.foundation.paths import replace_files

__all__ = ["SUFFIXES", "pdf_pages", "write_acceptance"]


SUFFIXES = (".pdf", ".html", ".json")


def write_acceptance(acceptance: Acceptance, *paths: str | Path) -> None:
    """Write one or several forms of an acceptance, all complete or none.

    Raises
    ------
    QualityError
        If a suffix is not .pdf, .html or .json, or a file cannot be written.
    MissingExtraError
        If a PDF is wanted and reportlab (extra `pdf`) is not installed.
    """
    targets = [Path(path) for path in paths]
    for target in targets:
        require_suffix(target)
    document = document_of(acceptance) if any(target.suffix.lower() != ".json" for target in targets) else None
    contents = {}
    for target in targets:
        if target.suffix.lower() == ".json" or document is None:
            contents[target] = (json.dumps(acceptance.as_dict(), indent=2) + "\n").encode()
        elif target.suffix.lower() == ".html":
            contents[target] = html_page(document).encode()
        else:
            contents[target] = pdf_pages(document)
    try:
        replace_files(contents)
    except OSError as error:
        raise QualityError(
            f"acceptance: cannot be written: {error.strerror or error}; check folder and space"
        ) from error


def require_suffix(path: Path) -> None:
    """Raise `QualityError` unless the suffix is one of `SUFFIXES`."""
    if path.suffix.lower() not in SUFFIXES:
        raise QualityError(
            f"{path}: an acceptance is written as {', '.join(SUFFIXES)}; got {path.suffix or 'no suffix'}"
        )


# the document of an acceptance as a PDF on A4, with page numbers and lines to sign ------------------------------------


INK, TEXT, SOFT, LINE = "#1b1f24", "#3d4650", "#66727e", "#dde2e7"
GROUNDS = {"pass": "#e4f3ec", "warn": "#fdf1dd", "fail": "#fbe8e3", "info": "#eef1f4"}
WORDS = {"pass": "#0a6b4d", "warn": "#8a5300", "fail": "#a32a12", "info": "#66727e"}
MARGIN = 15.0  #: [mm]


def pdf_pages(document: Document) -> bytes:
    """Return the PDF.

    Raises
    ------
    MissingExtraError
        If reportlab (extra `pdf`) is not installed.
    """
    extra_module("reportlab", extra="pdf", purpose="write a document as PDF")
    from reportlab.lib.pagesizes import A4
    from reportlab.lib.units import mm
    from reportlab.platypus import SimpleDocTemplate

    fonts()
    target = io.BytesIO()
    template = SimpleDocTemplate(
        target, pagesize=A4, leftMargin=MARGIN * mm, rightMargin=MARGIN * mm, topMargin=MARGIN * mm,
        bottomMargin=(MARGIN + 4) * mm, title=document.title, subject=document.subtitle, creator="cms accept",
    )  # fmt: skip
    width = A4[0] - 2 * MARGIN * mm
    flow = head(document, width)
    for k, part in enumerate(document.parts, 1):
        flow += section(part, k, width)

    def foot(canvas: Any, _: Any) -> None:
        canvas.saveState()
        canvas.setFont("Report", 6.5)
        canvas.setFillColor(SOFT)
        words = document.footer if len(document.footer) < 150 else f"{document.footer[:147]}..."
        canvas.drawString(MARGIN * mm, 10 * mm, words)
        canvas.drawRightString(A4[0] - MARGIN * mm, 10 * mm, f"page {canvas.getPageNumber()}")
        canvas.restoreState()

    template.build(flow, onFirstPage=foot, onLaterPages=foot)
    return target.getvalue()


def fonts() -> None:
    """Register the fonts that matplotlib ships: they have Greek letters, exponents and signs."""
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
    """Return title, verdict, figures and the lines to sign."""
    from reportlab.platypus import Spacer
    from reportlab.platypus import Table as Grid

    mark = f"{MARKS[document.verdict]} {document.verdict_words}"
    answer = Grid(
        [[words_of(mark, size=13, bold=True, color=WORDS[document.verdict])], [words_of(document.answer, size=9)]],
        colWidths=[width],
        style=[
            ("BACKGROUND", (0, 0), (-1, -1), GROUNDS[document.verdict]),
            ("LINEBEFORE", (0, 0), (0, -1), 3, WORDS[document.verdict]),
            ("LEFTPADDING", (0, 0), (-1, -1), 10), ("TOPPADDING", (0, 0), (-1, 0), 8),
            ("BOTTOMPADDING", (0, -1), (-1, -1), 9),
        ],
    )  # fmt: skip
    n = len(document.figures)
    figures = Grid(
        [[words_of(value, size=12, bold=True, color=INK) for value, _ in document.figures],
         [words_of(words, size=7, color=SOFT) for _, words in document.figures]],
        colWidths=[width / n] * n,
        style=[("VALIGN", (0, 0), (-1, -1), "TOP"), ("LEFTPADDING", (0, 0), (-1, -1), 0)],
    )  # fmt: skip
    sign = Grid(
        [[words_of(each, size=7, color=SOFT) for each in ("", "name", "date", "signature")]]
        + [[words_of(each, bold=True), "", "", ""] for each in document.signatures],
        colWidths=[0.16 * width, 0.32 * width, 0.2 * width, 0.32 * width],
        rowHeights=[14] + [26] * len(document.signatures),
        style=[("GRID", (0, 1), (-1, -1), 0.6, LINE), ("VALIGN", (0, 0), (-1, -1), "MIDDLE")],
    )
    return [
        words_of(document.title, size=17, bold=True, color=INK),
        Spacer(1, 4),
        words_of(document.subtitle, size=8.5, color=SOFT),
        Spacer(1, 10),
        answer,
        Spacer(1, 10),
        figures,
        Spacer(1, 8),
        sign,
    ]


def section(part: Part, k: int, width: float) -> list[Any]:
    """Return the blocks of a part; its title is kept together with the first of them."""
    from reportlab.platypus import CondPageBreak, Spacer

    flow: list[Any] = [CondPageBreak(110), Spacer(1, 14)]
    flow += [words_of(f"{k}. {part.title}", size=12.5, bold=True, color=INK), Spacer(1, 5)]
    for block in part.blocks:
        if isinstance(block, Paragraph):
            flow += [words_of(block.words, size=8.5), Spacer(1, 5)]
        elif isinstance(block, Picture):
            flow += picture(block, width)
        else:
            flow += table(block, width)
    return flow


def picture(block: Picture, width: float) -> list[Any]:
    """Return a picture with its caption, on one page."""
    from reportlab.lib.utils import ImageReader
    from reportlab.platypus import Image, KeepTogether, Spacer

    wide, high = ImageReader(io.BytesIO(block.png)).getSize()
    shown = block.share * width
    image = Image(io.BytesIO(block.png), width=shown, height=shown * high / wide, hAlign="LEFT")
    return [KeepTogether([image, words_of(block.caption, size=7, color=SOFT)]), Spacer(1, 6)]


def table(block: Table, width: float) -> list[Any]:
    """Return a table whose headings are repeated on every page."""
    from reportlab.platypus import Spacer
    from reportlab.platypus import Table as Grid

    right = [heading.endswith(">") for heading in block.headings]
    cells = [
        [words_of(heading.removesuffix(">"), size=6.8, bold=True, color=SOFT, right=right[k])
         for k, heading in enumerate(block.headings)]
    ]  # fmt: skip
    style: list[Any] = [
        ("VALIGN", (0, 0), (-1, -1), "TOP"), ("LINEBELOW", (0, 0), (-1, 0), 0.8, "#b9c2cb"),
        ("LINEBELOW", (0, 1), (-1, -1), 0.4, LINE), ("TOPPADDING", (0, 0), (-1, -1), 2),
        ("BOTTOMPADDING", (0, 0), (-1, -1), 2.5), ("LEFTPADDING", (0, 0), (-1, -1), 3),
        ("RIGHTPADDING", (0, 0), (-1, -1), 3),
    ]  # fmt: skip
    for i, row in enumerate(block.rows, start=1):
        line = []
        for k, words in enumerate(row):
            color, bold = TEXT, k == 0 and block.verdict != 0 and not right[0]
            if block.verdict == k and words:
                kind = verdict_kind(words)
                style.append(("BACKGROUND", (k, i), (k, i), GROUNDS[kind]))
                color, bold = WORDS[kind], True
            line.append(words_of(words, size=7, bold=bold, color=color, right=right[k]))
        cells.append(line)
    grid = Grid(cells, colWidths=[share * width for share in block.widths], repeatRows=1, style=style, hAlign="LEFT")
    caption = [words_of(block.caption, size=8, color=TEXT), Spacer(1, 2)] if block.caption else []
    return [*caption, grid, Spacer(1, 7)]
