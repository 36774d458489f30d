"""Every field of every command of ANSYS that is read: it changes the body, or is refused if it is not the default.

The table is `fe_models.files.ansys.command_fields.COMMANDS`; a field that is read without a line here fails.
"""

import numpy as np
import pytest

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.ansys.command_fields import COLUMNS, COMMANDS, HARMLESS, fields_of_command
from fe_models.files.decks.field_table import parse_fields
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages

CORNERS = [(0, 0, 0), (2, 0, 0.1), (2.1, 1, 0), (0, 1.2, 0), (0.1, 0, 1), (2, 0.1, 1), (2, 1, 1.1), (0, 1, 1)]
COMMANDS_OF_CUBE = """ET,1,186
KEYOP,1,2,1
MPDATA,R5.0, 1,EX,1, 1, 2.0E11
MP,PRXY,1,0.3
MP,DENS,1,7800.
CMBLOCK,LEFT,NODE,       4
(8i10)
         1         4         5         8
D,1,UX,0.
F,2,FY,3.5
LUMPM,0
SECTYPE,1,SHELL
SECOFFSET,MID
SECBLOCK,1
0.1,1,0.,3
SECDATA,.1
SECCONTROL,0
ALPHAD,0.
BETAD,0.
DMPRAT,0.
DMPSTR,0.
DMPSTRUCT,0.
MDAMP,1,0.
SFE,1,1,PRES,1,2.
KEYOPT,1,4,1
"""


def cube(folder, commands=COMMANDS_OF_CUBE, columns=None):
    """A brick of SOLID186 with its middle nodes on the edges, and a second one whose nodes are those of the first."""
    edges = [(0, 1), (1, 2), (2, 3), (3, 0), (4, 5), (5, 6), (6, 7), (7, 4), (0, 4), (1, 5), (2, 6), (3, 7)]
    points = np.array([*CORNERS, *(np.mean([CORNERS[a], CORNERS[b]], axis=0) for a, b in edges)])
    row = {name: 0 for name in (item.name for item in parse_fields(COLUMNS.split()))}
    row |= {"MAT": 1, "TYPE": 1, "COUNT": 20, "NUMBER": 1, "REAL": 1, "SECNUM": 1} | (columns or {})
    lines = ["NBLOCK,6,SOLID,      20,      20", "(3i9,6e21.13e3)"]
    lines += [f"{k + 1:9d}{0:9d}{0:9d}{x:21.13E}{y:21.13E}{z:21.13E}" for k, (x, y, z) in enumerate(points)]
    lines += ["N,R5.3,LOC,       -1,", "EBLOCK,19,SOLID,       1,       1", "(19i9)"]
    lines += ["".join(f"{value:9d}" for value in [*row.values(), *range(1, 9)])]
    lines += ["".join(f"{value:9d}" for value in range(9, 21)), f"{-1:9d}"]
    path = folder / "cube.cdb"
    path.write_text("\n".join([*lines, commands]))
    return path


def model_of(folder, commands=COMMANDS_OF_CUBE, columns=None):
    """Return what a file makes, as arrays; or the refusal."""
    path = cube(folder, commands, columns)
    try:
        deck = parse_deck(path)
        path.with_suffix(".toml").write_text(job_text(deck, DeckOptions("m-kg-s", {}), path.name))
        body = uncoupled_body(read_job(path.with_suffix(".toml")), Stages())
    except ValueError as error:
        return str(error)
    return {
        "K": body.K.toarray(), "M": body.M.toarray(), "loads": np.array([case.f for case in body.load_cases]),
        "interfaces": [(i.name, tuple(i.nodes)) for i in body.interfaces],
        "groups": sorted((name, tuple(rows)) for name, rows in deck.mesh.node_sets.items()),
        "numbers": deck.mesh.blocks[0].numbers.tolist(), "notes": deck.ledger.rows(),
    }  # fmt: skip


def differs(a, b):
    for key in ("K", "M", "loads"):
        if a[key].shape != b[key].shape or np.abs(a[key] - b[key]).max(initial=0) > 1e-9 * np.abs(a[key]).max(
            initial=0
        ):
            return True
    return any(a[key] != b[key] for key in ("interfaces", "groups", "numbers"))


#: command -> for each field that is read another value; None: it names something, and another name is another thing
READ = {
    "NBLOCK": {}, "EBLOCK": {}, "CMBLOCK": {"NAME": "RIGHT", "ENTITY": None, "NUMITEMS": None},
    "ET": {"ITYPE": None, "ENAME": "185"}, "KEYOP": {"ITYPE": None, "KNUM": "3", "VALUE": "0"},
    "KEYOPT": {"ITYPE": None, "KNUM": "3", "VALUE": None}, "MP": {"LAB": "GXY", "MAT": None, "C0": ".2"},
    "MPDATA": {"LAB": "EY", "MAT": None, "STLOC": None}, "D": {"NODE": "2", "LAB": "UY"},
    "F": {"NODE": "3", "LAB": "FZ", "VALUE": "2."}, "SFE": {"LAB": None}, "LUMPM": {"KEY": "1"},
    "SECTYPE": {"SECID": None, "TYPE": "BEAM"}, "SECBLOCK": {"N": None}, "SECDATA": {}, "SECOFFSET": {"LOCATION": None},
    "SECCONTROL": {},
    "ALPHAD": {}, "BETAD": {}, "DMPRAT": {}, "DMPSTR": {}, "DMPSTRUCT": {}, "MDAMP": {},
}  # fmt: skip


def with_field(name, number, value):
    lines = COMMANDS_OF_CUBE.split("\n")
    at = next(k for k, line in enumerate(lines) if line.startswith(name + ","))
    words = lines[at].split(",")
    words += [""] * (number + 1 - len(words))
    words[number] = value
    lines[at] = ",".join(words)
    return "\n".join(lines)


def test_every_command_that_is_read_has_its_fields_here():
    assert set(READ) == set(COMMANDS)
    assert not set(COMMANDS) & HARMLESS
    for name in COMMANDS:
        assert {item.name for item in fields_of_command(name) if item.use == "read"} == set(READ[name]), name


@pytest.mark.parametrize("name", sorted(set(READ) - {"NBLOCK", "EBLOCK"}))
def test_every_field_changes_the_body_or_is_refused(tmp_path, name):
    before = model_of(tmp_path)
    assert isinstance(before, dict), before
    for item in fields_of_command(name):
        value = READ[name].get(item.name)
        if item.use == "read" and value is not None:
            after = model_of(tmp_path, with_field(name, item.number, value))
            assert isinstance(after, str) or differs(before, after), f"{name}: {item.name} = {value} changes nothing"
        elif item.use == "default":
            after = model_of(tmp_path, with_field(name, item.number, "3"))
            assert isinstance(after, str), f"{name}: {item.name} is taken in silence"
            assert f"{item.name} = 3: this field is not taken over" in after
        elif item.use == "left out":
            after = model_of(tmp_path, with_field(name, item.number, ".05"))
            assert any(f"{item.name} = .05) is left out" in row[2] for row in after["notes"])
            assert not differs(before, after)
        elif item.use == "harmless":
            after = model_of(tmp_path, with_field(name, item.number, "1"))
            assert isinstance(after, dict), f"{name}: {item.name}: {after}"
            assert not differs(before, after), f"{name}: {item.name} changes the body, but counts as harmless"
    if not COMMANDS[name].endswith("..."):
        after = model_of(tmp_path, with_field(name, len(fields_of_command(name)) + 1, "7"))
        assert "this command has" in after


#: columns that solids do not read, but shells do (test_planar_and_shells.py)
OF_SHELLS = {"SECNUM"}


@pytest.mark.parametrize("item", parse_fields(COLUMNS.split()), ids=lambda item: item.name)
def test_every_column_of_an_element_changes_the_body_or_is_refused(tmp_path, item):
    before = model_of(tmp_path)
    changed = {"MAT": 2, "TYPE": 2, "NUMBER": 7, "COUNT": 21, "ESYS": 11}.get(item.name, 3)
    commands = COMMANDS_OF_CUBE + ("MP,GXY,1,5.E10\n" if item.name == "ESYS" else "")
    after = model_of(tmp_path, commands, {item.name: changed})
    if item.use in ("read", "default") and item.name not in OF_SHELLS:
        assert isinstance(after, str) or differs(before, after), item.name
    else:
        assert not differs(before, after), item.name
