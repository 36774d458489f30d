"""Pages, notebooks and docstrings avoid constructions that readers had to read twice; codespell checks spelling."""

import json
import re

import pytest

from tests.root import ROOT

PACKAGES = ("fe_models", "cms", "floatframe")
#: written as they were at the time
AS_WRITTEN = {"history.md", "measured.md"}
FORBIDDEN = {
    r"\b(?:is|are|was|were) told\b": "name who says it: 'the run reports'",
    r"\bsuch as it\b": "write the noun",
    r"\bof so many\b": "give the number",
    r"\bwhich has to\b": "must",
    r"\bheld against\b": "compared with",
    r"\bat the door\b": "where it enters",
    r"\bfor ever\b": "forever, or for how long",
    r"\boracle of (?:its|their) own\b": "tested against an independent reference",
    r"\bthat is to say\b": "leave it out",
    r"\bwhat is (?:known|doubtful|needed|wanted)\b": "write the noun",
    r"\bwith the last (?:name )?of (?:it|them)\b": "when the last one is gone",
    r"\bno sooner\b": "as soon as",
    r"\b(?:is|are) to be had\b": "is available",
    r"\bthe more so\b": "leave it out",
    r"\bsuch a one\b": "write the noun",
    r"\bas (?:it )?(?:wants|wanted) it\b": "write the condition",
    r"\bwhere it belongs\b": "name the place",
}


def pages():
    """Return the prose of pages, of notebooks and of the packages, by file."""
    texts = {path: path.read_text() for path in [*ROOT.glob("*.md"), *(ROOT / "docs").glob("*.md")]}
    for path in (ROOT / "notebooks").glob("*.ipynb"):
        cells = json.loads(path.read_text())["cells"]
        texts[path] = "\n".join("".join(cell["source"]) for cell in cells if cell["cell_type"] == "markdown")
    texts |= {path: path.read_text() for package in PACKAGES for path in (ROOT / package).rglob("*.py")}
    return {path.relative_to(ROOT): text for path, text in texts.items() if path.name not in AS_WRITTEN}


@pytest.mark.parametrize("construction", FORBIDDEN)
def test_a_construction_that_is_hard_to_read_does_not_occur(construction):
    pattern = re.compile(construction.replace(" ", r"\s+"), re.IGNORECASE)
    found = [f"{path}: {match[0]!r}" for path, text in TEXTS.items() for match in pattern.finditer(text)]
    assert found == [], f"instead: {FORBIDDEN[construction]}"


def test_forbidden_constructions_are_found():
    assert re.search(next(iter(FORBIDDEN)), "The reader is told what to do.")


TEXTS = pages()
