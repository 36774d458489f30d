import csv
import io
import json
import math
import re
from dataclasses import replace
from html.parser import HTMLParser
from itertools import pairwise

import imageio.v3
import numpy as np
import pytest
from numpy.testing import assert_allclose

import cms
from cms.assessment.compare.compare import compare_sets
from cms.assessment.compare.comparison import SetResult
from cms.assessment.compare.verdicts import DECIDING, crossings
from cms.assessment.quality.limits import LIMITS
from cms.assessment.report import comparison_document, comparison_json
from cms.assessment.report.charts import convergence_chart, deformation_chart, mac_chart, response_chart
from cms.assessment.report.formatting import factor, share, signed_percent
from cms.assessment.report.palette import COLORS, style_of
from fe_models.foundation.documents.html import html_page
from tests.bodies import bar, beam
from tests.cms.browser import browser, opened

SETS = {
    "guyan": {},
    "craig-bampton": {},
    "craig-bampton-ir": {},
    "rubin": {},
    "benfield-hruda": {},  # cannot be made without loads
}


@pytest.fixture(scope="module")
def comparison():
    return compare_sets(cms.couple(bar(nx=8)), SETS, range(0, 13, 3), n_reference=4)


@pytest.fixture(scope="module")
def page(comparison, tmp_path_factory):
    path = tmp_path_factory.mktemp("report") / "comparison.html"
    path.write_text(html_page(comparison_document(comparison, stills=1)), encoding="utf-8")
    return path


class Text(HTMLParser):
    """The words of a page outside scripts and styles."""

    def __init__(self, words):
        super().__init__()
        self.parts, self.skipping = [], False
        self.feed(words)

    def handle_starttag(self, tag, attributes):
        self.skipping = tag in ("script", "style")

    def handle_endtag(self, tag):
        self.skipping = False

    def handle_data(self, data):
        if not self.skipping:
            self.parts.append(data)

    @property
    def words(self):
        return " ".join(" ".join(self.parts).replace("\u00a0", " ").split())


# Numbers -------------------------------------------------------------------------------------------------------------


def test_the_json_has_the_numbers_of_the_records(comparison):
    written = json.loads(comparison_json(comparison))
    assert written["format"] == "cms-comparison"
    assert written["answer"] == comparison.sentence
    assert written["ranking"] == list(comparison.ranking)
    assert_allclose(written["full_model"]["frequencies_hz"], comparison.full.frequencies_hz, rtol=0)
    for result, found in zip(comparison.sets, written["sets"], strict=True):
        assert (found["name"], found["verdict"], found["sentence"]) == (result.name, result.verdict, result.sentence)
        for point, row in zip(result.points, found["points"], strict=True):
            assert (row["n_modes"], row["n_coordinates"], row["is_good"]) == (point.n_modes, point.n_q, point.is_good)
            for record, plain in zip(point.records, row["records"], strict=True):
                assert plain["value"] == (record.value if math.isfinite(record.value) else None)
                assert plain["verdict"] == record.verdict
                assert plain["tolerance"] == LIMITS[record.name].tolerance


def test_the_csv_has_one_row_a_point_with_the_numbers_of_the_records(comparison):
    rows = list(csv.DictReader(io.StringIO(comparison.to_table().content(".csv").decode())))
    points = [(result, point) for result in comparison.sets for point in result.points]
    failed = [row for row in rows if not row["n_modes"]]
    assert [row["set"] for row in failed] == ["benfield-hruda"]
    assert failed[0]["verdict"].startswith("could not be made: ")
    for row, (result, point) in zip([row for row in rows if row["n_modes"]], points, strict=True):
        assert (row["set"], int(row["n_modes"]), int(row["n_coordinates"])) == (result.name, point.n_modes, point.n_q)
        for record in point.records:
            expected = record.value if math.isfinite(record.value) else None
            assert (float(row[record.name]) if row[record.name] else None) == expected


def test_only_the_shown_points_carry_curves(comparison):
    for result in comparison.sets:
        for point in result.points:
            has_curves = "drawn" in point.record("frequency-response").data
            assert has_curves == (point is result.detail)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        (0.0, "0"), (0.0123, "1.2 %"), (0.5, "50 %"), (1.554, "155 %"), (3e-7, "3·10⁻⁷"), (math.inf, "missing"),
        (math.nan, "–"), (25.0, "25"), (1e8, "1.0·10⁸"), (1e-4, "0.01 %"),
    ],
)  # fmt: skip
def test_numbers_without_unit_read_as_percent_or_powers_of_ten(value, words):
    assert share(value) == words


@pytest.mark.parametrize(
    ("value", "words"), [(0.0044, "+0.44 %"), (-0.12, "−12 %"), (1e-9, "0 %"), (math.nan, "–"), (2e-6, "+0.0002 %")]
)
def test_errors_of_frequencies_carry_their_sign(value, words):
    assert signed_percent(value) == words


def test_condition_numbers_read_short():
    assert [factor(x) for x in (1.0, 57.25, 123456.0, math.inf)] == ["1", "57.2", "1.2·10⁵", "∞"]


# Charts --------------------------------------------------------------------------------------------------------------


def test_convergence_charts_draw_the_values_of_the_records(comparison):
    for name in DECIDING:
        for line in convergence_chart(comparison, name).items:
            result = comparison.set(line.name)
            finite = [p for p in result.points if math.isfinite(p.record(name).value)]
            assert line.x == [p.n_modes for p in finite]
            assert [note.split("\n")[1] for note in line.notes] == [f"{p.record(name).value:.3g}" for p in finite]
            drawn, values = np.array(line.y), np.array([p.record(name).value for p in finite])
            assert_allclose(drawn[drawn > drawn.min()], values[drawn > drawn.min()], rtol=0)


def test_curves_are_those_of_the_records(comparison):
    full, *sets = response_chart(comparison).items
    assert_allclose(full.y, comparison.full.response, rtol=0)
    shown = [r for r in comparison.sets if r.detail is not None]
    for line, result in zip(sets, shown, strict=True):
        assert_allclose(line.y, result.detail.record("frequency-response").data["drawn"], rtol=0)
    for line, result in zip(deformation_chart(comparison).items[1:], shown, strict=True):
        error = result.detail.record("deformation-error").data["error"]["K"]
        assert_allclose(line.y, np.maximum(error, 1e-10), rtol=0)
    result = comparison.set("rubin")
    (matrix,) = mac_chart(result, result.detail, comparison.full.frequencies_hz).items
    drawn = matrix.values
    assert_allclose(drawn, result.detail.record("mac").data["mac"][:, : drawn.shape[1]], rtol=0)


def test_sets_differ_in_more_than_colour():
    styles = [style_of(k) for k in range(len(COLORS))]
    assert len({s.color for s in styles}) == len({s.symbol for s in styles}) == len(styles)
    assert all(a.dash != b.dash for a, b in pairwise(styles))


# Page ----------------------------------------------------------------------------------------------------------------


def test_the_page_says_what_the_comparison_says(comparison, page):
    words = Text(page.read_text(encoding="utf-8")).words
    assert comparison.sentence in words
    for result in comparison.sets:
        assert result.sentence[1:].removesuffix(".") in words
        assert result.name in words
    for k in range(comparison.full.n_band):
        assert f"{comparison.full.frequencies_hz[k]:.5g}" in words
    assert LIMITS["mac"].action in words


def test_verdicts_stand_before_anything_else(page):
    text = page.read_text(encoding="utf-8")
    order = re.findall(r'<section id="([a-z-]+)"', text)
    assert order[0] == "verdicts"
    assert text.index('class="answer') < text.index('id="verdicts"')
    assert re.findall(r'<a href="#([a-z-]+)"', text) == order


def test_the_page_shows_only_what_was_judged(comparison):
    tables = html_page(comparison_document(comparison, stills=0)).split('id="method"')[0]
    assert all(point.record("static-load-cases").verdict == "info" for point in shown_points(comparison))
    assert "load cases" not in tables.lower()
    assert "No set has this number" not in tables


def test_no_set_is_said_to_keep_a_limit_that_its_number_exceeds(comparison):
    caption = crossings(comparison.sets, "effective-mass")
    within, _, not_judged = caption.partition("not judged: ")
    last = {result.name: result.points[-1].record("effective-mass") for result in comparison.sets if result.points}
    over = [name for name, record in last.items() if record.value > record.tolerance and record.verdict == "info"]
    assert over, "the bar has a set that answers statically and leaves out mass"
    assert not any(name in re.findall(r"[a-z-]+", within) for name in over)
    assert all(name in not_judged for name in over)


def shown_points(comparison):
    return [result.detail for result in comparison.sets if result.detail is not None]


def test_the_page_holds_all_it_needs(page):
    text = page.read_text(encoding="utf-8")
    assert not re.search(r'<(?:script|link|img|iframe)[^>]+(?:src|href)="(?!data:)', text)
    assert "@import" not in text.split("</style>")[0]


def test_names_cannot_break_the_page(comparison):
    name = "</script><script>alert(1)</script><b>&'\""
    first, *others = comparison.sets
    worse = replace(comparison, name=name, sets=(replace(first, sentence=name), *others))
    text = html_page(comparison_document(worse, stills=0))
    assert "<script>alert" not in text
    assert "</script><script>" not in text.replace("</script>\n<script>", "").replace("</script>\n", "")
    assert name in Text(text).words


def test_a_comparison_in_which_no_set_could_be_made_is_still_a_report(comparison):
    failed = SetResult("rubin", "words", (), None, "error", "could not be made: <no reason>")
    nothing = replace(comparison, sets=(failed,), ranking=(), sentence="No mode set could be made.")
    words = Text(html_page(comparison_document(nothing, stills=0))).words
    assert "Could not be made: <no reason>." in words
    assert "there is nothing to show here" in words
    assert json.loads(comparison_json(nothing))["sets"][0]["points"] == []


def read_image(path):
    return imageio.v3.imread(path)[..., :3]


# In a browser --------------------------------------------------------------------------------------------------------


def ink(view, path):
    """Pixels of the 3D view that are not its background of the same row."""
    view.query_selector("#viewer canvas").screenshot(path=str(path))
    image = read_image(path).astype(int)
    return int((np.abs(image - image[:, :1]).max(axis=2) > 40).sum())


WITHOUT_WEBGL = """
const get = HTMLCanvasElement.prototype.getContext;
HTMLCanvasElement.prototype.getContext = function (kind, ...rest) {
  return kind.startsWith("webgl") ? null : get.call(this, kind, ...rest);
};
"""


@pytest.fixture(scope="module")
def started():
    with browser() as program:
        yield program


@pytest.fixture(scope="module")
def view(started, page):
    """The page in the browser; the tests use it one after the other, and leave it as it was."""
    shown, complaints = opened(started, page)
    shown.wait_for_selector("#viewer[data-ready]")
    yield shown
    assert complaints.errors == complaints.requests == []


def test_the_page_opens_offline_and_shows_every_chart(view, page, tmp_path):
    text = page.read_text(encoding="utf-8")
    charts = json.loads(re.search(r'id="charts">(.*?)</script>', text, re.DOTALL).group(1))["charts"]
    drawn = view.evaluate("[...document.querySelectorAll('.chart:has(.drawing)')].map((c) => c.id)")
    assert sorted(drawn) == sorted(charts)
    assert view.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert view.evaluate("[...document.images].map(i => i.naturalWidth)") == [900]
    view.screenshot(path=str(tmp_path / "page.png"))
    image = read_image(tmp_path / "page.png")
    assert image.shape[:2] == (900, 1360)
    assert len(np.unique(image.reshape(-1, 3), axis=0)) > 300


def test_mode_shapes_turn_change_and_move(view, tmp_path):
    canvas = view.query_selector("#viewer canvas")
    canvas.scroll_into_view_if_needed()
    assert ink(view, tmp_path / "first.png") > 3000
    box = canvas.bounding_box()
    states = [canvas.screenshot()]
    view.mouse.move(box["x"] + 300, box["y"] + 200)
    view.mouse.down()
    view.mouse.move(box["x"] + 420, box["y"] + 260, steps=4)
    view.mouse.up()
    states.append(canvas.screenshot())
    view.click("#viewer .list button:nth-child(3)")
    states.append(canvas.screenshot())
    view.click("[data-do=play]")
    view.wait_for_timeout(300)
    states.append(canvas.screenshot())
    view.click("[data-do=play]")
    view.click("[data-do=reset]")
    view.click("#viewer .list button:nth-child(1)")
    assert ink(view, tmp_path / "again.png") == ink(view, tmp_path / "first.png")
    assert len(set(states)) == len(states)


def test_the_switch_puts_coordinates_across(comparison, view):
    across = "(d => d.lines.map(line => d.across(line)))(document.getElementById('chart-mac').drawing)"
    by_modes = [[p.n_modes for p in r.points] for r in comparison.sets if r.points]
    assert view.evaluate(across) == by_modes
    view.click(".switch button:nth-child(2)")
    assert view.evaluate(across) == [[p.n_q for p in r.points] for r in comparison.sets if r.points]
    view.click(".switch button:nth-child(1)")
    assert view.evaluate(across) == by_modes


def test_the_page_fits_a_narrow_screen_and_paper(view, tmp_path):
    view.set_viewport_size({"width": 600, "height": 900})
    view.wait_for_function("document.documentElement.scrollWidth <= window.innerWidth")
    view.wait_for_function("[...document.querySelectorAll('.chart svg.drawing')].every(s => s.clientWidth < 600)")
    view.pdf(path=str(tmp_path / "report.pdf"), format="A4", print_background=True)
    view.set_viewport_size({"width": 1360, "height": 900})
    assert (tmp_path / "report.pdf").read_bytes().startswith(b"%PDF")


def test_paper_has_full_charts_no_tools_and_headings_beside_them(view):
    """On A4 nothing is wider than the page, charts fill their column, and no heading stands alone."""
    shown = view
    shown.set_viewport_size({"width": 695, "height": 1000})  # 184 mm between the margins
    shown.emulate_media(media="print")
    shown.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    shown.wait_for_function(
        "[...document.querySelectorAll('.chart .drawing')].every((s) => s.getBoundingClientRect().width <= 696)"
    )
    assert shown.evaluate("document.documentElement.scrollWidth") == 695
    charts = shown.evaluate(
        "[...document.querySelectorAll('.chart')].filter((c) => c.querySelector('.drawing')).map((c) => ["
        "c.querySelector('.drawing').getBoundingClientRect().width, c.parentElement.getBoundingClientRect().width])"
    )
    assert len(charts) > 8
    for drawn, column in charts:
        assert 0.96 * column <= drawn <= column + 1
    style = "(selector, name) => [...document.querySelectorAll(selector)].map((e) => getComputedStyle(e)[name])"
    for selector in ("h2", "h3", "p.lead", "ul.legend"):
        assert set(shown.evaluate(f"([s, n]) => ({style})(s, n)", [selector, "breakAfter"])) == {"avoid"}
    assert set(shown.evaluate(f"([s, n]) => ({style})(s, n)", ["figure", "breakInside"])) == {"avoid"}
    assert set(shown.evaluate(f"([s, n]) => ({style})(s, n)", [".save", "display"])) == {"none"}


def test_the_tools_of_a_chart_lie_on_no_legend(view):
    shown = view
    shown.set_viewport_size({"width": 1360, "height": 900})
    shown.emulate_media(media="screen")
    shown.evaluate("window.dispatchEvent(new Event('afterprint'))")
    shown.wait_for_function("document.querySelector('#response .drawing').getBoundingClientRect().width > 700")
    tools = "document.querySelector('#response .save').getBoundingClientRect().left"
    legend = "[...document.querySelectorAll('#response .keys')[0].children].slice(0, -1)"
    ends = f"Math.max(...{legend}.map((key) => key.getBoundingClientRect().right))"
    assert shown.evaluate(f"{tools} > {ends}")


def test_a_body_of_beams_is_drawn_by_lines_and_a_browser_without_webgl_is_told(started, tmp_path):
    result = compare_sets(cms.couple(beam(n=6)), ["craig-bampton"], [2], n_reference=2)
    path = tmp_path / "beam.html"
    path.write_text(html_page(comparison_document(result, stills=0)), encoding="utf-8")
    shown, complaints = opened(started, path)
    shown.wait_for_selector("#viewer[data-ready]")
    assert ink(shown, tmp_path / "lines.png") > 200
    shown.add_init_script(WITHOUT_WEBGL)
    shown.reload()
    shown.wait_for_selector("#no-webgl:not([hidden])")
    assert not shown.is_visible("#viewer")
    assert complaints.errors == complaints.requests == []
