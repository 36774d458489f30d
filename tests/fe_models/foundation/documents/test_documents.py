"""Documents as pages, as PDF and as JSON: every block, names that would break a page, and charts in a browser."""

import base64
import json
import re
import zlib
from dataclasses import replace
from html import unescape

import numpy as np
import pytest
from matplotlib.figure import Figure as Drawing
from reportlab.lib.pagesizes import A4
from reportlab.pdfbase.pdfmetrics import stringWidth
from reportlab.pdfgen.canvas import Canvas

from fe_models.foundation.documents.charts import Axis, Bars, Chart, LimitLine, Line, Matrix, chart_record, thinned
from fe_models.foundation.documents.document import (
    Answer,
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
)
from fe_models.foundation.documents.html import html_page
from fe_models.foundation.documents.pdf import FOOTER, pdf_pages, put_legend
from fe_models.foundation.documents.write import document_content, write_document
from fe_models.foundation.errors import TableError
from tests.cms.browser import browser, opened

NASTY = "</script><script>alert(1)</script><b>&'\""
X = np.linspace(0.0, 2.0, 41)


def png() -> bytes:
    """A white picture of one pixel."""

    def chunk(kind: bytes, data: bytes) -> bytes:
        return len(data).to_bytes(4, "big") + kind + data + zlib.crc32(kind + data).to_bytes(4, "big")

    head = chunk(b"IHDR", (1).to_bytes(4, "big") * 2 + bytes([8, 2, 0, 0, 0]))
    return b"\x89PNG\r\n\x1a\n" + head + chunk(b"IDAT", zlib.compress(bytes(1) + b"\xff" * 3)) + chunk(b"IEND", b"")


def lines(*, n: int = 1) -> Chart:
    y = np.where(X == X[7], np.nan, np.exp(-X) * np.cos(9 * X))
    items = [Line(X, y + k, "tip", "#0072B2", panel=k, symbol="star" if k else "") for k in range(n)]
    items += [Line(X, np.abs(X), "force", is_hill=True), Line(X, X, "step", dash="dot", is_step=True)]
    limits = (LimitLine(0.5, "limit 50 %"), LimitLine(0.2, low=-0.2))
    return Chart(Axis("time [s]"), tuple(Axis(f"u\n[m{k}]") for k in range(n)), tuple(items), limits=limits)


def document(name: str = "rod") -> Document:
    bars = Chart(Axis("direction"), (Axis("mass [%]"),), (Bars([1, np.nan, 3], "a", "#009E73"),), names=("x", "y", "z"))
    matrix = Chart(Axis("to"), (Axis("from"),), (Matrix(np.eye(3), "mode", "mode", ("5 Hz", "", "")),))
    logs = Chart(
        Axis("f [Hz]", is_log=True), (Axis("H", is_log=True),), (Line(X + 0.1, X**4, name),), other_label="coordinates"
    )
    blocks = [
        Paragraph(f"{name} fits to 5 %."), Paragraph("Careful.", "notice"), Heading("Numbers"),
        TextTable(
            ("mode>", "what", ""),
            [("1", "first\nnote below", "pass"), [Cell("2", "n"), Cell(name, "name", line=("#0072B2", "dot")),
             Cell("fails", badge="fail")], [Cell("", note="why it fails", span=3)]], verdict=2, caption="All modes.",
        ),
        Picture(png(), "One pixel.", 0.5), Terms([("mass", name)]),
        Gallery([Figure("one", lines(), "Curves.", "Motion"), Figure("two", bars, "Bars.")]),
        Gallery([Figure("three", matrix, "MAC."), Figure("four", logs, "Log.")], 3),
        Figure("five", lines(n=3), "Panels."), Markup("<i>only a page</i>", "window.seen = 1;", {"shapes": '"<"'}),
    ]  # fmt: skip
    answer = Answer(f"{name} holds.", "warn", "with reservations", [("7 %", "error")], ["Look at it."])
    sections = [Section("first", "What it is", blocks, f"About {name}.", "It"), Section("second", "Nothing", ())]
    return Document(f"Report of {name}", "3 modes", answer, sections, name, "test", ("checked",), "made today")


def words_of(page: str) -> str:
    body = re.sub(r"<(script|style).*?</\1>", "", page, flags=re.DOTALL)
    return unescape(re.sub(r"<[^>]*>", "", body)).replace("\xa0", " ")


def test_a_page_says_everything_and_needs_nothing():
    page = html_page(document())
    words = words_of(page)
    for told in ("rod fits to 5 %.", "note below", "why it fails", "with reservations", "checked", "Look at it.", "It",
                 "One pixel.", "About rod.", "made today", "fails", "All modes."):  # fmt: skip
        assert told in words
    assert not re.search(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="(?!data:)', page)
    assert len(page) < 80_000
    data = json.loads(re.search(r'id="charts">(.*?)</script>', page, re.DOTALL)[1])
    assert sorted(data["charts"]) == sorted(("one", "two", "three", "four", "five"))
    line = data["charts"]["one"]["items"][0]
    x, y = (np.frombuffer(base64.b64decode(data["arrays"][line[name]]), "<f4") for name in ("x", "y"))
    np.testing.assert_array_equal(np.isnan(y), np.arange(len(X)) == 7)
    np.testing.assert_allclose(x, X, rtol=1e-6, atol=0)
    assert len(data["arrays"]) == len(set(data["arrays"]))


def test_a_page_without_charts_carries_no_drawing():
    found = document()
    plain = replace(found, sections=[Section("a", "A", (Paragraph("b"),))])
    assert 'id="charts"' not in html_page(plain)
    assert len(html_page(plain)) < 20_000


def test_names_cannot_break_a_page():
    page = html_page(document(NASTY))
    assert "<script>alert" not in page
    assert NASTY in words_of(page)
    assert page.count("<script") == html_page(document()).count("<script")


@pytest.mark.parametrize("n", [1, 14])
def test_a_pdf_holds_all_blocks_however_high(n):
    found = document(NASTY)
    tall = Section("tall", "Panels", (Figure("tall", replace(lines(n=n), height=160 * n), "Many."),))
    content = pdf_pages(replace(found, sections=[*found.sections, tall]))
    assert content.startswith(b"%PDF")
    assert len(content) > 20_000


def test_the_legend_of_a_printed_chart_lists_each_name_once_and_is_not_cut():
    names = ("mean acceleration x, 5.27 g rms", "input foot:x", "mirror acceleration x, 23.9 g rms")
    drawing = Drawing(figsize=(3.4, 3.0), layout="constrained")
    panels = list(drawing.subplots(2, 1))
    for axes, shown in zip(panels, (names[:2], names[1:]), strict=True):
        for name in shown:
            axes.plot([0, 1], [0, 1], label=name)
    put_legend(drawing, panels)
    drawing.draw_without_rendering()
    (legend,) = drawing.legends
    assert [words.get_text() for words in legend.get_texts()] == list(names)
    box = legend.get_window_extent()
    assert box.x0 >= 0
    assert box.x1 <= drawing.bbox.width


def test_a_long_footer_is_printed_whole(monkeypatch):
    drawn = []
    monkeypatch.setattr(Canvas, "drawString", lambda _, x, y, words: drawn.append((y, x, words)))
    footer = f"/parts/bar.h5, digest {64 * '0'}; made 2026-01-01T12:00 by cms accept, with limits of a customer."
    pdf_pages(Document("bar", "one bar", Answer("It holds."), (), footer=footer))
    assert " ".join(words for *_, words in sorted(drawn, reverse=True)) == footer
    assert all(x + stringWidth(words, "Report", FOOTER) < A4[0] - 2 * x for _, x, words in drawn)


def test_json_holds_text_tables_and_charts():
    record = json.loads(document_content(document(), ".json"))
    blocks = record["sections"][0]["blocks"]
    assert blocks[3]["rows"][0] == ["1", "first\nnote below", "pass"]
    assert blocks[8]["chart"]["items"][0]["x"][:2] == [0, 0.05]


def test_long_lines_keep_their_peaks():
    x = np.linspace(0, 1, 100_001)
    y = np.sin(500 * x)
    y[[77, 54321]] = 9.0, -7.0
    short = thinned(Line(x, y), 400)
    assert len(np.asarray(short.x)) <= 400
    assert np.max(short.y) == 9.0
    assert np.min(short.y) == -7.0
    assert np.isin(short.x, x).all()


def test_numbers_of_a_chart_are_short():
    record = chart_record(Chart(Axis(), (Axis(),), (Line([1 / 3, 2.0], [np.inf, 1e-12 / 3]),)))
    assert record["items"][0]["x"] == [0.333333, 2]
    assert record["items"][0]["y"] == [None, 3.33333e-13]


@pytest.fixture(scope="module")
def view(tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "page.html"
    path.write_text(html_page(document()), encoding="utf-8")
    with browser() as program:
        shown, complaints = opened(program, path)
        yield shown
    assert complaints.errors == complaints.requests == []


def test_charts_are_drawn_read_zoomed_and_hidden(view):
    ready = "[...document.querySelectorAll('.chart')].every((box) => box.querySelector('.drawing').children.length > 5)"
    assert view.evaluate(ready)
    assert view.evaluate("window.seen") == 1
    view.locator("#one").scroll_into_view_if_needed()
    box = view.locator("#one .drawing").bounding_box()
    x, y, _ = view.evaluate("document.getElementById('one').drawing.lines[0].points[19]")
    view.mouse.move(box["x"] + x, box["y"] + y)
    tip = view.locator("#one .tip").inner_text()
    assert tip.startswith("tip\n1: ")
    assert float(tip.split(": ")[1]) == pytest.approx(np.exp(-1) * np.cos(9), rel=1e-3)
    before = view.evaluate("document.getElementById('one').drawing.x.range")
    view.mouse.move(box["x"] + 150, box["y"] + 60)
    view.mouse.down()
    view.mouse.move(box["x"] + 260, box["y"] + 60, steps=3)
    view.mouse.up()
    low, high = view.evaluate("document.getElementById('one').drawing.x.range")
    assert before[0] < low < high < before[1]
    view.mouse.dblclick(box["x"] + 200, box["y"] + 60)
    assert view.evaluate("document.getElementById('one').drawing.x.range") == before
    paths = "document.querySelectorAll('#one .drawing g path').length"
    n = view.evaluate(paths)
    view.click("#one .keys button:nth-child(1)")
    assert view.evaluate(paths) == n - 1
    view.click("#one .keys button:nth-child(1)")
    assert view.evaluate(paths) == n


def test_a_page_is_dark_where_the_reader_wants_it_and_fits_paper(view):
    ground = "getComputedStyle(document.body).backgroundColor.match(/[0-9]+/g).map(Number)"
    assert min(view.evaluate(ground)) > 230
    view.emulate_media(color_scheme="dark")
    assert max(view.evaluate(ground)) < 40
    view.emulate_media(media="print", color_scheme="dark")
    assert min(view.evaluate(ground)) > 230
    view.emulate_media(media="screen", color_scheme="light")
    view.set_viewport_size({"width": 420, "height": 800})
    view.wait_for_function("document.documentElement.scrollWidth <= window.innerWidth")


def test_a_document_is_written_by_its_ending_or_refused(tmp_path):
    for suffix in (".html", ".pdf", ".json"):
        path = write_document(document(), tmp_path / f"rod{suffix}")
        assert path.read_bytes()[:400] == document_content(document(), suffix)[:400]
    with pytest.raises(TableError, match=r"rod\.htm: unknown ending '\.htm'.*did you mean '\.html'"):
        write_document(document(), tmp_path / "rod.htm")
    with pytest.raises(TableError, match="cannot be written"):
        write_document(document(), tmp_path / "missing" / "rod.html")
