"""Decks of ANSYS: the beam of SOLID186 beside the matrices that ANSYS assembled of it."""

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.errors import MeshError
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.foundation.stages import Stages
from tests.root import ROOT

DATA = ROOT / "tests" / "fe_models" / "files" / "data" / "ansys"
#: constants of the run that wrote the matrices, psi and lbf s²/in⁴; the deck has others
E, NU, RHO = 1.69e7, 0.31, 4.1408e-4


def beam_text():
    return (DATA / "HexBeam.cdb").read_text(encoding="latin-1")


def deck_of(folder, text):
    path = folder / "beam.cdb"
    path.write_text(text, encoding="latin-1")
    return path


def body_of(path, units="in-slinch-s"):
    text = job_text(parse_deck(path), DeckOptions(units, {}), path.name)
    path.with_suffix(".toml").write_text(text)
    return uncoupled_body(read_job(path.with_suffix(".toml")), Stages())


def test_stiffness_and_mass_of_solid186_are_those_of_ansys(tmp_path):
    """K by 8 points, M by 14: equal to the .full file to rounding, and with it the first frequency, 1283.2004 Hz."""
    reader = pytest.importorskip("ansys.mapdl.reader")
    text = (
        beam_text().replace("7.000000000E+10", f"{E}").replace("0.350000000", f"{NU}").replace("2700.00000", f"{RHO}")
    )
    body = body_of(deck_of(tmp_path, text))
    _, k, m = reader.read_binary(str(DATA / "HexBeam_clamped.full")).load_km(sort=True)
    k, m = k.toarray(), m.toarray()
    free = np.flatnonzero(k.diagonal() > 0)
    rows = np.ix_(free, free)
    for theirs, ours in ((k, body.K), (m, body.M)):
        theirs = np.triu(theirs) + np.triu(theirs, 1).T
        assert_allclose(ours.toarray()[rows], theirs[rows], rtol=0, atol=1e-10 * abs(theirs).max())
    lowest = 1 / np.sqrt(la.eigvalsh(body.M.toarray()[rows], body.K.toarray()[rows], subset_by_index=[899, 899]))
    assert_allclose(lowest / 2 / np.pi, 1283.2004, rtol=1e-7)


def test_nodes_elements_components_and_materials_are_read(tmp_path):
    deck = parse_deck(deck_of(tmp_path, beam_text() + "D,2,UX,0.\nD,4,ALL,0.\nF,1,FY,3.5\n"))
    assert (len(deck.mesh.nodes), len(deck.mesh.blocks[0].nodes)) == (321, 40)
    assert_array_equal(deck.mesh.nodes[[0, 1]], [[0, 0, 0], [1, 0, 0]])  # zeros at the end are left out
    numbers = deck.mesh.node_numbers[deck.mesh.node_sets["NCOMP2"]]
    assert (numbers[0], numbers[20], numbers[21]) == (1, 21, 43)
    assert sorted(deck.mesh.blocks[0].numbers[deck.mesh.blocks[0].groups["ECOMP1"]]) == [17, 18, *range(21, 41)]
    material = deck.materials["1"]
    assert (material.young, material.poisson, material.density) == (7e10, 0.35, 2700.0)
    assert [(s.name, s.components) for s in deck.supports] == [
        ("support_1", (0,)),
        ("support_123456", (0, 1, 2, 3, 4, 5)),
    ]
    assert deck.loads[0].forces == {"node_1": (0.0, 3.5, 0.0, 0.0, 0.0, 0.0)}


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("EBLOCK,19", "EBLOCK,10", "expected 19 columns"),
        ("(3i9,6e21.13e3)", "(free)", "expected a format such as"),
        ("        -1\n", "", "(does not end|cannot be understood)"),
        ("NBLOCK", "MBLOCK", r"expected nodes \(NBLOCK\), got none"),
    ],
)
def test_damaged_files_are_refused(tmp_path, old, new, words):
    assert old in beam_text()
    with pytest.raises(MeshError, match=words):
        parse_deck(deck_of(tmp_path, beam_text().replace(old, new)))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("ET,        1,186", "ET,        1,188", "40 element 188: this element is not known here"),
        ("EXTOPT,ATTR", "CE,1,0,2,UX,1,3,UX,-1\nEXTOPT,ATTR", "1 CE "),
        ("EXTOPT,ATTR", "SWGEN,1\nEXTOPT,ATTR", "1 SWGEN .*: this command is not known here"),
        ("EXTOPT,ATTR", "KEYOP,1,6,1\nEXTOPT,ATTR", r"40 KEYOPT\(6\) = 1 of SOLID186"),
        ("EXTOPT,ATTR", "KEYOP,1,3,1\nEXTOPT,ATTR", r"40 KEYOPT\(3\) = 1 of SOLID186"),
    ],
)
def test_mass_and_stiffness_are_never_left_out_unasked(tmp_path, old, new, words):
    assert old in beam_text()
    with pytest.raises(MeshError, match=words):
        parse_deck(deck_of(tmp_path, beam_text().replace(old, new, 1))).ledger.require_whole()


CUBE = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (0, 0, 1), (1, 0, 1), (1, 1, 1), (0, 1, 1)]
#: nodes of the faces z = 0 and z = 1, equal ones as ANSYS writes prisms, tetrahedra and pyramids
SHAPES = {
    "brick": ([1, 2, 3, 4, 5, 6, 7, 8], 1.0),
    "prism": ([1, 2, 3, 3, 5, 6, 7, 7], 1 / 2),
    "pyramid": ([1, 2, 3, 4, 5, 5, 5, 5], 1 / 3),
    "tetrahedron": ([1, 2, 3, 3, 5, 5, 5, 5], 1 / 6),
}
STEEL = "".join(
    f"MPDATA,R5.0, 1,{label} , 1, 1, {value},\n" for label, value in (("EX", 2e11), ("PRXY", 0.3), ("DENS", 7850.0))
)


def cube(folder, *, shape="brick", materials=STEEL, kind=185, esys=0):
    """Return the deck of one element."""
    text = f"/PREP7\nET,1,{kind}\nNBLOCK,6,SOLID,8,8\n(3i9,6e21.13e3)\n"
    for k, p in enumerate(CUBE):
        text += f"{k + 1:9d}{0:9d}{0:9d}" + "".join(f"{v:21.13E}" for v in p) + "\n"
    row = [1, 1, 1, 1, esys, 0, 0, 0, 8, 0, 1, *SHAPES[shape][0]]
    text += "N,R5.3,LOC,       -1,\nEBLOCK,19,SOLID,1,1\n(19i9)\n" + "".join(f"{v:9d}" for v in row) + "\n       -1\n"
    return deck_of(folder, text + materials + "FINISH\n")


def sheared(body, i, j):
    """Return twice the energy of the simple shear u_i = x_j of the unit cube: G_ij."""
    u = np.where(body.dofs[:, 1] == i, body.nodes[body.dofs[:, 0], j], 0.0)
    return float(u @ body.K @ u)


@pytest.mark.parametrize("shape", SHAPES)
def test_solid185_of_equal_nodes_is_a_prism_a_pyramid_or_a_tetrahedron(tmp_path, shape):
    body = body_of(cube(tmp_path, shape=shape), "m-kg-s")
    x = (body.dofs[:, 1] == 0).astype(float)
    assert_allclose(x @ body.M @ x, 7850.0 * SHAPES[shape][1], rtol=1e-12)


@pytest.mark.parametrize("shape", SHAPES)
def test_solid186_without_middle_nodes_has_six_motions_without_energy(tmp_path, shape):
    body = body_of(cube(tmp_path, shape=shape, kind=186), "m-kg-s")
    energy = np.linalg.eigvalsh(body.K.toarray())
    assert (energy < 1e-9 * energy[-1]).sum() == 6


def test_solid187_without_middle_nodes_is_a_tetrahedron_of_first_order(tmp_path):
    """Its stiffness is that of SOLID185 of the same corners; MESH200 and the ends of lists say nothing."""
    K = []
    for old, new in (("", ""), ("ET,1,185", "ET,1,187\nET,2,200")):
        path = cube(tmp_path, shape="tetrahedron")
        text = path.read_text().replace(old, new)
        if new:
            row = "".join(f"{v:9d}" for v in (1, 1, 1, 1, 0, 0, 0, 0, 8, 0, 1, *SHAPES["tetrahedron"][0]))
            four = "".join(f"{v:9d}" for v in (1, 1, 1, 1, 0, 0, 0, 0, 4, 0, 1, 1, 2, 3, 5))
            facet = "".join(f"{v:9d}" for v in (1, 2, 1, 1, 0, 0, 0, 0, 3, 0, 2, 1, 2, 3))
            assert row in text
            text = text.replace(row, f"{four}\n{facet}").replace("EBLOCK", "N,R5.1,LOC,       -1,\nEBLOCK")
            text = text.replace("FINISH", "EN,R5.5,ATTR,       -1,\nFINISH")
        path.write_text(text)
        K.append(body_of(path, "m-kg-s").K.toarray())
    assert_allclose(K[1], K[0], rtol=1e-12, atol=1e-12 * K[0].max())
    path.write_text(text.replace(four, four.replace(f"{4:9d}{0:9d}{1:9d}", f"{5:9d}{0:9d}{1:9d}") + f"{6:9d}"))
    with pytest.raises(MeshError, match=r"\(SOLID187\) has 5 nodes; expected 4 or 10"):
        parse_deck(path)


def test_tables_over_temperature_are_taken_at_the_first_one(tmp_path):
    """MPDATA writes three values a line, at their places in MPTEMP: a later line does not overwrite the first."""
    table = STEEL.replace(
        "MPDATA,R5.0, 1,EX , 1, 1, 200000000000.0,\n",
        "MPTEMP,R5.0, 3, 1, 20.,100.,200.,\nMPTEMP,R5.0, 2, 4, 300.,400.,\n"
        "MPDATA,R5.0, 3,EX , 1, 1, 2.0e11, 1.9e11, 1.8e11\n"
        "MPDATA,R5.0, 2,EX , 1, 4, 1.0e11, 0.9e11\n",
    )
    assert table != STEEL
    deck = parse_deck(cube(tmp_path, materials=table))
    assert deck.materials["1"].young == 2e11
    assert ("MPDATA, EX", "1", "material 1 depends on temperature, 5 values: the first is taken") in deck.ledger.rows()


def test_shear_moduli_alone_make_an_orthotropic_material(tmp_path):
    """Twice the energy of a unit shear of the unit cube is the modulus of its plane."""
    given = {"GXY": 1e9, "GYZ": 2e9, "GXZ": 3e9}
    body = body_of(cube(tmp_path, materials=STEEL + "".join(f"MP,{k},1,{v}\n" for k, v in given.items())), "m-kg-s")
    for (i, j), exact in {(0, 1): 1e9, (1, 2): 2e9, (0, 2): 3e9}.items():
        assert_allclose(sheared(body, i, j), exact, rtol=1e-9)


def test_orthotropic_constants_are_those_of_the_compliance_of_ansys(tmp_path):
    """Uniaxial stress: 1/E on the diagonal, -PR_xy/E_x beside it; NU are the minor ratios."""
    words = (
        "MP,EX,1,1.0e11\nMP,EY,1,2.0e10\nMP,EZ,1,3.0e10\nMP,NUXY,1,.06\nMP,PRXZ,1,.25\nMP,PRYZ,1,.2\nMP,DENS,1,1500.\n"
    )
    body = body_of(cube(tmp_path, materials=words + "MP,GXY,1,5.0e9\nMP,GYZ,1,4.0e9\nMP,GXZ,1,3.0e9\n"), "m-kg-s")
    modes = [np.where(body.dofs[:, 1] == i, body.nodes[body.dofs[:, 0], i], 0.0) for i in range(3)]
    C = np.array([[a @ body.K @ b for b in modes] for a in modes])
    S = np.linalg.inv(C)
    pr_xy = 0.06 * 1e11 / 2e10
    expected = np.array([[1e-11, -pr_xy / 1e11, -0.25e-11], [0, 1 / 2e10, -0.2 / 2e10], [0, 0, 1 / 3e10]])
    expected = expected + np.triu(expected, 1).T
    assert_allclose(S, expected, rtol=1e-9)
    with pytest.raises(MeshError, match="along element system 11"):
        parse_deck(cube(tmp_path, materials=words, esys=11)).ledger.require_whole()


def test_keyopt_2_of_solid186_is_full_integration(tmp_path):
    by_points = body_of(deck_of(tmp_path, beam_text()), "m-kg-s")
    text = beam_text().replace("EXTOPT,ATTR", "KEYOP,    1,  2,     1\nEXTOPT,ATTR", 1)
    full = body_of(deck_of(tmp_path, text), "m-kg-s")
    difference = (full.K - by_points.K).toarray()
    assert np.abs(difference).max() > 1e-3 * abs(full.K).max()
    assert la.eigvalsh(difference).min() > -1e-9 * abs(full.K).max()  # the full rule adds energy to every motion


def test_damping_of_a_deck_is_named(tmp_path):
    words = STEEL + "MP,DMPR,1,.02\nALPHAD,3.5\nBETAD,1.0e-5\nDMPRAT,0.\n"
    rows = parse_deck(cube(tmp_path, materials=words)).ledger.rows()
    assert ("ALPHAD", "1", "damping (VALUE = 3.5) is left out: give the job a table [damping]") in rows
    assert {row[0] for row in rows if "damping" in row[2]} == {"ALPHAD", "BETAD", "MPDATA, DMPR"}
