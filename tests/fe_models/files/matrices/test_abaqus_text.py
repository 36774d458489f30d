"""Matrices of Abaqus: `*MATRIX GENERATE` of a block of C3D10 (data/abaqus, with its licence), and files of ours."""

import gzip
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import fe_models
from fe_models.errors import MatrixError

DATA = Path(__file__).parent / "data" / "abaqus"


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    """Paths of the stiffness and the mass of the block, unpacked."""
    folder = tmp_path_factory.mktemp("block")
    paths = []
    for name in ("blockC3D10_STIF1.mtx", "blockC3D10_MASS1.mtx"):
        paths.append(folder / name)
        paths[-1].write_bytes(gzip.decompress((DATA / f"{name}.gz").read_bytes()))
    return paths


def plain(path):
    """Return the matrix of a file of lines `row column value`, by NumPy's reader and one entry after the other."""
    table = np.loadtxt(path)
    n = int(table[:, :2].max())
    A = np.zeros((n, n))
    for i, j, value in table:
        A[int(i) - 1, int(j) - 1] = value
    return A


def test_entries_are_those_of_the_file_to_the_last_bit(block):
    read = fe_models.files.read_matrices(block)
    assert_array_equal(read.K.toarray(), plain(block[0]))
    assert_array_equal(read.M.toarray(), plain(block[1]))
    assert read.triangle == {"K": "both", "M": "both"}
    assert set(read.files) == {str(path) for path in block}


def test_one_triangle_is_mirrored_and_said(block, tmp_path):
    lines = block[0].read_text().splitlines()
    lower = [line for line in lines if int(line.split()[0]) >= int(line.split()[1])]
    path = tmp_path / "half_STIF1.mtx"
    path.write_text("\n".join(lower) + "\n")
    read = fe_models.files.read_matrices(path)
    assert_array_equal(read.K.toarray(), plain(block[0]))
    assert read.triangle == {"K": "lower"}


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1 1 2.0\n2 2 3.0", "the last line does not end"),
        ("1 1 2.0\n2 2 3.0D+03\n", "line 2: expected two whole numbers and a real"),
        ("1 1 2.0\n2 2 1.5-3\n", "line 2: expected two whole numbers and a real"),
        ("1 1 2.0\n2 2 1.5e\n", "line 2: expected two whole numbers and a real"),
        ("1 1 2.0 0.5\n2 2 1.5 0.1\n", "are the values complex"),
        ("1 1 2.0\n2 2\n", "expected three numbers on each line"),
        ("1 1 2.0\n0 2 1.0\n", "line 2: Row index out of bounds"),
        ("1 1 2.0\n2 2 1e400\n", "expected a finite number"),
        ("1 1 2.0\n2 2 1.0\n2 2 1.0\n", "1 entries are listed twice"),
        ("1 1 2.0\n1 2 1.0\n2 1 -1.0\n2 2 1.0\n", "expected a symmetric matrix"),
        ("1 1 2.0\n999999999999 2 1.0\n", "expected at most 27 rows in a file of 27 bytes"),
        ("heading\n", "or *MATRIX GENERATE, COORDINATE (Abaqus), got a file that begins"),
        ("", "the file is empty"),
    ],
)
def test_a_damaged_file_is_refused_with_one_message(text, words, tmp_path):
    path = tmp_path / "model_STIF1.mtx"
    path.write_text(text)
    with pytest.raises(MatrixError) as caught:
        fe_models.files.read_matrices(path)
    assert words in str(caught.value)
    assert "model_STIF1.mtx" in str(caught.value)


def test_a_file_that_does_not_say_which_matrix_it_holds_is_asked_for(tmp_path):
    path = tmp_path / "a.mtx"
    path.write_text("1 1 2.0\n2 2 3.0\n")
    with pytest.raises(MatrixError, match="is this the stiffness, the mass or the damping"):
        fe_models.files.read_matrices(path)
    assert fe_models.files.read_matrices({"M": path}).triangle == {"M": "diagonal"}
