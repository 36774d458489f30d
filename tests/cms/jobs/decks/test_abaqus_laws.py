"""Keywords of Abaqus beside closed forms: composites, beams, springs, couplings; refusals by name."""

import re

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.files.abaqus.keywords import HARMLESS
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages

MATERIAL = "*MATERIAL,NAME=S\n*ELASTIC\n2e11,.3\n*DENSITY\n7850.\n"
SHEET = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,0,1,0\n*ELEMENT,TYPE=S4,ELSET=E\n1,1,2,3,4\n" + MATERIAL
E = 2e11


def body_of(folder, text, program="abaqus"):
    path = folder / "model.inp"
    path.write_text(text)
    deck = parse_deck(path, program=program)
    path.with_suffix(".toml").write_text(job_text(deck, DeckOptions("m-kg-s", {}), path.name))
    return uncoupled_body(read_job(path.with_suffix(".toml")), Stages()), deck


def mass_of(body):
    x = (body.dofs[:, 1] == 0).astype(float)
    return float(x @ (body.M @ x))


def frequencies(body, first, last):
    values = la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)
    return np.sqrt(np.maximum(values[first:last], 0)) / 2 / np.pi


def test_a_symmetric_composite_has_its_upper_half(tmp_path):
    half, _ = body_of(tmp_path, SHEET + "*SHELL SECTION,ELSET=E,COMPOSITE,SYMMETRIC\n.03,3,S\n.02,3,S\n")
    assert_allclose(mass_of(half), 785.0, rtol=1e-12)
    whole, _ = body_of(tmp_path, SHEET + "*SHELL SECTION,ELSET=E,COMPOSITE\n.03,3,S\n.02,3,S\n.02,3,S\n.03,3,S\n")
    assert_allclose(half.K.toarray(), whole.K.toarray(), rtol=0, atol=1e-12 * abs(whole.K).max())


def test_density_of_a_shell_section_is_mass_per_area(tmp_path):
    body, _ = body_of(tmp_path, SHEET + "*SHELL SECTION,ELSET=E,MATERIAL=S,DENSITY=100.\n.1,5\n")
    assert_allclose(mass_of(body), 785.0 + 100.0, rtol=1e-12)


def beams(kind, elements, lines="0,1,0\n", nodes="1,0,0,0\n2,1,0,0\n3,0,1,0\n4,0,0,1\n5,2,0,0\n"):
    return (
        f"*NODE\n{nodes}*ELEMENT,TYPE={kind},ELSET=E\n{elements}{MATERIAL}"
        f"*BEAM SECTION,ELSET=E,MATERIAL=S,SECTION=RECT\n.1,.2\n{lines}"
    )


def stiffness_at(body, point, component):
    node = int(np.argmin(np.linalg.norm(body.nodes - point, axis=1)))
    k = int(np.flatnonzero((body.dofs == (node, component)).all(axis=1))[0])
    return body.K.toarray()[k, k]


def test_b33_has_no_shear_deformation(tmp_path):
    """n1 = y with the width along it: 12 E I/L³ with I of the width, of Euler-Bernoulli; B31 is softer by its shear."""
    inertia = 0.2 * 0.1**3 / 12
    euler, _ = body_of(tmp_path, beams("B33", "1,1,2\n"))
    assert_allclose(stiffness_at(euler, (0, 0, 0), 1), 12 * E * inertia, rtol=1e-10)
    timoshenko, _ = body_of(tmp_path, beams("B31", "1,1,2\n"))
    assert stiffness_at(timoshenko, (0, 0, 0), 1) < 0.99 * 12 * E * inertia


def test_a_further_node_orients_a_beam(tmp_path):
    """Of two beams in a row each has its own node: n1 of the first along y, of the second along z."""
    thin, thick = 0.2 * 0.1**3 / 12, 0.1 * 0.2**3 / 12
    body, deck = body_of(tmp_path, beams("B33", "1,1,2,3\n2,2,5,4\n", lines=""))
    assert_allclose(stiffness_at(body, (0, 0, 0), 1), 12 * E * thin, rtol=1e-10)
    assert_allclose(stiffness_at(body, (0, 0, 0), 2), 12 * E * thick, rtol=1e-10)
    assert_allclose(stiffness_at(body, (2, 0, 0), 2), 12 * E * thin, rtol=1e-10)  # node 4 lies above the bar's line
    assert_allclose(stiffness_at(body, (2, 0, 0), 1), 12 * E * thick, rtol=1e-10)
    assert not any("dropped" in row[2] for row in deck.ledger.rows())


@pytest.mark.parametrize(
    ("kind", "why"),
    [("B21", "planar beams"), ("B31OS", "this element is not known here"), ("B23", "this element is not known here")],
)
def test_beams_of_other_motions_are_refused_by_name(tmp_path, kind, why):
    with pytest.raises(ValueError, match=f"{kind}.*{why}"):
        body_of(tmp_path, beams(kind, "1,1,2\n"))


@pytest.mark.parametrize(
    "more",
    [
        "*RELEASE\n1,S2,ALLM\n",
        "*BEAM ADDED INERTIA\n5.,0,0,0,0,0,0\n",
        "*MATRIX INPUT,NAME=A\n1,1,1,1,1e9\n",
        "*MATRIX ASSEMBLE,STIFFNESS=A\n",
        "*MASS ADJUST\nE,100.\n",
        "*SHELL TO SOLID COUPLING,CONSTRAINT NAME=A\nS1,S2\n",
        "*TRANSVERSE SHEAR STIFFNESS\n1.,1.\n",
        "*FIXED MASS SCALING,FACTOR=2.\n",
        "*NOT A KEYWORD\n",
    ],
)
def test_keywords_on_no_list_are_refused_by_name(tmp_path, more):
    name = more.splitlines()[0].split(",")[0]
    with pytest.raises(ValueError, match=re.escape(f"1 {name} (") + ".*this keyword is not known here"):
        body_of(tmp_path, beams("B31", "1,1,2\n") + more)


def test_keywords_of_an_analysis_are_harmless(tmp_path):
    assert {"STATIC", "FREQUENCY", "NODE FILE", "EL PRINT", "AMPLITUDE", "TEMPERATURE"} <= HARMLESS
    assert not any(keyword != " ".join(keyword.split()) for keyword in HARMLESS)
    more = "*STEP\n*FREQUENCY\n10\n*NODE FILE\nU\n*END STEP\n"
    _, deck = body_of(tmp_path, beams("B31", "1,1,2\n") + more)
    assert ("*FREQUENCY", "1", "belongs to the analysis, not to the body") in deck.ledger.rows()


def test_a_spring_over_temperature_has_its_first_value(tmp_path):
    bars = beams("B31", "1,1,2\n2,2,5\n")
    spring = "*ELEMENT,TYPE=SPRINGA,ELSET=SP\n10,1,5\n*SPRING,ELSET=SP\n\n"
    plain, _ = body_of(tmp_path, bars)
    body, deck = body_of(tmp_path, bars + spring + "1e5,,20.\n5e4,,100.\n")
    assert_allclose((body.K - plain.K).diagonal().sum(), 2e5, rtol=1e-6)
    assert ("*SPRING", "1", "of several temperatures the first line is taken") in deck.ledger.rows()


PART = "*NODE\n1,0,0,0\n2,1,0,0\n3,1,1,0\n4,1,1,2\n5,1,1,2\n6,1,1,3\n"
PART += "*ELEMENT,TYPE=B31,ELSET=E\n1,1,2\n2,2,3\n3,3,4\n4,5,6\n"
PART += "*BEAM SECTION,ELSET=E,MATERIAL=S,SECTION=CIRC\n.05\n1,1,.3\n"
PART += "".join(
    f"*ELEMENT,TYPE=SPRING2,ELSET=SP{c}\n{10 + c},4,5\n*SPRING,ELSET=SP{c}\n{c},{c}\n{c**3 * 1e5}\n"
    for c in range(1, 7)
)


def test_springs_turn_with_the_instance_of_their_part(tmp_path):
    """A turned copy of a body has the frequencies of the body."""
    found = []
    for place in ("", "1.,2.,3.\n1.,2.,3.,2.,4.,3.5,50.\n"):
        text = f"*PART,NAME=P\n{PART}*END PART\n*ASSEMBLY,NAME=A\n*INSTANCE,NAME=I,PART=P\n{place}*END INSTANCE\n"
        body, _ = body_of(tmp_path, text + "*END ASSEMBLY\n" + MATERIAL)
        found.append(frequencies(body, 6, 14))
    assert_allclose(found[1], found[0], rtol=1e-7)


POINTS = [(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1, 2)]
BLOCK = "*NODE\n" + "".join(f"{k + 1},{p[0]},{p[1]},{p[2]}\n" for k, p in enumerate(POINTS)) + "100,0,.5,.5\n"
BLOCK += "*ELEMENT,TYPE=C3D8,ELSET=E\n1,1,2,5,4,7,8,11,10\n2,2,3,6,5,8,9,12,11\n" + MATERIAL
BLOCK += "*SOLID SECTION,ELSET=E,MATERIAL=S\n*NSET,NSET=LEFT\n1,4,7,10\n*SURFACE,NAME=LEFT_NODES,TYPE=NODE\nLEFT,1.\n"
BLOCK += "*SURFACE,NAME=ALL_NODES,TYPE=NODE\n" + "".join(f"{k},\n" for k in range(1, 13))
BLOCK += "*ELEMENT,TYPE=MASS,ELSET=MM\n10,100\n*MASS,ELSET=MM\n1e5\n"


@pytest.mark.parametrize("kind", ["*DISTRIBUTING", "*KINEMATIC"])
def test_a_coupling_takes_the_nodes_within_its_radius(tmp_path, kind):
    """The four nodes at x = 0 lie within 0.8 of the reference node, the others do not."""
    found = []
    for head in ("SURFACE=LEFT_NODES", "SURFACE=ALL_NODES,INFLUENCE RADIUS=0.8"):
        body, _ = body_of(tmp_path, BLOCK + f"*COUPLING,CONSTRAINT NAME=C,REF NODE=100,{head}\n{kind}\n")
        found.append(body.K.toarray())
    assert_allclose(found[1], found[0], rtol=0, atol=1e-9 * abs(found[0]).max())


def test_couplings_that_cannot_be_taken_are_refused(tmp_path):
    head = "*COUPLING,CONSTRAINT NAME=C,REF NODE=100,SURFACE=ALL_NODES"
    with pytest.raises(ValueError, match="weights that fall with the distance"):
        body_of(tmp_path, BLOCK + f"{head}\n*DISTRIBUTING,WEIGHTING METHOD=LINEAR\n")
    with pytest.raises(ValueError, match="no node of the surface within INFLUENCE RADIUS"):
        body_of(tmp_path, BLOCK + f"{head},INFLUENCE RADIUS=.1\n*DISTRIBUTING\n")
