"""Decks of ANSYS: the beam of SOLID186 beside the matrices that ANSYS assembled of it."""

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

from cms.decks.job_text import JobRequest, job_text
from cms.jobs.body_of_job import uncoupled_body
from cms.jobs.job import read_job
from fe_models.errors import MeshError
from fe_models.foundation.stages import Stages
from fe_models.importers.decks.read_deck import read_deck
from tests.root import ROOT

DATA = ROOT / "tests" / "fe_models" / "importers" / "data" / "ansys"
#: constants of the run that wrote the matrices, psi and lbf s²/in⁴; the deck has others
E, NU, RHO = 1.69e7, 0.31, 4.1408e-4


def beam_text():
    return (DATA / "HexBeam.cdb").read_text(encoding="latin-1")


def deck_of(folder, text):
    path = folder / "beam.cdb"
    path.write_text(text, encoding="latin-1")
    return path


def body_of(path):
    text = job_text(read_deck(path), JobRequest("in-slinch-s", {}), path.name)
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
    deck = read_deck(deck_of(tmp_path, beam_text() + "D,2,UX,0.\nD,4,ALL,0.\nF,1,FY,3.5\n"))
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
        read_deck(deck_of(tmp_path, beam_text().replace(old, new)))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("ET,        1,186", "ET,        1,181", "40 element 181: this element is not known here"),
        ("EXTOPT,ATTR", "CE,1,0,2,UX,1,3,UX,-1\nEXTOPT,ATTR", "1 CE "),
        ("MPTEMP,R5.0, 1, 1,  0.00000000    ,\nMPDATA,R5.0, 1,DENS", "MP,EY,1,3\nMPDATA,R5.0, 1,DENS", "orthotropic"),
    ],
)
def test_mass_and_stiffness_are_never_left_out_unasked(tmp_path, old, new, words):
    assert old in beam_text()
    with pytest.raises(MeshError, match=words):
        read_deck(deck_of(tmp_path, beam_text().replace(old, new, 1))).ledger.require_whole()
