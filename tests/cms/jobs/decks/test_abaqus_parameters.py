"""Every parameter of every keyword of Abaqus that is read: it changes the body, or is refused if it is not the default.

The table is `fe_models.files.abaqus.keywords.PARAMETERS`; a parameter that is read without a line here fails.
"""

import re

import numpy as np
import pytest

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.abaqus.keywords import HARMLESS, PARAMETERS, parameters_of
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages

DECK = """*NODE, NSET=most
1, 0., 0., 0.
2, 2., 0., .1
3, 2.1, 1., 0.
4, 0., 1.2, 0.
5, .1, 0., 1.
6, 2., .1, 1.
7, 2., 1., 1.1
8, 0., 1., 1.
9, 3., .1, .15
10, 3.1, 1.2, .1
11, 4., .3, .2
12, 4., .3, .2
13, 5., 0., 0.
14, 5., 0., 0.
*ELEMENT, TYPE=C3D8, ELSET=brick
1, 1, 2, 3, 4, 5, 6, 7, 8
*ELEMENT, TYPE=S4, ELSET=sheet
2, 2, 9, 10, 3
*ELEMENT, TYPE=B31, ELSET=bar
3, 9, 11
*ELEMENT, TYPE=B31, ELSET=rail
4, 12, 13
*ELEMENT, TYPE=MASS, ELSET=point
5, 10
*ELEMENT, TYPE=SPRING2, ELSET=coil
6, 11, 12
*ELEMENT, TYPE=DASHPOT2, ELSET=pot
7, 11, 12
*NSET, NSET=tip
13
*ELSET, ELSET=both
3, 4
*SURFACE, NAME=face, TYPE=NODE
5
6
7
8
*ORIENTATION, NAME=axes
1., .2, 0., 0., 1., 0.
*TRANSFORM, NSET=tip, TYPE=R
1., .3, 0., 0., 1., .2
*MATERIAL, NAME=steel
*ELASTIC, TYPE=ISO
2.0E11, .3
*DENSITY
7800.
*DAMPING
*SOLID SECTION, ELSET=brick, MATERIAL=fibre, ORIENTATION=axes
*SHELL SECTION, ELSET=sheet, MATERIAL=steel, OFFSET=.1, DENSITY=2.
.05
*BEAM SECTION, ELSET=bar, MATERIAL=steel, SECTION=RECT, OFFSET1=.1, OFFSET2=.2
.1, .05
0., 0., 1.
*BEAM GENERAL SECTION, ELSET=rail, MATERIAL=steel, SECTION=PIPE, OFFSET1=.1, OFFSET2=.2
.1, .01
0., 0., 1.
*MASS, ELSET=point
3.
*SPRING, ELSET=coil
1, 1
1.E5,
*DASHPOT, ELSET=pot
1, 1
1.E3,
*MATERIAL, NAME=fibre
*ELASTIC, TYPE=ENGINEERING CONSTANTS
1.0E11, 2.E10, 1.E10, .3, .2, .25, 5.E9, 4.E9,
3.E9
*DENSITY
1600.
*EQUATION
2
12, 2, 1., 11, 2, -1.
*MPC
TIE, 11, 10
*RIGID BODY, NSET=free, REF NODE=15
*NODE
15, 6., 0., 0.
18, 7., 0., 0.
*NSET, NSET=free
13
*COUPLING, CONSTRAINT NAME=hold, REF NODE=18, SURFACE=face
*DISTRIBUTING
*NORMAL
*BOUNDARY
1, 1, 3
*CLOAD
11, 2, 5.
*DLOAD
brick, GRAV, 9.81, 0., 0., -1.
"""
#: keyword -> for each parameter that is read another value; None: it names something, or other tests have it
READ = {
    "NODE": {"NSET": None, "INPUT": None}, "ELEMENT": {"TYPE": "C3D8I", "ELSET": None, "INPUT": None},
    "NSET": {"NSET": None, "ELSET": None, "GENERATE": None, "INSTANCE": None},
    "ELSET": {"ELSET": None, "GENERATE": None, "INSTANCE": None}, "SURFACE": {"NAME": None, "TYPE": None},
    "MATERIAL": {"NAME": None}, "ELASTIC": {"TYPE": "TRACTION"},
    "SOLID SECTION": {"ELSET": None, "MATERIAL": "steel", "ORIENTATION": None},
    "SHELL SECTION": {"ELSET": None, "MATERIAL": "fibre", "ORIENTATION": None, "COMPOSITE": None, "SYMMETRIC": None,
                      "OFFSET": ".2", "DENSITY": "3.", "NODAL THICKNESS": None},
    "BEAM SECTION": {"ELSET": None, "MATERIAL": "fibre", "SECTION": "PIPE", "OFFSET1": ".3", "OFFSET2": ".3"},
    "BEAM GENERAL SECTION": {"ELSET": None, "MATERIAL": "fibre", "SECTION": "RECT", "OFFSET1": ".3", "OFFSET2": ".3"},
    "MASS": {"ELSET": None, "TYPE": "ANISOTROPIC"}, "SPRING": {"ELSET": None, "NONLINEAR": "", "ORIENTATION": "axes"},
    "DASHPOT": {"ELSET": None, "ORIENTATION": "axes"}, "NODAL THICKNESS": {"INPUT": None},
    "ORIENTATION": {"NAME": None, "SYSTEM": "CYLINDRICAL", "DEFINITION": "NODES"},
    "TRANSFORM": {"NSET": None, "TYPE": None}, "EQUATION": {"INPUT": None, "REMOVE": None, "REMOVE ALL": None},
    "MPC": {"INPUT": None},
    "RIGID BODY": {"NSET": None, "ELSET": None, "REF NODE": "18", "ROT NODE": None},
    "COUPLING": {"CONSTRAINT NAME": None, "REF NODE": None, "SURFACE": None, "ORIENTATION": None,
                 "INFLUENCE RADIUS": None},
    "DISTRIBUTING": {"WEIGHTING METHOD": "LINEAR"}, "DISTRIBUTING COUPLING": {"ELSET": None},
    "TIE": {"POSITION TOLERANCE": None, "CYCLIC SYMMETRY": None, "MULTISTAGE": None},
    "PART": {"NAME": None}, "ASSEMBLY": {"NAME": None}, "INSTANCE": {"NAME": None, "PART": None},
    "INCLUDE": {"INPUT": None},
}  # fmt: skip
#: keywords that change how the deck is put together, or need another deck: their parameters are looked at alone
ELSEWHERE = ("PART", "END PART", "ASSEMBLY", "END ASSEMBLY", "INSTANCE", "END INSTANCE", "INCLUDE", "SYSTEM")
ELSEWHERE += ("NODAL THICKNESS", "DISTRIBUTING COUPLING", "TIE", "KINEMATIC", "DSLOAD", "GRAVITY")


def model_of(folder, text):
    """Return what a deck makes, as arrays; or the refusal."""
    path = folder / "model.inp"
    path.write_text(text)
    try:
        deck = parse_deck(path)
        path.with_suffix(".toml").write_text(
            job_text(deck, DeckOptions("m-kg-s", {}), path.name).replace(
                "[body]", '[body]\naccept = ["parts", "left-out"]'
            )
        )
        body = uncoupled_body(read_job(path.with_suffix(".toml")), Stages())
    except ValueError as error:
        return str(error)
    D = np.zeros(body.K.shape) if body.D is None else body.D.toarray()
    return {
        "K": body.K.toarray(), "M": body.M.toarray(), "D": D, "notes": deck.ledger.rows(),
        "loads": np.array([case.f for case in body.load_cases]),
        "interfaces": [(i.name, i.kind, tuple(i.nodes)) for i in body.interfaces],
    }  # fmt: skip


def differs(a, b):
    for key in ("K", "M", "D", "loads"):
        if a[key].shape != b[key].shape:
            return True
        if np.abs(a[key] - b[key]).max(initial=0) > 1e-9 * np.abs(a[key]).max(initial=0):
            return True
    return a["interfaces"] != b["interfaces"]


def with_parameter(keyword, name, value):
    """Return the deck with a parameter of the first block of a keyword."""
    lines = DECK.split("\n")
    at = next(k for k, line in enumerate(lines) if re.match(rf"\*{keyword}(,|$)", line))
    words = [word for word in lines[at].split(", ") if word.partition("=")[0] != name]
    lines[at] = ", ".join([*words, f"{name}={value}" if value else name])
    return "\n".join(lines)


def test_every_keyword_that_is_read_has_its_parameters_here():
    assert not set(PARAMETERS) & HARMLESS
    for keyword in PARAMETERS:
        read = {item.name for item in parameters_of(keyword) if item.use == "read"}
        assert read == set(READ.get(keyword, {})), keyword
        assert keyword in ELSEWHERE or re.search(rf"(?m)^\*{keyword}(,|$)", DECK), keyword


@pytest.fixture(scope="module")
def before(tmp_path_factory):
    found = model_of(tmp_path_factory.mktemp("before"), DECK)
    assert isinstance(found, dict), found
    return found


@pytest.mark.parametrize("keyword", sorted(set(PARAMETERS) - set(ELSEWHERE)))
def test_every_parameter_changes_the_body_or_is_refused(tmp_path, before, keyword):
    for item in parameters_of(keyword):
        value = READ.get(keyword, {}).get(item.name)
        if item.use == "read" and value is not None:
            after = model_of(tmp_path, with_parameter(keyword, item.name, value))
            assert isinstance(after, str) or differs(before, after), f"{keyword}, {item.name} changes nothing"
        elif item.use == "default":
            after = refusal_of(tmp_path, with_parameter(keyword, item.name, "3.5"))
            assert f"*{keyword}, {item.name}" in after or f"*{keyword} in a cyl" in after, (
                f"{keyword}, {item.name} is taken in silence"
            )
        elif item.use == "left out":
            after = model_of(tmp_path, with_parameter(keyword, item.name, ".05"))
            assert any(f"damping {item.name} = .05 is left out" in row[2] for row in after["notes"])
            assert not differs(before, after)
        elif item.use == "harmless":
            after = model_of(tmp_path, with_parameter(keyword, item.name, "1"))
            assert isinstance(after, dict), f"{keyword}, {item.name}: {after}"
            assert not differs(before, after), f"{keyword}, {item.name} changes the body, but counts as harmless"


def refusal_of(folder, text):
    """Return what the ledger refuses, in words, or the error of the reader."""
    path = folder / "model.inp"
    path.write_text(text)
    try:
        return "; ".join(entry.name for entry in parse_deck(path).ledger.entries.values() if entry.is_body)
    except ValueError as error:
        return str(error)


@pytest.mark.parametrize("keyword", sorted(set(PARAMETERS) - set(ELSEWHERE)))
def test_a_parameter_on_no_list_is_refused_by_name(tmp_path, keyword):
    found = refusal_of(tmp_path, with_parameter(keyword, "NO SUCH", "1"))
    assert f"*{keyword}, NO SUCH" in found


def test_blanks_in_keywords_and_parameters_may_be_left_out(tmp_path, before):
    """CalculiX reads both spellings."""
    text = DECK.replace("*SOLID SECTION", "*SOLIDSECTION").replace("REF NODE=15", "REFNODE=15")
    text = text.replace("*BEAM GENERAL SECTION", "*BEAMGENERALSECTION")
    after = model_of(tmp_path, text + "*STEP\n*NODEFILE\nU\n*END STEP\n")
    assert isinstance(after, dict), after
    assert not differs(before, after)
