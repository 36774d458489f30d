"""The parts of the documentation site that are our own: formulas, pages of names, plain text, no network."""

import html
import importlib
import json
import logging
import re
import sys
import tomllib
import warnings
from types import SimpleNamespace

import pytest
from pydantic import TypeAdapter

from cms.assessment.quality.limits import LIMITS
from cms.body.modal_file.schema import ENTRIES, GROUPS
from fe_models.door import namespaces
from fe_models.files.abaqus.keywords import PARAMETERS
from fe_models.files.ansys.command_fields import COMMANDS
from fe_models.files.nastran.deck.card_fields import CARDS
from fe_models.foundation.file_kinds import KINDS
from fe_models.foundation.parametric_file import schema_text
from floatframe.files.system_file.described import MotionSection
from floatframe.files.system_file.read_system import SystemFile
from floatframe.results.results_file import DATASETS
from tests.root import ROOT


def extension(name):
    """Import an extension of the site; the library that draws formulas is deprecated in its own imports."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", DeprecationWarning)
        sys.path.insert(0, str(ROOT / "docs" / "extensions"))
        try:
            return importlib.import_module(name)
        finally:
            sys.path.remove(str(ROOT / "docs" / "extensions"))


drawn_math, offline, plain_text, public_names, reference_pages = map(
    extension, ("drawn_math", "offline", "plain_text", "public_names", "reference_pages")
)


def test_every_public_name_has_an_entry_on_one_page_of_names(tmp_path):
    public_names.write_pages(SimpleNamespace(srcdir=tmp_path))
    entries = []
    for page in (tmp_path / "api").glob("*.rst"):
        text = page.read_text(encoding="utf-8")
        owner = re.search(r"currentmodule:: (\S+)", text)
        entries += [
            (owner[1], name) for name in re.findall(r"^\.\. auto(?:class|function|data):: (\w+)", text, re.MULTILINE)
        ]
    assert len(entries) == len(set(entries))
    for package in public_names.PACKAGES:
        for module in namespaces(package):
            handed_on = public_names.names_from_below(module)
            expected = set(public_names.public_names(module)) - set(handed_on)
            assert {name for owner, name in entries if owner == module} == expected
            assert all((other, name) in entries for name, other in handed_on.items())


def test_every_type_of_every_table_has_an_example_that_is_read(tmp_path):
    (tmp_path / "housing.stl").touch()
    sections = reference_pages.sections_of(json.loads(schema_text("system")))
    types = {(reference_pages.table_of(place), name) for place, name, _, _ in sections if name and place[0] == "["}
    examples = reference_pages.examples()
    assert types == set(examples)
    page = reference_pages.keys_page("system")
    for (table, kind), text in examples.items():
        assert text in page
        value = tomllib.loads(text)["joints" if table == "motions" else table]
        if table == "motions":
            ((value,),) = (joint["motions"].values() for joint in value.values())
        hint = MotionSection if table == "motions" else SystemFile.model_fields[table].annotation
        read = TypeAdapter(hint).validate_python(value, context=tmp_path)
        assert kind in str(read), (table, kind)


def test_a_page_of_names_that_is_gone_is_removed(tmp_path):
    (tmp_path / "api").mkdir()
    (tmp_path / "api" / "cms.gone.rst").write_text("old")
    public_names.write_pages(SimpleNamespace(srcdir=tmp_path))
    assert not (tmp_path / "api" / "cms.gone.rst").exists()
    assert (tmp_path / "api" / "cms.modes.rst").exists()


def test_reference_pages_hold_every_command_option_and_key(tmp_path):
    (tmp_path / "reference").mkdir()
    (tmp_path / "reference" / "gone-file.md").write_text("old")
    reference_pages.write_pages(SimpleNamespace(srcdir=tmp_path))
    pages = {path.stem: path.read_text(encoding="utf-8") for path in (tmp_path / "reference").glob("*.md")}
    made = {
        "cms-commands",
        "floatframe-commands",
        "deck-fields",
        "formats",
        "modal-file",
        "results-file",
        "check-records",
    }
    assert set(pages) == made | {f"{kind}-file" for kind in KINDS}
    reduce = pages["cms-commands"].split("### cms reduce\n")[1].split("###")[0]
    assert re.search(
        r"^\| `--workers`, `-j` \| Where tasks are computed: .* \[cluster\]\(\.\./cluster\.md\)", reduce, re.MULTILINE
    )
    assert "```sh\ncms reduce rod.toml -o rod.h5\n" in reduce
    beams = pages["job-file"].split("## \\[sections.NAME\\]\n")[1].split("##")[0]
    assert re.search(r"^\| `shear` \| true or false: .* \| `true` \|$", beams, re.MULTILINE)


def test_the_page_of_deck_fields_has_every_card_that_is_read():
    page = reference_pages.fields_page()
    cards = {*CARDS, *(f"*{name}" for name in PARAMETERS), *COMMANDS}
    assert sorted(card for card in cards if f"| `{card}` |" not in page) == []


def test_the_page_of_a_modal_file_has_every_dataset_and_attribute_in_its_group():
    page = reference_pages.modal_file_page()
    sections = {part.split("`", 1)[0]: part for part in page.split("\n## `")[1:]}
    assert set(sections) == set(GROUPS)
    rows = {
        (f"{group.rstrip('/')}/{name}", shape)
        for group, part in sections.items()
        for name, shape in re.findall(r"^\| `([^`]+)` \| (\([^|]*) \| [^|]+ \| [^|]", part, re.MULTILINE)
    }
    assert rows == {(path, entry.shape) for path, entry in ENTRIES.items()}
    for group, layout in GROUPS.items():
        for name in layout.attributes:
            assert re.search(rf"^\| `{name}` \| (?:text|integer|float) \| [^|]", sections[group], re.MULTILINE)
    assert "| mass^(-1/2) (rows 0-2), mass^(-1/2) length^-1 (rows 3-5) |" in sections["/interfaces/<i>"]


def test_the_page_of_checks_has_every_record_with_its_limits():
    rows = re.findall(r"^\| `([\w-]+)` \| [^|]+ \| (\S+) \| (\S+) \|", reference_pages.checks_page(), re.MULTILINE)
    found = {name: [None if cell == "–" else float(cell) for cell in cells] for name, *cells in rows}
    assert found == {name: [limit.tolerance, limit.failing] for name, limit in LIMITS.items()}


def test_the_page_of_a_results_file_has_every_dataset_with_named_sizes():
    page = reference_pages.results_file_page()
    assert re.findall(r"^\| `(\w+)` \| \(", page, re.MULTILINE) == [*DATASETS]
    assert "| `drift` | (n_t, n_joints, 4) | m, rad, m/s, rad/s |" in page


def test_every_key_of_every_kind_of_file_has_a_meaning_on_its_page():
    missing = []
    for kind in KINDS:
        page, schema = reference_pages.keys_page(kind), json.loads(schema_text(kind))
        for name, table in {"the file": schema, **schema.get("$defs", {})}.items():
            if keys := set(table.get("properties", {})) - {"repeat"}:
                rows = "\n".join(reference_pages.keys_table(table))
                assert rows in page
                missing += [f"{kind}, {name}: {key}" for key in keys if not has_meaning(key, rows)]
    assert missing == []


def test_the_tables_of_a_system_file_stand_by_their_place_in_the_order_of_the_file():
    page = reference_pages.keys_page("system")
    assert "`repeat`" in page.split("## The file")[0]
    keys = [*json.loads(schema_text("system"))["properties"]]
    places = [heading.strip("\\[").split(".")[0] for heading in re.findall(r"^## \\\[(.*?)\\\]", page, re.MULTILINE)]
    assert [keys.index(place) for place in places] == sorted(keys.index(place) for place in places)
    joints = page.split("\n## \\[joints.NAME\\]\n")[1].split("\n## ")[0]
    revolute = joints.split("\n### revolute\n")[1].split("\n### ")[0]
    assert "five constraints. Coordinates: angle.\n" in revolute
    bushing = page.split("\n### bushing\n")[1].split("\n### ")[0]
    assert re.search(r'^\| `axes` \| .* \| `"a"` \|$', bushing, re.MULTILINE)  # defaults of classes are listed


def has_meaning(key, rows):
    """Whether a key has a row with a meaning, which says more than the type of its value."""
    row = re.search(rf"^\| `{key}` \| (.*?) \|", rows, re.MULTILINE)
    return bool(row) and row[1].strip() not in {"", "text", "a number", "number", "true or false"}


def test_a_formula_is_a_picture_with_its_text_and_stands_on_the_line():
    picture = drawn_math.svg(r"\Psi_R^{\mathsf T} M \Phi = 0", is_display=False)
    assert picture.startswith("<svg")
    assert r"\Psi_R^{\mathsf T} M \Phi = 0" in picture
    assert 'fill="currentColor"' in picture
    below = float(re.search(r"vertical-align: (-?[\d.]+)em", picture)[1])
    assert -1.0 < below < 0.0  # the subscript hangs below the line
    assert "vertical-align" not in drawn_math.svg("x", is_display=True)


@pytest.mark.parametrize("tex", [r"x''^2", r"x \mathrel{+}= 2"])
def test_a_formula_that_is_not_understood_is_a_warning(caplog, tex):
    with caplog.at_level(logging.WARNING, logger="sphinx"):
        text = drawn_math.drawn(tex, None, is_display=False)
    assert text == f"<code>{html.escape(tex)}</code>"
    assert "cannot be drawn" in caplog.text


def test_letters_are_defined_once_on_a_page():
    page = SimpleNamespace()
    first = drawn_math.letters_once(page, drawn_math.svg("x + x", is_display=False))
    again = drawn_math.letters_once(page, drawn_math.svg(r"x\ x", is_display=False))
    assert first.count("<symbol") == 2
    x = re.search(r'<symbol id="([^"]*)"', first)[1]
    assert f'<symbol id="{x}"' not in again
    assert again.count(f'href="#{x}"') == 2  # a space between letters takes none of them away


@pytest.mark.parametrize(
    ("content", "is_refused"),
    [
        ('<script src="https://example.org/x.js"></script>', True),
        ('<link rel="stylesheet" href="//example.org/x.css"/>', True),
        ('<img alt="" src="http://example.org/x.png">', True),
        ('<script src="_static/x.js"></script><a href="https://example.org">there</a>', False),
    ],
)
def test_a_page_that_loads_from_the_network_is_refused(content, is_refused, tmp_path):
    (tmp_path / "page.html").write_text(content)
    site = SimpleNamespace(outdir=tmp_path, builder=SimpleNamespace(format="html"))
    if is_refused:
        with pytest.raises(offline.SphinxError, match=r"page.html: .*example.org"):
            offline.check(site, None)
    else:
        offline.check(site, None)


def test_a_block_of_code_that_a_reader_saves_shows_the_name_of_its_file():
    kept = "<!-- not run -->\n```python\nx = 1\n```\n"
    content = ["<!-- file: rubber/mounts.py -->\n```python\nx = 1\n```\n" + kept]
    plain_text.files_named(None, "page", content)
    assert content == ['```{code-block} python\n:caption: "`rubber/mounts.py`"\n\nx = 1\n```\n' + kept]


def test_formulas_in_docstrings_are_escaped_and_pages_become_links(tmp_path):
    (tmp_path / "theory.md").touch()
    lines = ["|x| and q_ of a*b, `code_` (docs/theory.md §3)", ">>> a*b"]
    plain_text.docstring_escaped(SimpleNamespace(srcdir=tmp_path), "function", "f", None, None, lines)
    assert lines == [r"\|x\| and q\_ of a\*b, `code_` (:doc:`theory </theory>` §3)", ">>> a*b"]
