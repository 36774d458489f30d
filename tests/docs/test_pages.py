"""The pages of the site as a whole: every page has one kind, kinds keep their size, links hold, versions agree."""

import re
import tomllib

import pytest

from tests.root import ROOT

DOCS = ROOT / "docs"
KINDS = ("learn", "howto", "lookup", "explanation", "evidence")
#: most words of the pages of a kind that are written by hand, code included
MOST_WORDS = {"learn": 15_050, "howto": 27_500, "lookup": 16_500, "explanation": 25_500, "evidence": 45_500}
MADE = {"figures"}  #: pages that a command writes
PAGES = sorted(path for path in DOCS.glob("*.md") if path.stem not in {"index", *KINDS})
#: anchors that any page may name without its file
LABELS = {name for path in PAGES for name in re.findall(r"^\(([\w-]+)\)=$", path.read_text(), re.MULTILINE)}
SECTION = re.compile(r"^#{1,6} +(.+?) *$", re.MULTILINE)


def members(kind):
    """Return the pages that the page of a kind lists."""
    text = (DOCS / f"{kind}.md").read_text()
    blocks = re.findall(r"```\{toctree\}\n(.*?)```", text, re.DOTALL)
    return [line.strip() for block in blocks for line in block.splitlines() if line.strip() and line[0] != ":"]


def anchors(text):
    """Return the anchors of a page: of its headings, and those that it sets."""
    prose = re.sub(r"```.*?```", "", text, flags=re.DOTALL)
    named = [re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in SECTION.findall(prose)]
    return {*named, *re.findall(r"^\(([\w-]+)\)=$", text, re.MULTILINE)}


def test_every_page_belongs_to_one_kind():
    listed = [page for kind in KINDS for page in members(kind)]
    assert sorted(page for page in listed if listed.count(page) > 1) == []
    assert {path.stem for path in PAGES} == {page for page in listed if "/" not in page}


@pytest.mark.parametrize("kind", KINDS)
def test_the_pages_of_a_kind_keep_their_size(kind):
    pages = [page for page in members(kind) if "/" not in page and page not in MADE]
    words = sum(len((DOCS / f"{page}.md").read_text().split()) for page in pages)
    assert 0 < words <= MOST_WORDS[kind]


@pytest.mark.parametrize("page", [*sorted(DOCS.glob("*.md")), *sorted(ROOT.glob("*.md"))], ids=lambda path: path.name)
def test_links_within_the_project_lead_somewhere(page):
    text = re.sub(r"```.*?```", "", page.read_text(), flags=re.DOTALL)
    broken = []
    for target in re.findall(r"\]\(([^)\s]+)\)", text):
        file, _, anchor = target.partition("#")
        if re.match(r"\w+:", target) or file.startswith(("notebooks/", "project/", "api/", "reference/")):
            continue  # of the network, or made when the site is built, which checks them
        if not file and anchor in LABELS:
            continue
        place = page if not file else page.parent / file
        place = place if place.exists() else place.with_suffix(".md")
        if not place.exists() or (anchor and place.suffix == ".md" and anchor not in anchors(place.read_text())):
            broken.append(target)
    assert broken == []


def test_versions_agree_and_the_changelog_has_one_line_an_entry():
    version = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["version"]
    citation = re.search(r"^version: (.+)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)[1]
    lines = (ROOT / "CHANGELOG.md").read_text().splitlines()
    newest = next(line for line in lines if line.startswith("## "))
    assert newest.split()[1] == version == citation
    newest_section = lines[lines.index(newest) + 1 :]
    end = next((k for k, line in enumerate(newest_section) if line.startswith("## ")), len(newest_section))
    section = newest_section[:end]
    assert [line for line in section if line.startswith("### ")] == ["### Added", "### Changed", "### Fixed"]
    assert [line for line in section if line and not line.startswith(("- ", "### "))] == []
    assert [line for line in section if len(line) > 200] == []
