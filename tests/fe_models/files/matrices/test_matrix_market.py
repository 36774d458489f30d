"""Matrix Market, MATLAB, SciPy and Harwell-Boeing files: a chain of masses written by their own libraries."""

import io
import zipfile

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.sparse as sp
from numpy.testing import assert_array_equal

import fe_models
from fe_models.errors import MatrixError

N_NODES = 4
NUMBERS = np.array([40, 10, 30, 20])  #: of the nodes, in the order of the rows
K1 = sp.diags_array([[2.5, 3.0, 3.0, 2.5], [-1.1] * 3, [-1.1] * 3], offsets=[0, 1, -1])
K = sp.csc_array(sp.kron(K1, sp.csc_array([[2.0, 0.3, 0.0], [0.3, 1.0, 0.1], [0.0, 0.1, 1.7]])))
M = sp.csc_array(sp.kron(sp.diags_array([1.0, 2.0, 2.0, 1.0]), sp.eye_array(3)))
DOFS = np.stack([np.repeat(NUMBERS, 3), np.tile(np.arange(3), 4)], axis=1)
COUNTED = DOFS + np.array([0, 1])  #: components from 1
NODES = np.arange(12.0).reshape(4, 3)


def same(read, *, dofs=True):
    assert_array_equal(read.K.toarray(), K.toarray())
    assert_array_equal(read.M.toarray(), M.toarray())
    if dofs:
        assert_array_equal(read.dofs, DOFS)


def write_list(path, table):
    with path.open("wb") as file:
        scipy.io.mmwrite(file, np.asarray(table, dtype=float))


@pytest.fixture
def market(tmp_path):
    for name, matrix in (("K", K), ("M", M)):
        scipy.io.mmwrite(tmp_path / f"{name}.mtx", sp.coo_array(matrix), symmetry="symmetric", precision=17)
    scipy.io.mmwrite(tmp_path / "general.mtx", sp.coo_array(K), symmetry="general", precision=17)
    scipy.io.mmwrite(tmp_path / "dense.mtx", K.toarray(), symmetry="symmetric", precision=17)
    scipy.io.mmwrite(tmp_path / "whole.mtx", K.toarray(), symmetry="general", precision=17)
    write_list(tmp_path / "nodes.txt", NUMBERS[:, None].astype(float))
    write_list(tmp_path / "rows.txt", DOFS[:, :1].astype(float))
    write_list(tmp_path / "pairs.txt", (COUNTED).astype(float))
    return tmp_path


@pytest.mark.parametrize("rows", ["nodes.txt", "rows.txt", "pairs.txt"])
def test_a_matrix_market_pair_with_the_nodes_of_its_rows(market, rows):
    read = fe_models.files.read_matrices([market / "K.mtx", market / "M.mtx", market / rows])
    same(read)
    assert read.triangle == {"K": "lower", "M": "diagonal"}


@pytest.mark.parametrize(("name", "kind"), [("general.mtx", "both"), ("dense.mtx", "lower"), ("whole.mtx", "both")])
def test_every_form_of_a_matrix_market_file_is_read(market, name, kind):
    read = fe_models.files.read_matrices({"K": market / name, "M": market / "M.mtx"})
    same(read, dofs=False)
    assert read.triangle["K"] == kind


def test_an_upper_triangle_under_a_symmetric_header_is_mirrored_too(tmp_path):
    text = "%%MatrixMarket matrix coordinate real symmetric\n% of another program\n2 2 3\n1 1 2.0\n1 2 -1.0\n2 2 2.0\n"
    (tmp_path / "K.mtx").write_text(text)
    read = fe_models.files.read_matrices(tmp_path / "K.mtx")
    assert_array_equal(read.K.toarray(), [[2.0, -1.0], [-1.0, 2.0]])
    assert read.triangle == {"K": "upper"}


BANNER = "%%MatrixMarket matrix coordinate real symmetric\n"


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("%%MatrixMarket matrix coordinate complex symmetric\n1 1 1\n1 1 1.0 0.5\n", "expected a real matrix"),
        ("%%MatrixMarket matrix coordinate real hermitian\n1 1 1\n1 1 1.0\n", "got hermitian"),
        ("%%MatrixMarket matrix coordinate pattern symmetric\n1 1 1\n1 1\n", "expected a real matrix"),
        (BANNER + "2 2 3\n1 1 2.0\n1 2 -1.0\n2 1 -1.0\n", "lists both entries of 1 pairs"),
        (BANNER.replace("symmetric", "general") + "2 2 3\n1 1 2.0\n2 1 -1.0\n2 2 2.0\n", "only the lower triangle"),
        (BANNER + "2 2 4\n1 1 2.0\n2 1 -1.0\n2 2 2.0\n", "expected 4 entries by its header, got 3"),
        (BANNER + "2 3 1\n1 1 2.0\n", "expected a square matrix, got 2 x 3"),
        (BANNER + "2 2 2\n1 1 2.0\n3 3 2.0\n", "expected rows and columns 1 to 2, got 1 to 3"),
        (BANNER + "900000000000 900000000000 1\n1 1 2.0\n", "expected at most"),
        (BANNER + "2 2\n", "expected 3 sizes"),
        (BANNER + "% only comments\n", "expected a line of sizes"),
        ("%%MatrixMarket matrix array real general\n900000 900000\n1.0\n", "expected 810000000000 numbers"),
        (BANNER + "2 2 1\n1 1 nan\n", "line 3: expected two whole numbers and a real"),
    ],
)
def test_what_is_wrong_with_a_matrix_market_file_is_said(text, words, tmp_path):
    (tmp_path / "K.mtx").write_text(text)
    with pytest.raises(MatrixError) as caught:
        fe_models.files.read_matrices(tmp_path / "K.mtx")
    assert words in str(caught.value)


def test_a_list_of_nodes_has_to_fit(market):
    write_list(market / "three.txt", np.array([[1.0], [2.0], [3.0]]))
    with pytest.raises(MatrixError, match="expected 3 or 6 of 12 rows to each node of the list, got 3 nodes"):
        fe_models.files.read_matrices([market / "K.mtx", market / "M.mtx", market / "three.txt"])
    write_list(market / "odd.txt", np.array([[1.0], [1.0], [3.0]]))
    with pytest.raises(MatrixError, match="expected each node 3 or 6 times"):
        fe_models.files.read_matrices([market / "K.mtx", market / "M.mtx", market / "odd.txt"])


# MATLAB


def matlab_7(path, content):
    """Write what `save -v7.3` writes, as far as a reader sees it: arrays transposed, sparse ones in groups."""
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, value in content.items():
            if sp.issparse(value):
                group = file.create_group(name)
                group.attrs["MATLAB_sparse"] = np.uint64(value.shape[0])
                group["data"], group["ir"] = value.data, value.indices.astype(np.uint64)
                group["jc"] = value.indptr.astype(np.uint64)
            elif np.iscomplexobj(value):
                pair = np.zeros(value.T.shape, dtype=[("real", float), ("imag", float)])
                pair["real"], pair["imag"] = value.T.real, value.T.imag
                file[name] = pair
            else:
                file[name] = np.asarray(value).T
    with path.open("r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: test".ljust(124) + b"\x00\x02IM")


CONTENT = {"K": K, "M": M, "dofs": COUNTED, "nodes": np.column_stack([NUMBERS, NODES])}


@pytest.mark.parametrize("write", [scipy.io.savemat, matlab_7])
def test_a_matlab_file_brings_matrices_dofs_and_nodes(write, tmp_path):
    path = tmp_path / "model.mat"
    write(path, CONTENT)
    read = fe_models.files.read_matrices(path)
    same(read)
    assert_array_equal(read.nodes, NODES)
    assert_array_equal(read.node_numbers, NUMBERS)


@pytest.mark.parametrize("write", [scipy.io.savemat, matlab_7])
@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"K": K.toarray() * (1 + 1e-3j)}, "got a complex one"),
        ({"K": np.ones((3, 4))}, "expected a square matrix, got 3 x 4"),
        ({"K": np.full((12, 12), np.nan)}, "expected finite numbers"),
        ({"M": np.eye(11)}, "expected 12 rows as the matrix before it, got 11"),
        ({"dofs": DOFS}, "component 1 to 6"),
        ({"nodes": np.ones((4, 2))}, "expected a table with 3 or 4 columns"),
        ({"dofs": COUNTED[:5]}, "dofs: expected 12, one for each row of the matrices, got 5"),
    ],
)
def test_what_is_wrong_with_a_matlab_file_is_said(write, change, words, tmp_path):
    path = tmp_path / "model.mat"
    write(path, CONTENT | change)
    with pytest.raises(MatrixError) as caught:
        fe_models.files.read_matrices(path)
    assert words in str(caught.value)


def test_matrices_by_other_names_are_asked_for(tmp_path):
    path = tmp_path / "model.mat"
    scipy.io.savemat(path, {"Ksys": K, "Msys": M})
    with pytest.raises(MatrixError, match="say which is which"):
        fe_models.files.read_matrices(path)
    same(fe_models.files.read_matrices(path, names={"K": "Ksys", "M": "Msys"}), dofs=False)
    with pytest.raises(MatrixError, match="did you mean 'Ksys'"):
        fe_models.files.read_matrices(path, names={"K": "Ksis"})


def test_a_matlab_file_that_claims_more_than_it_has_is_refused(tmp_path):
    path = tmp_path / "model.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file.create_dataset("K", shape=(10**6, 10**6), dtype=float, chunks=(100, 100))
    with pytest.raises(MatrixError, match="K claims 8000000000000 bytes and has 0"):
        fe_models.files.read_matrices(path)


@pytest.mark.parametrize("write", [scipy.io.savemat, matlab_7])
def test_a_truncated_matlab_file_is_one_message(write, tmp_path):
    path = tmp_path / "model.mat"
    write(path, CONTENT)
    path.write_bytes(path.read_bytes()[:-700])
    with pytest.raises(MatrixError, match=r"model\.mat"):
        fe_models.files.read_matrices(path)


# SciPy, NumPy, Harwell-Boeing


def test_archives_of_scipy_and_numpy(tmp_path):
    sp.save_npz(tmp_path / "K.npz", K)
    sp.save_npz(tmp_path / "mass.npz", sp.coo_array(M))
    np.savez(tmp_path / "both.npz", K=K.toarray(), M=M.toarray(), dofs=COUNTED)
    same(fe_models.files.read_matrices([tmp_path / "K.npz", tmp_path / "mass.npz"]), dofs=False)
    same(fe_models.files.read_matrices(tmp_path / "both.npz"))
    np.savez(tmp_path / "K.npz", K=np.array([{}], dtype=object))
    with pytest.raises(MatrixError, match="it is damaged or of another kind"):
        fe_models.files.read_matrices(tmp_path / "K.npz")


def test_an_archive_that_claims_more_than_it_has_is_refused(tmp_path):
    indptr = np.zeros(2, np.int32)
    part = {
        "format": b"csc",
        "shape": np.array([1, 1]),
        "data": np.ones(1),
        "indices": np.zeros(1, int),
        "indptr": indptr,
    }
    buffer = io.BytesIO()
    np.lib.format.write_array_header_1_0(buffer, {"descr": "<f8", "fortran_order": False, "shape": (10**11,)})
    with zipfile.ZipFile(tmp_path / "K.npz", "w") as archive:
        for name, value in part.items():
            out = io.BytesIO()
            np.save(out, value)
            archive.writestr(f"{name}.npy", buffer.getvalue() if name == "data" else out.getvalue())
    with pytest.raises(MatrixError, match=r"K\.npz"):
        fe_models.files.read_matrices(tmp_path / "K.npz")


def harwell_boeing(path, A, kind="RSA"):
    """Write the lower triangle by columns (RSA) or all of it (RUA), as the format of 1992 has it."""
    stored = sp.csc_array(sp.tril(A)) if kind == "RSA" else sp.csc_array(A)
    stored.sort_indices()

    def block(values, form, width):
        words = [form % value for value in values]
        return ["".join(words[k : k + width]) for k in range(0, len(words), width)]

    parts = [
        block(stored.indptr + 1, "%10d", 8),
        block(stored.indices + 1, "%10d", 8),
        block(stored.data, "%25.16E", 3),
    ]
    n = [len(part) for part in parts]
    head = ["chain".ljust(72) + "CHAIN   ", "".join(f"{k:14d}" for k in (sum(n), *n, 0))]
    head.append(kind.ljust(14) + "".join(f"{k:14d}" for k in (*A.shape, stored.nnz, 0)))
    head.append("(8I10)".ljust(16) + "(8I10)".ljust(16) + "(3E25.16)".ljust(20) + "".ljust(20))
    path.write_text("\n".join([*head, *parts[0], *parts[1], *parts[2]]) + "\n")


@pytest.mark.parametrize("kind", ["RSA", "RUA"])
def test_harwell_boeing_files(kind, tmp_path):
    harwell_boeing(tmp_path / "K.rsa", K, kind)
    harwell_boeing(tmp_path / "mass.hb", M, kind)
    read = fe_models.files.read_matrices([tmp_path / "K.rsa", tmp_path / "mass.hb"])
    same(read, dofs=False)
    assert read.triangle["K"] == ("lower" if kind == "RSA" else "both")


def test_what_is_wrong_with_a_harwell_boeing_file_is_said(tmp_path):
    path = tmp_path / "K.rsa"
    harwell_boeing(path, K)
    text = path.read_text()
    path.write_text(text.replace("RSA", "CSA"))
    with pytest.raises(MatrixError, match="expected a real, assembled matrix"):
        fe_models.files.read_matrices(path)
    path.write_text(text.replace(f"{12:14d}{12:14d}", f"{12:14d}{10**13:14d}"))
    with pytest.raises(MatrixError, match="expected the numbers of rows, columns and entries"):
        fe_models.files.read_matrices(path)
    path.write_text(text[:-200])
    with pytest.raises(MatrixError, match=r"K\.rsa"):
        fe_models.files.read_matrices(path)
