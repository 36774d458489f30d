"""JSON schemas of all kinds of files: valid, complete, and true of the files that are shipped."""

import json
import tomllib

import jsonschema
import pytest
from typer.testing import CliRunner

from cms.cli.app import app as cms_app
from fe_models.foundation.file_kinds import KINDS
from floatframe.cli.app import app
from floatframe.machines.catalogue import copy_machine
from tests.floatframe.command import run_floatframe
from tests.root import ROOT

SHIPPED = sorted(path for room in ("cms", "floatframe") for path in (ROOT / room).rglob("*.toml"))
PROGRAMS = {"cms": cms_app, "floatframe": app}


@pytest.fixture(scope="module")
def schemas():
    """Return the schema of every kind, as the command prints it."""
    found = {}
    for kind, each in KINDS.items():
        result = CliRunner().invoke(PROGRAMS[each.command.split()[0]], ["schema", kind])
        assert result.exit_code == 0, result.output
        found[kind] = json.loads(result.stdout)
    return found


def kind_of(path):
    """Return the kind that a shipped file or a file that it extends states; fail if there is none."""
    content = tomllib.loads(path.read_text())
    if "kind" in content:
        return content["kind"]
    bases = content.get("extends", ())
    for base in (bases,) if isinstance(bases, str) else bases:
        return kind_of(path.parent / base)
    raise AssertionError(f"{path} does not state its kind")


def test_every_schema_is_valid_and_describes_its_keys(schemas):
    for kind, schema in schemas.items():
        jsonschema.Draft202012Validator.check_schema(schema)
        bare = [name for name, value in schema["properties"].items() if not value.get("description")]
        assert bare == [], kind


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: str(path.relative_to(ROOT)))
def test_shipped_files_fit_their_schema(schemas, path):
    jsonschema.Draft202012Validator(schemas[kind_of(path)]).validate(tomllib.loads(path.read_text()))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: str(path.relative_to(ROOT)))
def test_shipped_files_name_their_schema_in_the_first_line(path):
    (room,) = (each for each in path.parents if each.name in ("files", "data"))
    up = "../" * len(path.parent.relative_to(room).parts)
    assert path.read_text().splitlines()[0] == f"#:schema {up}{kind_of(path)}.schema.json"


def test_the_schema_that_a_copied_file_names_stands_beside_it(schemas, tmp_path):
    for path in (path for path in copy_machine("railway-engine", tmp_path) if path.suffix == ".toml"):
        named = path.parent / path.read_text().splitlines()[0].removeprefix("#:schema ")
        assert json.loads(named.read_text()) == schemas[kind_of(path)]


def test_a_schema_refuses_what_the_reader_refuses(schemas):
    content = {"system": {"units": "m-kg-s"}, "bodies": {"rod": {"mass": 1.0}}, "run": {"t_end": 1.0, "h": 1e-3}}
    validator = jsonschema.Draft202012Validator(schemas["system"])
    validator.validate(content)
    for table, key, value in (("run", "scheme", "newmrk"), ("run", "h", -1.0), ("system", "unit", "m-kg-s")):
        assert not validator.is_valid({**content, table: {**content[table], key: value}})


@pytest.mark.parametrize(
    ("room", "table", "wrong"),
    [
        ("joints", {"type": "revolute", "body_a": "ground", "body_b": "rod", "axis": [0, 0, 1]}, {"lead": 1.0}),
        (
            "joints",
            {"type": "revolute", "body_a": "ground", "body_b": "rod", "axis": [0, 0, 1], "motions": {"angle": 1}},
            {"motions": {"angle": "1"}},
        ),
        ("forces", {"type": "joint-force", "joint": "pin", "coordinate": "angle", "motor": 2}, {"motor": "2"}),
        ("sensors", {"type": "velocity", "body": "rod", "node": 3}, {"interface": "end"}),
        ("elements", {"type": "drives.pid", "marker_a": {"body": "rod"}, "controlled": "angle"}, {"contrlled": "x"}),
        ("elements", {"type": "mine.mount", "stiffness": 3.0}, {"type": 3}),
    ],
)
def test_a_schema_knows_the_keys_of_each_type(schemas, room, table, wrong):
    content = {"system": {"units": "m-kg-s"}, "bodies": {"rod": {"mass": 1.0}}}
    validator = jsonschema.Draft202012Validator(schemas["system"])
    assert validator.is_valid({**content, room: {"it": table}})
    assert not validator.is_valid({**content, room: {"it": table | wrong}})


def test_a_schema_knows_parameters_and_repeat(schemas):
    content = {
        "extends": "base.toml", "parameters": {"n": 3}, "system": {"units": "m-kg-s"},
        "bodies": {"rod": {"repeat": "{n}", "mass": "{2.0 * i}"}},
    }  # fmt: skip
    jsonschema.Draft202012Validator(schemas["system"]).validate(content)


@pytest.mark.parametrize(("entry", "fits"), [("{-g}", True), (-9.81, True), ({}, False), ("g", False)])
def test_an_entry_of_a_list_may_be_an_expression_but_no_empty_table(schemas, entry, fits):
    content = {"parameters": {"g": 9.81}, "system": {"units": "m-kg-s", "gravity": [0, 0, entry]}}
    assert jsonschema.Draft202012Validator(schemas["system"]).is_valid(content) == fits


def test_an_unknown_kind_is_refused_with_the_nearest():
    result = run_floatframe("schema", "sytem", code=2)
    assert "did you mean 'system'?" in result.stderr
