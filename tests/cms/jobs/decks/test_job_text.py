"""Jobs of whole decks: the text is a job, its body is the body of the deck."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal
from scipy.linalg import eigh

import cms
import fe_models
from cms.errors import BodyError, JobError
from cms.jobs.body_of_job import job_body, uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import ReductionSection, read_job
from fe_models.elements.solids.body import solid_body
from fe_models.errors import MeshError
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages
from tests.bodies import STEEL, box_mesh
from tests.cms.command import run_cms
from tests.decks import write_deck

MATERIAL = "*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, .3\n*DENSITY\n7850.\n"
SECTION = '*SOLID SECTION, ELSET="all", MATERIAL=STEEL\n'


def deck_of(folder, extra="", kind="hexahedron20", counts=(4, 1, 1), head=""):
    path = write_deck(folder / "bar.inp", box_mesh(*counts, 1.0, 0.1, 0.08, kind))
    path.write_text(head + path.read_text() + MATERIAL + SECTION + extra)
    return path


def job_of(path, **options):
    text = job_text(parse_deck(path), DeckOptions("m-kg-s", **{"densities": {}, **options}), path.name)
    path.with_suffix(".toml").write_text(text)
    return read_job(path.with_suffix(".toml"))


def test_the_body_of_a_deck_is_that_of_its_mesh_and_its_support_is_an_interface(tmp_path):
    job = job_of(deck_of(tmp_path, "*BOUNDARY\nleft, 1, 3\nright, 2\n"))
    body = uncoupled_body(job, Stages())
    plain = solid_body(box_mesh(4, 1, 1, 1.0, 0.1, 0.08, "hexahedron20"), STEEL, name="b", units=body.units)
    assert_allclose(body.K.toarray(), plain.K.toarray(), rtol=0, atol=1e-13 * abs(plain.K).max())
    assert_allclose(body.M.toarray(), plain.M.toarray(), rtol=0, atol=1e-13 * abs(plain.M).max())
    assert {name: table.kind for name, table in job.interfaces.items()} == {"left": "rigid", "right": "nodes"}
    held = [k for k, (node, _) in enumerate(plain.dofs) if plain.nodes[node, 0] == 0]
    free = np.setdiff1d(np.arange(plain.n_dof), held)
    K, M = plain.K.toarray()[np.ix_(free, free)], plain.M.toarray()[np.ix_(free, free)]
    lowest = np.sqrt(eigh(K, M, eigvals_only=True, subset_by_index=[0, 0])[0]) / 2 / np.pi
    clamped = cms.craig_bampton(job_body(job_of(deck_of(tmp_path, "*BOUNDARY\nleft, 1, 3\n"))), n_modes=1)
    assert_allclose(clamped.frequencies[~clamped.is_static], [lowest], rtol=1e-8)


def test_masses_rigid_groups_and_loads_of_a_deck_are_in_the_body(tmp_path):
    """A mass at the reference node of a rigid group on the end of the bar: mass, centre and load resultants follow."""
    nodes = "*NODE\n900, 1.2, 0.05, 0.04\n*ELEMENT, TYPE=MASS, ELSET=tip\n900, 900\n"
    extra = "*MASS, ELSET=tip\n5.\n*RIGID BODY, NSET=right, REF NODE=900\n*STEP\n*STATIC\n*CLOAD\n900, 3, -2.\n"
    extra += "*DLOAD\nall, GRAV, 9.81, 0., -1., 0.\n*END STEP\n"
    job = job_of(deck_of(tmp_path, nodes + extra))
    body = job_body(job)
    up = np.where(body.dofs[:, 1] == 1, 1.0, 0.0)
    assert_allclose(up @ body.M @ up, 5.0 + 7850 * 0.008, rtol=1e-12)
    force, gravity = (case.f for case in body.load_cases)
    assert_allclose(gravity @ up, -9.81 * (5.0 + 7850 * 0.008), rtol=1e-12)
    sink = np.where(body.dofs[:, 1] == 2, 1.0, 0.0)
    assert_allclose(force @ sink, -2.0, rtol=1e-12)
    leader = body.dofs[np.flatnonzero(body.dofs[:, 1] == 3)[0], 0]
    assert_allclose(body.nodes[leader], [1.2, 0.05, 0.04], rtol=1e-14)


#: supports, a mass on a rigid group, a load of each kind
WHOLE = (
    "*BOUNDARY\nleft, 1, 3\n*NODE\n900, 1.2, 0.05, 0.04\n*ELEMENT, TYPE=MASS, ELSET=tip\n900, 900\n"
    "*MASS, ELSET=tip\n5.\n*RIGID BODY, NSET=right, REF NODE=900\n*STEP\n*STATIC\n*CLOAD\n900, 3, -2.\n"
    "*DLOAD\nall, P3, 4.\nall, GRAV, 9.81, 0., -1., 0.\n*END STEP\n"
)


def test_a_deck_read_in_python_is_the_body_of_its_job(tmp_path):
    path = deck_of(tmp_path, WHOLE, kind="hexahedron")
    body = fe_models.couple(fe_models.assemble(fe_models.read_deck(path, units="m-kg-s")))
    expected = job_body(job_of(path))
    for A, B in ((body.M, expected.M), (body.K, expected.K)):
        assert_array_equal(A.toarray(), B.toarray())
    assert_array_equal(body.dofs, expected.dofs)
    assert [each.name for each in body.interfaces] == [each.name for each in expected.interfaces] == ["left"]
    for case, other in zip(body.load_cases, expected.load_cases, strict=True):
        assert (case.name, case.kind) == (other.name, other.kind)
        assert_array_equal(case.f, other.f)


@pytest.mark.parametrize("reduction", [None, {"set": "rubin", "n_modes": 3}])
def test_a_deck_is_reduced_as_its_job(tmp_path, reduction):
    path = deck_of(tmp_path, WHOLE, kind="hexahedron")
    reduced = cms.reduce_deck(path, units="m-kg-s", reduction=reduction)
    job = job_of(path)
    if reduction is not None:
        job = job.model_copy(update={"reduction": ReductionSection.model_validate(reduction)})
    expected = cms.reduce_job(job)
    for name in ("M", "K", "Phi"):
        assert_array_equal(getattr(reduced, name), getattr(expected, name))


def test_a_model_names_the_key_that_is_wrong(tmp_path):
    path = deck_of(tmp_path, kind="hexahedron")
    path.write_text(path.read_text().replace("*DENSITY\n7850.\n", ""))
    with pytest.raises(MeshError, match="1 materials have no density"):
        fe_models.read_deck(path, units="m-kg-s")
    steel = {"young": 2e11, "poisson": 0.3, "density": 7800.0}
    given = {"units": "m-kg-s", "materials": {"steel": steel}, "solids": {"all": {"cells": "all"}}}
    for change, words in (
        (
            {"solids": {"all": {"material": "tin"}}},
            r'model .bar.: solids\.all\.material = "tin": there is no such material',
        ),
        ({"materials": {"steel": {**steel, "young": -1}}}, r"materials\.steel\.young = -1: expected a number above 0"),
        ({"plane": "xx"}, "plane: unknown 'xx'; choices: xy"),
    ):
        with pytest.raises(BodyError, match=words):
            fe_models.FEModel.of("bar", parse_deck(path).mesh, **(given | change))


def test_a_mass_of_a_deck_names_its_node_by_number(tmp_path):
    """The number of a node of this deck is its row plus one."""
    path = deck_of(tmp_path, "*NSET, NSET=tip\n7\n", kind="hexahedron")
    toml = path.with_suffix(".toml")
    job_of(path)
    plain = toml.read_text()
    M = {}
    for node in ("7", '"tip"'):
        toml.write_text(plain + f"\n[masses.bob]\nnode = {node}\nmass = 5.0\n")
        M[node] = uncoupled_body(read_job(toml), Stages()).M
    assert_array_equal(M["7"].toarray(), M['"tip"'].toarray())
    toml.write_text(plain + "\n[masses.bob]\nnode = 901\nmass = 5.0\n")
    with pytest.raises(BodyError, match=r"masses\.bob\.node = 901: in the mesh 0 nodes have this number"):
        uncoupled_body(read_job(toml), Stages())


def test_pressure_of_a_deck_has_the_resultant_of_its_faces(tmp_path):
    deck = deck_of(tmp_path, "*STEP\n*STATIC\n*DLOAD\nall, P3, 4.\n*END STEP\n", kind="hexahedron")
    body = job_body(job_of(deck))
    resultants = [np.where(body.dofs[:, 1] == c, 1.0, 0.0) @ body.load_cases[0].f for c in range(3)]
    assert_allclose(resultants, [0.0, 4.0 * 1.0 * 0.08, 0.0], rtol=0, atol=1e-12)  # face 1-5-6-2 is y = 0


def test_what_a_deck_lacks_is_asked_for(tmp_path):
    path = deck_of(tmp_path)
    path.write_text(path.read_text().replace("*DENSITY\n7850.\n", ""))
    with pytest.raises(MeshError, match="1 materials have no density: STEEL; give it, as --density STEEL="):
        job_of(path)
    assert job_of(path, densities={"STEEL": 8000.0}).materials["STEEL"].density == 8000.0
    with pytest.raises(MeshError, match="--density 'STEAL': the deck has no such material in use; did you mean"):
        job_of(path, densities={"STEAL": 8000.0})


def test_cells_of_a_deck_in_no_table_are_refused(tmp_path):
    path = deck_of(tmp_path)
    job_of(path)
    toml = path.with_suffix(".toml")
    toml.write_text(toml.read_text().replace('cells = "all"', 'cells = "left half"'))
    with pytest.raises(BodyError, match="2 hexahedron20 cells are in no table"):
        uncoupled_body(read_job(toml), Stages())
    toml.write_text(toml.read_text().replace('"left half"', '"left haf"'))
    with pytest.raises(BodyError, match="the mesh has no such group of cells; did you mean 'left half'"):
        uncoupled_body(read_job(toml), Stages())


def test_the_command_prints_the_ledger_and_writes_it_on_top(tmp_path):
    path = deck_of(tmp_path, "*BOUNDARY\nleft, 1, 3\n*CONTACT PAIR, INTERACTION=i\na, b\n")
    run = run_cms("job", path, "--units", "m-kg-s", code=2)
    assert not path.with_suffix(".toml").exists()
    assert "1 *CONTACT PAIR" in run.output
    assert '--leave-out "CONTACT PAIR"' in run.output
    run = run_cms("job", path, "--units", "m-kg-s", "--leave-out", "CONTACT PAIR", code=0)
    text = path.with_suffix(".toml").read_text()
    assert "#   1 *CONTACT PAIR: LEFT OUT ON REQUEST: contact is not linear" in text
    assert "# The deck holds ux uy uz at the interface left; here the body is free." in text
    run = run_cms("job", path, code=2)
    assert "--units: missing; a deck does not say its units; choices: " in run.output
    run_cms("reduce", path.with_suffix(".toml"), code=0)


def test_tables_of_a_deck_need_a_deck(tmp_path):
    path = deck_of(tmp_path)
    job_of(path)
    toml = path.with_suffix(".toml")
    text = toml.read_text()
    toml.write_text(text.replace("deck = ", "mesh = "))
    with pytest.raises(JobError, match="solids: belong to a whole deck"):
        read_job(toml)
    toml.write_text(text.replace('material = "STEEL"', 'material = "STEAL"'))
    with pytest.raises(JobError, match="there is no such material; did you mean 'STEEL'"):
        read_job(toml)
