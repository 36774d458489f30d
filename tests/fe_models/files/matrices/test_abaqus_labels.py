"""Abaqus' MATRIX INPUT: lines with numbers of nodes, here written from Abaqus' own block with other numbers."""

import gzip
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_array_equal

import fe_models
from fe_models.errors import MatrixError

DATA = Path(__file__).parent / "data" / "abaqus"


def write_labelled(path, A, numbers):
    """Write the lower triangle as Abaqus does, blanks and all."""
    entries = sp.coo_array(sp.tril(A))
    with path.open("w") as file:
        for i, j, value in zip(entries.row, entries.col, entries.data, strict=True):
            file.write(f"{numbers[i // 3]},{i % 3 + 1}, {numbers[j // 3]},{j % 3 + 1}, {value: .17e}\n")


@pytest.fixture(scope="module")
def block(tmp_path_factory):
    """Matrices by COORDINATE, and the paths of both as MATRIX INPUT, nodes numbered 7, 1014, 21, ... at random."""
    folder = tmp_path_factory.mktemp("block")
    for name in ("STIF1", "MASS1"):
        source = DATA / f"blockC3D10_{name}.mtx.gz"
        (folder / f"plain_{name}.mtx").write_bytes(gzip.decompress(source.read_bytes()))
    plain = fe_models.files.read_matrices([folder / "plain_STIF1.mtx", folder / "plain_MASS1.mtx"])
    numbers = np.random.default_rng(2).permutation(257) * 7 + 7
    write_labelled(folder / "block_STIF1.mtx", plain.K, numbers)
    write_labelled(folder / "block_MASS1.mtx", plain.M, numbers)
    return plain, numbers, [folder / "block_STIF1.mtx", folder / "block_MASS1.mtx"]


def test_rows_find_their_nodes_to_the_last_bit(block):
    plain, numbers, paths = block
    read = fe_models.files.read_matrices(paths)
    geometry = replace(fe_models.files.read_geometry(DATA / "blockC3D10.inp"), node_numbers=numbers)
    body = fe_models.files.body_from_foreign(read, geometry, name="block", units=fe_models.unit_system("m-kg-s"))
    order = 3 * body.dofs[:, 0] + body.dofs[:, 1]
    K = plain.K.toarray()
    lower = np.tril(K) + np.tril(K, -1).T
    assert_array_equal(body.K.toarray(), lower[np.ix_(order, order)])
    assert read.triangle["K"] in ("lower", "upper", "each pair once")


def test_a_mass_that_lacks_rows_is_zero_there(tmp_path):
    (tmp_path / "a_STIF1.mtx").write_text("5,1, 5,1, 2.0\n9,1, 5,1, -1.0\n9,1, 9,1, 1.0\n9,6, 9,6, 4.0\n")
    (tmp_path / "a_MASS1.mtx").write_text("5,1, 5,1, 3.0\n9,1, 9,1, 3.0\n")
    read = fe_models.files.read_matrices([tmp_path / "a_MASS1.mtx", tmp_path / "a_STIF1.mtx"])
    assert_array_equal(read.dofs, [[5, 0], [9, 0], [9, 5]])
    assert_array_equal(read.M.toarray(), np.diag([3.0, 3.0, 0.0]))
    assert_array_equal(read.K.toarray(), [[2.0, -1.0, 0.0], [-1.0, 1.0, 0.0], [0.0, 0.0, 4.0]])
    assert read.notes == ("1 rows that M lacks are zero there",)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("1,1, 1,1, 2.0\n1,2, 1,2, 3.0", "four commas|does not end"),
        ("1,1, 1,1, 2.0\n1,11, 1,11, 3.0\n", "line 2: expected node, dof 1 to 6"),
        ("1,1, 1,1, 2.0\n1,8, 1,8, 3.0\n", "got dof 8 at node 1"),
        ("1,1, 1,1, 2.0\n-3,1, -3,1, 3.0\n", "line 2"),
        ("1,1, 1,1, 2.0, 0.5\n", "four commas"),
        ("1,1, 1,1, 2.0\n1,1, 1,1, 2.0\n", "listed twice"),
        ("1,1, 1,1, 2.0\n1,1, 2,1, 1.0\n2,1, 1,1, 3.0\n2,1, 2,1, 1.0\n", "expected a symmetric matrix"),
    ],
)
def test_a_damaged_file_is_refused(text, words, tmp_path):
    path = tmp_path / "a_STIF1.mtx"
    path.write_text(text)
    with pytest.raises(MatrixError, match=words):
        fe_models.files.read_matrices(path)


def test_files_of_two_models_do_not_mix(block, tmp_path):
    _, _, paths = block
    other = tmp_path / "other_MASS1.mtx"
    other.write_text("9001,1, 9001,1, 3.0\n")
    with pytest.raises(MatrixError, match="the files name different dofs"):
        fe_models.files.read_matrices([paths[0], other])
