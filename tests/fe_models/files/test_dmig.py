"""DMIG cards and OP2 data blocks, against pyYeti; damage in one message."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal
from pyyeti.nastran import bulk
from pyyeti.nastran import op2 as pyyeti_op2

from fe_models.errors import MatrixError, MeshError
from fe_models.files.nastran.bulk_data.cards import read_cards
from fe_models.files.nastran.matrices.dti import SCALAR
from fe_models.files.nastran.matrices.op2 import read_op2
from fe_models.files.nastran.matrices.parts import dmig_matrices

DATA = Path(__file__).parent / "data" / "nastran"
HEAD = "DMIG,K,0,6,2,0\n"


def matrices_of(text):
    return dmig_matrices(read_cards("deck", text))


def test_matrices_of_a_punch_file_are_those_that_pyyeti_reads():
    """Square, symmetric from one triangle, complex and rectangular, with grid and scalar points."""
    ours = dmig_matrices(read_cards("deck", (DATA / "matrix_factory.pch").read_text()))
    theirs = bulk.rddmig(str(DATA / "matrix_factory.pch"))
    assert [(matrix.name, matrix.form, matrix.kind) for matrix in ours] == [
        ("PATRN", 1, 2), ("IDENT", 6, 2), ("RANDM", 1, 2), ("CMPLX", 9, 4),
    ]  # fmt: skip
    for matrix in ours:
        table = theirs[matrix.name.lower()]
        assert_array_equal(matrix.matrix.toarray(), table.to_numpy())
        points = [(number, component - 1 if component else SCALAR) for number, component in table.index]
        assert_array_equal(matrix.rows, points)


def test_small_large_and_free_fields_say_the_same():
    small = (
        "DMIG    K              0       6       2       0\n"
        "DMIG    K              7       1               7       1     2.5\n"
        "DMIG    K              7       1               9       0    -1.5\n"
        "DMIG    K              9       0               9       0    4.-1\n"
    )
    large = (
        HEAD + "DMIG*   K                              7               1\n"
        "*                      7               1            2.5\n"
        "*                      9               0      -1.5D+00\n"
        "DMIG*   K                              9               0\n"
        "*                      9               0          4.0-1\n"
    )
    free = HEAD + "DMIG,K,7,1,,7,1,2.5,,+\n+,9,0,-1.5\ndmig,k,9,0,,9,0,.4\n"
    for text in (small, large, free):
        (matrix,) = matrices_of(text)
        assert_array_equal(matrix.matrix.toarray(), [[2.5, -1.5], [-1.5, 0.4]])
        assert_array_equal(matrix.rows, [(7, 0), (9, SCALAR)])


def test_a_square_matrix_has_the_same_rows_and_columns():
    (matrix,) = matrices_of("DMIG,A,0,1,2,0\nDMIG,A,1,1,,2,1,5.0\n")
    assert_array_equal(matrix.matrix.toarray(), [[0, 0], [5, 0]])
    assert_array_equal(matrix.columns, matrix.rows)


def test_amplitude_and_phase_are_real_and_imaginary_part():
    (matrix,) = matrices_of("DMIG,A,0,1,4,0,1\nDMIG,A,1,1,,1,1,2.0,90.0\n")
    assert abs(matrix.matrix.toarray()[0, 0] - 2j) < 1e-15


def test_a_rectangular_matrix_has_the_columns_of_its_header():
    (matrix,) = matrices_of("DMIG,P,0,9,2,0,,,4\nDMIG,P,3,0,,1,2,5.0\n")
    assert_array_equal(matrix.matrix.toarray(), [[0, 0, 5, 0]])
    assert_array_equal(matrix.columns[:, 0], [1, 2, 3, 4])


@pytest.mark.parametrize(
    ("text", "word"),
    [
        ("DMIG,K,1,1,,1,1,1.0", "without a header"),
        (HEAD + HEAD, "second header"),
        (HEAD, "no entries"),
        ("DMIG,K,0,5,2,0", "form 1, 2, 6 or 9"),
        ("DMIG,K,0,6,8,0", "type 1 to 4"),
        ("DMIG,K,0,9,2,0,,,2000000000", "up to 10000000 columns"),
        ("DMIG,K,0,9,2,0,,,2\nDMIG,K,3,0,,1,1,1.0", "column from 1 to 2"),
        (HEAD + "DMIG,K,1,1,,1,1,1.0\nDMIG,K,1,1,,1,1,1.0", "an entry twice or both entries of a pair"),
        (HEAD + "DMIG,K,1,1,,1,2,1.0\nDMIG,K,1,2,,1,1,1.0", "both entries of a pair"),
        ("DMIG,K,0,1,2,0\nDMIG,K,1,1,,1,1,1.0\nDMIG,K,1,1,,1,1,1.0", "an entry twice, in row 1, component 1"),
        (HEAD + "DMIG,K,1,7,,1,1,1.0", "component 0 to 6"),
        (HEAD + "DMIG,K,1,1,,1,1,1.0,2.0", "imaginary part"),
        (HEAD + "DMIG,K,1,1,,1,1,one", "expected a real number, got 'one'"),
        (HEAD + "DMIG,K,1,1,,1,1,1.0,,+,2", "more than nine fields"),
        (HEAD + "DMIG,K,1,1,,1,1", "expected a real number, got ''"),
    ],
)
def test_cards_that_make_no_matrix_are_refused(text, word):
    with pytest.raises((MatrixError, MeshError), match=word):
        matrices_of(text)


@pytest.mark.parametrize("name", ["double_be.op2", "single_le.op2"])
def test_data_blocks_of_op2_files_are_matrices(name):
    """The same numbers in singles and doubles, little and big endian, and those of the file of OP4 beside it."""
    theirs = pyyeti_op2.rdmats(str(DATA / name))
    ours = read_op2(DATA / name)
    assert [matrix.matrix.shape for matrix in ours] == [(25, 31)] * 3
    assert [matrix.is_complex for matrix in ours] == [False, True, True]
    for matrix in ours:
        assert_array_equal(matrix.matrix.toarray(), theirs[matrix.name])


def test_op2_files_cut_anywhere_are_refused_or_lack_whole_blocks(tmp_path):
    content = (DATA / "double_be.op2").read_bytes()
    whole = {matrix.name: matrix.matrix for matrix in read_op2(DATA / "double_be.op2")}
    path = tmp_path / "cut.op2"
    for size in range(0, len(content), 97):
        path.write_bytes(content[:size])
        try:
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                found = read_op2(path)
        except MatrixError:
            continue
        for matrix in found:
            assert (matrix.matrix != whole[matrix.name]).nnz == 0


def test_an_op2_matrix_too_large_in_full_takes_no_memory(tmp_path):
    """A trailer that speaks of two thousand million rows."""
    content = (DATA / "double_be.op2").read_bytes()
    rows = np.array([31, 25], ">i4").tobytes()  # columns, rows of a trailer
    path = tmp_path / "huge.op2"
    path.write_bytes(content.replace(rows, np.array([31, 2_000_000_000], ">i4").tobytes(), 1))
    with pytest.raises(MatrixError, match="2000000000 rows and 31 columns"):
        read_op2(path)


def test_other_files_are_no_op2_files(tmp_path):
    path = tmp_path / "mesh.op2"
    path.write_bytes(b"$MeshFormat")
    with pytest.raises(MatrixError, match="no OP2 file"):
        read_op2(path)
    with pytest.raises(MatrixError, match="no such file"):
        read_op2(tmp_path / "none.op2")
