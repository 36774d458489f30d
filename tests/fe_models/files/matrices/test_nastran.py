"""Files of Nastran by `read_matrices`: matrices, rows and places of OP4, punch and OP2 files together."""

import shutil
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.errors import MatrixError
from fe_models.files import read_matrices
from fe_models.files.nastran.matrices.superelement import read_superelement
from fe_models.files.nastran.matrices.write_op4 import write_op4

DATA = Path(__file__).parent.parent / "data" / "nastran"


def test_an_op4_file_takes_rows_and_places_from_the_punch_file_beside_it():
    """In basic axes: the matrices of `read_superelement`, which turns them in another way."""
    read = read_matrices(DATA / "outboard.op4")
    element = read_superelement(DATA / "outboard.op4")
    assert_array_equal(read.dofs, element.dofs)
    for role in "KM":
        mine, other = getattr(read, role).toarray(), getattr(element, role).toarray()
        assert_allclose(mine, other, rtol=0, atol=1e-14 * abs(other).max())
    assert_array_equal(read.node_numbers, [3, 11, 19, 27])
    assert_allclose(read.nodes, [element.positions[number] for number in (3, 11, 19, 27)])
    assert "rows and node positions of outboard.op4 were read from outboard.pch" in " ".join(read.notes)
    assert {"MUG1", "MEF1"} <= set(read.others)


def test_the_same_files_named_one_by_one_are_the_same_model(tmp_path):
    shutil.copy(DATA / "outboard.op4", tmp_path / "matrices.op4")
    alone = read_matrices(tmp_path / "matrices.op4")
    assert alone.dofs is None
    read = read_matrices([tmp_path / "matrices.op4", DATA / "outboard.pch"])
    whole = read_matrices(DATA / "outboard.op4")
    assert_array_equal(read.dofs, whole.dofs)
    assert_array_equal(read.K.toarray(), whole.K.toarray())


def test_matrices_of_other_names_are_named(tmp_path):
    rng = np.random.default_rng(1)
    A = rng.standard_normal((4, 4))
    write_op4(tmp_path / "a.op4", {"STIF": A + A.T, "MASS": np.eye(4), "PX": np.ones((4, 2))})
    with pytest.raises(MatrixError, match="kaa"):
        read_matrices(tmp_path / "a.op4")
    read = read_matrices(tmp_path / "a.op4", names={"K": "stif", "M": "MASS"})
    assert_array_equal(read.K.toarray(), A + A.T)
    assert sorted(read.loads) == ["PX 1", "PX 2"]


def test_one_triangle_is_mirrored_and_said_where_its_form_is_symmetric(tmp_path):
    content = (
        "DMIG,KAAX,0,6,2,0\nDMIG,KAAX,1,1,,1,1,2.0,,+\n+,1,2,-1.0\nDMIG,KAAX,1,2,,1,2,3.0\n"
        "DMIG,MAAX,0,6,2,0\nDMIG,MAAX,1,2,,1,2,7.0\nGRID,1,,1.,2.,3.\n"
    )
    (tmp_path / "k.pch").write_text(content)
    read = read_matrices(tmp_path / "k.pch")
    assert_array_equal(read.K.toarray(), [[2, -1], [-1, 3]])
    assert_array_equal(read.M.toarray(), [[0, 0], [0, 7]])  # its row is brought to the one of the stiffness
    assert_array_equal(read.dofs, [(1, 0), (1, 1)])
    assert_array_equal(read.nodes, [[1, 2, 3]])


def test_one_triangle_of_a_square_matrix_is_refused(tmp_path):
    write_op4(tmp_path / "k.op4", {"KAA": sp.csc_array(np.tril(np.ones((3, 3)))), "MAA": np.eye(3)})
    with pytest.raises(MatrixError, match="only the lower triangle"):
        read_matrices(tmp_path / "k.op4")


def test_complex_matrices_and_other_rows_are_refused(tmp_path):
    with pytest.raises(MatrixError, match="complex"):
        read_matrices(DATA / "double_be.op2", names={"K": "ZUZR02"})
    shutil.copy(DATA / "outboard.pch", tmp_path / "k.pch")
    write_op4(tmp_path / "k.op4", {"KAA": np.eye(3), "MAA": np.eye(3)})
    with pytest.raises(MatrixError, match="46 rows, the matrices have 3"):
        read_matrices(tmp_path / "k.op4")
    (tmp_path / "empty.pch").write_text("$ nothing\nPARAM,POST,-1\n")
    with pytest.raises(MatrixError, match=r"expected matrices \(DMIG\)"):
        read_matrices(tmp_path / "empty.pch")


def test_structural_damping_is_said_to_be_left_out(tmp_path):
    write_op4(tmp_path / "k.op4", {"KAA": np.eye(3), "MAA": np.eye(3), "K4AA": 0.02 * np.eye(3), "BAA": np.eye(3)})
    read = read_matrices(tmp_path / "k.op4")
    assert any("K4AA: structural damping is left out" in note for note in read.notes)
    assert_array_equal(read.D.toarray(), np.eye(3))
