"""Binary files of ANSYS: against ansys-mapdl-reader and the frequency that ANSYS found; damage in one message."""

import warnings
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.errors import MatrixError
from fe_models.files import read_matrices
from fe_models.files.ansys.full import read_full
from fe_models.files.ansys.sub import SCALAR, read_sub

DATA = Path(__file__).parent / "data" / "ansys"
FULL, SUB = DATA / "HexBeam_clamped.full", DATA / "cp56.sub"


@pytest.fixture(scope="module")
def beam():
    return read_full(FULL)


@pytest.fixture(scope="module")
def cube():
    return read_sub(SUB)


def test_matrices_of_a_full_file_are_those_that_ansys_mapdl_reader_reads(beam):
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        from ansys.mapdl import reader

    theirs = reader.read_binary(str(FULL))
    dofs, K, M = theirs.load_km()
    held = {tuple(row) for row in theirs.const.tolist()}
    free = np.array([tuple(row) not in held for row in dofs.tolist()])
    assert_array_equal(beam.dofs, dofs[free])
    assert {tuple(row) for row in beam.removed.tolist()} == held
    for mine, other in ((beam.K, K), (beam.M, M)):
        assert_array_equal(sp.triu(mine).toarray(), np.asarray(other.todense())[np.ix_(free, free)])
        assert (mine != mine.T).nnz == 0


def test_the_first_frequency_is_the_one_that_ansys_found(beam):
    """1283.2004 Hz, of a SOLID186 beam with one end held; two bending modes of a square section."""
    largest = la.eigvalsh(beam.M.toarray(), beam.K.toarray(), subset_by_index=[898, 899])
    assert_allclose(np.sqrt(1 / largest) / (2 * np.pi), 1283.2004, rtol=1e-7)


def test_a_superelement_has_the_mass_and_centre_that_its_file_says(cube):
    """A cube of 30 mm with 7850 in place of 7.85e-9: mass 2.1195e8, centre 15 15 15, moments of its record of mass."""
    assert cube.mass == pytest.approx(7850 * 30**3, rel=1e-12)
    numbers = sorted(cube.positions)
    nodes = np.array([cube.positions[number] for number in numbers])
    is_modal = cube.dofs[:, 1] == SCALAR
    dofs = cube.dofs.copy()
    dofs[:, 0] = np.searchsorted(numbers, dofs[:, 0])
    G = np.zeros((246, 6))
    G[~is_modal] = rigid_motion_of_dofs(nodes, dofs[~is_modal], np.zeros(3))
    gram = G.T @ cube.M @ G
    assert_allclose(np.diag(gram)[:3], cube.mass, rtol=1e-9)
    # static moments m (0, -z, y; ...) with the centre in the middle
    centre = np.array([[0, 1, -1], [-1, 0, 1], [1, -1, 0]]) * 15.0
    assert_allclose(gram[:3, 3:], cube.mass * centre, rtol=0, atol=1e-9 * cube.mass * 15)
    assert_allclose(cube.K @ G, 0, rtol=0, atol=1e-10 * abs(cube.K).max())


def test_modal_coordinates_come_last_and_belong_to_no_node(cube):
    assert cube.K.shape == cube.M.shape == (246, 246)
    assert len(cube.positions) == 80
    assert_array_equal(cube.dofs[240:], [(k, SCALAR) for k in range(1, 7)])
    assert abs(cube.K[:240, 240:]).max() < 1e-9 * abs(cube.K).max()  # Craig-Bampton: modes do not strain the statics
    assert not cube.loads.any()
    assert cube.systems == {}


def test_both_are_read_as_matrices(beam, cube):
    full, sub = read_matrices(FULL), read_matrices(SUB)
    assert_array_equal(full.K.toarray(), beam.K.toarray())
    assert full.triangle == {"K": "upper", "M": "upper"}
    assert_array_equal(full.removed[np.lexsort(full.removed.T[::-1])], beam.removed[np.lexsort(beam.removed.T[::-1])])
    assert_array_equal(sub.M.toarray(), cube.M)
    assert sub.dofs[-1].tolist() == [1206, SCALAR]


def changed(tmp_path, source, at, value):
    words = np.fromfile(source, "<i4")
    words[at] = value
    path = tmp_path / source.name
    words.tofile(path)
    return path


READERS = {FULL: read_full, SUB: read_sub}


@pytest.mark.parametrize(
    ("source", "word", "value", "text"),
    [
        (FULL, 105, 7, "kind -4, got 7"),
        (FULL, 105 + 1, 2**31 - 1, "do not fit a file"),
        (FULL, 105 + 32, 2**31 - 1, "do not fit a file"),
        (FULL, 105 + 1, 900, "expected 900 numbers|equations 900"),
        (FULL, 105 + 10, 1, "lumped"),
        (FULL, 105 + 13, 1, "unsymmetric"),
        (FULL, 105 + 20, 3, "constraint equations"),
        (FULL, 105 + 18, 2**30, "truncated"),
        (FULL, 105 + 19, 1, "truncated"),
        (FULL, 105 + 18, 0, "expected a stiffness"),
        (FULL, 536, 2**30, "truncated"),
        (FULL, 536 + 2, 964, "upper triangle"),
        (FULL, 536 + 3, 9, "length 1 at its beginning and 9 at its end"),
        (FULL, 541, 0x40000000, "flag 0x40000000"),
        (FULL, 130463 + 3 - 4, 20, "label 20|equations|numbers"),
        (SUB, 105 + 1, 2**31 - 1, "do not fit"),
        (SUB, 105 + 8, 2**31 - 1, "do not fit"),
        (SUB, 105 + 8, 81, "expected 81 numbers"),
        (SUB, 105 + 43, 3, "cannot be brought together"),
        (SUB, 105 + 9, 1, "unsymmetric"),
        (SUB, 105 + 13, 1, "stress stiffness"),
        (SUB, 105 + 20, 1, "transformed"),
        (SUB, 105 + 10, 0, "expected a stiffness"),
        (SUB, 105 + 21, 2**30, "truncated"),
        (SUB, 105 + 21, 6108 + 495, "says a mass of 2.1195e"),  # one record on: mass in place of stiffness
        (SUB, 6108 + 2 + 201, 0x43000000, "expected a symmetric stiffness"),  # K[0, 100]
        (SUB, 930, -5, "expected numbers from 1"),
        (SUB, 930, 1910, "two rows are the same dof"),
        (SUB, 924, 20, "labels 1 to 6"),
        (SUB, 6033 + 1, 0, "says a mass"),
    ],
)
def test_what_does_not_fit_is_refused_in_words(tmp_path, source, word, value, text):
    path = changed(tmp_path, source, word, value)
    with pytest.raises(MatrixError, match=text) as caught:
        READERS[source](path)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("source", [FULL, SUB])
def test_files_that_are_cut_are_refused(tmp_path, source):
    content = source.read_bytes()
    end = {FULL: 4 * 191678, SUB: 4 * 250143}[source]  # of the last record that is read
    for size in (0, 3, 8, 400, 500, 900, 2000, 10000, end // 3 + 1, end - 5):
        path = tmp_path / source.name
        path.write_bytes(content[:size])
        with pytest.raises(MatrixError) as caught:
            READERS[source](path)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("source", [FULL, SUB])
def test_the_other_byte_order_and_other_files_are_named(tmp_path, source):
    path = tmp_path / source.name
    np.fromfile(source, "<i4").astype(">i4").tofile(path)
    with pytest.raises(MatrixError, match="big-endian"):
        READERS[source](path)
    path.write_bytes(b"/COM,ANSYS RELEASE 2019" * 40)
    with pytest.raises(MatrixError, match="no ANSYS file"):
        READERS[source](path)
    with pytest.raises(MatrixError, match="kind"):
        READERS[source]({FULL: SUB, SUB: FULL}[source])
