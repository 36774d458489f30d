"""Whatever pages, docstrings and comments refer to is shipped: pages, sections, files, names, sources."""

import ast
import importlib
import io
import re
import tokenize
from functools import cache

import pytest

from floatframe.engine.kernels.compiler.garbage import without_garbage_collection
from tests.import_graph import statements
from tests.root import ROOT

PACKAGES = ("fe_models", "cms", "floatframe")
SOURCES = sorted(
    path
    for folder in (*PACKAGES, "tests", "benchmarks", "docs", "notebooks")
    for path in (ROOT / folder).rglob("*")
    if path.suffix in {".py", ".md", ".toml", ".ipynb"}
    and not path.is_relative_to(ROOT / "docs" / "project")
    and not path.is_relative_to(ROOT / "docs" / "notebooks")
) + sorted(ROOT.glob("*.md"))
PAGES = sorted(path for path in SOURCES if path.suffix == ".md" and path.name not in {"CHANGELOG.md", "history.md"})
HERE = ROOT / "tests" / "docs" / "test_references.py"


def texts(paths):
    """Yield path and text of each file but this one, which names what it looks for."""
    for path in paths:
        if path != HERE:
            yield path.relative_to(ROOT), path.read_text(encoding="utf-8")


def test_no_reference_to_a_document_that_is_not_shipped():
    unshipped = re.compile(r"\b(?:DESIGN|THEORY|STYLE|FORMATS|MOVES)(?:\.md| ?§| \d)")
    found = [f"{path}: {match[0]}" for path, text in texts(SOURCES) for match in unshipped.finditer(text)]
    assert found == []


def test_pages_that_are_named_exist():
    named = re.compile(r"(?<![\w/.-])(?:docs/)?([a-z_]+\.md)\b")
    there = {path.name for path in (ROOT / "docs").glob("*.md")} | {"contributing.md", "changelog.md", "benchmarks.md"}
    found = {
        f"{path}: {m[1]}" for path, text in texts(SOURCES) if "tests/" not in str(path) for m in named.finditer(text)
    }
    assert sorted(entry for entry in found if entry.split(": ")[1] not in there) == []


def test_sections_of_the_theory_that_are_cited_exist():
    headings = re.findall(r"^## (\d+)\.", (ROOT / "docs" / "theory.md").read_text(encoding="utf-8"), re.MULTILINE)
    assert headings == [str(k) for k in range(len(headings))]
    cited = re.compile(r"theory(?:\.md`?)?,?\s+(?:§|section )(\d+)(?:-(\d+))?")
    missing = [
        f"{path}: {match[0]!r}"
        for path, text in texts(SOURCES)
        for match in cited.finditer(text)
        if not {number for number in match.groups() if number} <= set(headings)
    ]
    assert missing == []


@pytest.mark.parametrize("page", PAGES, ids=lambda path: str(path.relative_to(ROOT)))
def test_files_and_names_on_a_page_exist(page):
    words = re.findall(r"`([^`\n]+)`", page.read_text(encoding="utf-8"))
    missing = []
    for word in words:
        if re.fullmatch(r"(?:fe_models|cms|floatframe|tests|notebooks|benchmarks|docs)/[\w./-]*", word):
            if not (ROOT / word).exists():
                missing.append(word)
        elif re.fullmatch(r"(?:fe_models|cms|floatframe)(?:\.\w+)+", word) and not is_name(word):
            missing.append(word)
    assert missing == []


def is_name(dotted):
    """Whether a dotted name is a module, or an attribute of one."""
    parts = dotted.split(".")
    for k in range(len(parts), 0, -1):
        try:
            thing = importlib.import_module(".".join(parts[:k]))
        except ModuleNotFoundError:
            continue
        for attribute in parts[k:]:
            fields = getattr(thing, "__annotations__", {})
            if not hasattr(thing, attribute) and attribute not in fields:
                return False
            thing = getattr(thing, attribute, None)
        return True
    return False


#: modules of readers' own, in examples: a generated file, a package or script of theirs
EXAMPLES = re.compile(
    r"(?:FILE|NAME|MODULE|rubber/\w+|buffers/\w+|mount|arm_forces|deck|part|stepping|test|bar(?:_\w+)?|pile)\.py"
)


def test_modules_named_in_docstrings_comments_and_pages_exist():
    shipped = {f"/{path.relative_to(ROOT).as_posix()}" for path in SOURCES if path.suffix == ".py"}
    file_name = re.compile(r"(?<![\w/.-])(?:\w+/)*\w+\.py\b")
    dotted = re.compile(r"`((?:fe_models|cms|floatframe)(?:\.\w+)+)`")
    missing = set()
    for path, text in texts(path for path in SOURCES if path.suffix == ".py" or path in PAGES):
        if not file_name.search(text) and not dotted.search(text):
            continue
        for prose in (*docstrings(text), *comments(text)) if path.suffix == ".py" else (text,):
            for named in file_name.findall(prose):
                if not EXAMPLES.fullmatch(named) and not any(module.endswith(f"/{named}") for module in shipped):
                    missing.add(f"{path}: {named}")
            missing |= {f"{path}: {named}" for named in dotted.findall(prose) if not is_name(named)}
    assert sorted(missing) == []


NAME = r"(?:Mac|Mc|O')?[A-ZÉ][a-zéüø]+(?:-[A-ZÉ]?[a-zéüø]+)*"
CITED = re.compile(rf"\b({NAME})(?:(?:, | & | and |, & ){NAME})*(?: et al\.?)?(?:,? \(|,? )((?:19|20)\d\d)\b")
MONTHS = "January February March April May June July August September October November December"
PROGRAMS = {"Abaqus", "Nastran", "Ansys", "Adams"}  #: whose versions are years
NOT_NAMES = {"Benchmarks", *MONTHS.split(), *PROGRAMS}


@cache
def sources():
    """Return (family name of the first author, year) of the bibliography."""
    text = (ROOT / "docs" / "bibliography.md").read_text(encoding="utf-8")
    return {
        (plain(name), year) for name, year in re.findall(r"^([^\W\d_][\w'-]*)[^\n]*?\((\d{4})\)\.", text, re.MULTILINE)
    }


def plain(name):
    """Return a name without the two spellings of an umlaut, without an accent and an apostrophe."""
    return name.replace("ü", "ue").replace("á", "a").replace("'", "").lower()


def test_the_bibliography_has_an_anchor_for_each_source():
    text = (ROOT / "docs" / "bibliography.md").read_text(encoding="utf-8")
    entries = re.findall(r"^\(([a-z-]+)-(\d{4})\)=\n([\w'-]+)[^\n]*?\((\d{4})\)\.", text, re.MULTILINE)
    assert {(plain(entry[2]), entry[3]) for entry in entries} == sources()
    assert len(entries) == len(re.findall(r"\)=$", text, re.MULTILINE))
    assert [entry for entry in entries if entry[1] != entry[3] or not entry[0].startswith(plain(entry[2]))] == []


def test_sources_that_are_cited_stand_in_the_bibliography():
    missing = set()
    for path, text in texts(SOURCES):
        if not CITED.search(text):
            continue
        prose = text if path.suffix != ".py" else "\n".join(docstrings(text))
        for match in CITED.finditer(prose):
            if match[1] not in NOT_NAMES and (plain(match[1]), match[2]) not in sources():
                missing.add(f"{path}: {match[0]}")
    assert sorted(missing) == []


@cache
def docstrings(text):
    """Return the docstrings of a source file."""
    kinds = (ast.ClassDef, ast.FunctionDef)
    with without_garbage_collection():
        tree = ast.parse(text)
    return [
        ast.get_docstring(node) or "" for node in (tree, *statements(tree)) if node is tree or isinstance(node, kinds)
    ]


def comments(text):
    """Return the comments of a source file."""
    if "#" not in text:
        return []
    tokens = tokenize.generate_tokens(io.StringIO(text).readline)
    return [token.string for token in tokens if token.type == tokenize.COMMENT]
