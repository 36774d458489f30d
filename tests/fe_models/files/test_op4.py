"""OP4 files in every variant of Nastran's, written and read; damage in one message, hostile sizes without memory."""

import struct
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp
from numpy.testing import assert_allclose, assert_array_equal
from pyyeti.nastran import op4 as pyyeti_op4

from fe_models.errors import MatrixError
from fe_models.files.nastran.matrices.op4 import is_op4, read_op4
from fe_models.files.nastran.matrices.raw_matrix import matrix_named, real_square
from fe_models.files.nastran.matrices.write_op4 import write_op4

DATA = Path(__file__).parent / "data" / "nastran"
FILES = sorted(path.name for path in DATA.glob("*.op4"))
HEAD = b"       2       2       6       2K       1P,3E24.16\n"  # a matrix of 2 x 2 in text
VARIANTS = [name for name in FILES if name.split("_")[0] in ("single", "double")]


@pytest.fixture
def pair():
    """A symmetric sparse matrix whose numbers fill the range of doubles, a dense one with an empty column, zeros."""
    rng = np.random.default_rng(7)
    A = sp.random_array((40, 40), density=0.2, rng=rng, format="csc")
    A.data *= 10.0 ** rng.integers(-150, 150, A.nnz)
    B = rng.standard_normal((7, 5))
    B[:, 2] = 0
    B[3, 1] = 0
    return {"kaa": A + A.T, "b_1": B, "ZERO": np.zeros((3, 4))}


def by_pyyeti(path):
    with np.errstate(all="ignore"):
        names, matrices, forms, kinds = pyyeti_op4.OP4().listload(str(path), sparse=(True, None))
    return {
        name.upper(): (matrix.tocsc(), form, kind)
        for name, matrix, form, kind in zip(names, matrices, forms, kinds, strict=True)
    }


def full(matrix):
    return matrix.toarray() if sp.issparse(matrix) else matrix


def spoilt_record(words, at, fault):
    """Return the words of a file with a fault in the record at a place: length, column, 0, words, strings, length."""
    end = at + 1 + words[at] // 4
    if fault == "it is truncated":
        return words[: end - 1]
    if fault == "the file ends within a record":
        return words[: at + 3]  # within its head
    words = words.copy()
    second = at + 4 + 1 + words[at + 4]  # its second string: length + 1, row, numbers
    where, value = {
        "is not the one at its beginning": (end, words[end] + 4),
        "not larger than the one before": (at + 1, words[at + 1] - 1),
        "do not add up": (at + 3, words[at + 3] + 1),
        "outside the rows": (second + 1, 7),
        "not in the order of the rows": (second + 1, 1),
    }[fault]
    words[where] = value
    return words


@pytest.mark.parametrize(
    "fault",
    ["it is truncated", "the file ends within a record", "is not the one at its beginning",
     "not larger than the one before", "do not add up", "outside the rows", "not in the order of the rows"],
)  # fmt: skip
def test_a_fault_of_a_record_names_its_column_and_byte(tmp_path, fault):
    A = np.zeros((6, 5))
    A[[1, 4]] = np.arange(1.0, 11.0).reshape(2, 5)  # two strings in each column
    path = tmp_path / "a.op4"
    write_op4(path, {"A": sp.csc_array(A)})
    words = np.fromfile(path, np.int32)
    at = 0
    for _ in range(3):  # the header and two columns
        at += 2 + words[at] // 4
    assert words[at + 1] == 3
    spoilt_record(words, at, fault).tofile(path)
    with pytest.raises(MatrixError, match=rf"column 3 of 5, at byte {4 * at} of \d+: .*{fault}"):
        read_op4(path)


@pytest.mark.parametrize("name", FILES)
def test_matrices_of_nastran_are_those_that_pyyeti_reads(name):
    ours = {matrix.name: matrix for matrix in read_op4(DATA / name)}
    theirs = by_pyyeti(DATA / name)
    assert len(theirs) > 0
    for key, (matrix, form, kind) in theirs.items():
        assert ours[key].matrix.shape == matrix.shape
        assert (ours[key].matrix != matrix).nnz == 0
        assert (ours[key].form, ours[key].kind) == (form, kind)
        assert ours[key].is_complex == (kind > 2)


@pytest.mark.parametrize("name", VARIANTS)
def test_every_variant_holds_the_same_matrices(name):
    """Byte orders, 32 and 64 bits, strings, columns, text: Nastran wrote the same three matrices into each."""
    one = {m.name: m.matrix.toarray() for m in read_op4(DATA / "double_bigmat_le.op4")}
    rtol = 1e-6 if name.startswith("single") else 1e-9 if "ascii" in name else 1e-12  # other digits in their decks
    other = {m.name.replace("MATS", "MAT"): m.matrix.toarray() for m in read_op4(DATA / name)}
    assert set(other) == set(one) == {"RMAT", "CMAT", "RCMAT"}
    for key, matrix in one.items():
        assert_allclose(other[key], matrix, rtol=rtol, atol=0)


@pytest.mark.parametrize("text", [False, True])
def test_written_matrices_come_back_bit_for_bit_here_and_in_pyyeti(tmp_path, pair, text):
    path = tmp_path / "pair.op4"
    write_op4(path, pair, text=text)
    ours, theirs = read_op4(path), by_pyyeti(path)
    assert [matrix.name for matrix in ours] == ["KAA", "B_1", "ZERO"] == list(theirs)
    for matrix, given in zip(ours, pair.values(), strict=True):
        assert_array_equal(matrix.matrix.toarray(), full(given))
        assert_array_equal(theirs[matrix.name][0].toarray(), full(given))
    assert [matrix.form for matrix in ours] == [6, 2, 2]


def test_a_float_array_of_fortran_order_and_of_integers_is_written_as_it_is(tmp_path):
    A = np.asfortranarray(np.arange(12).reshape(3, 4))
    write_op4(tmp_path / "a.op4", {"A": A})
    assert_array_equal(read_op4(tmp_path / "a.op4")[0].matrix.toarray(), A)


@pytest.mark.parametrize(
    ("matrices", "word"),
    [
        ({"too_long_": np.eye(2)}, "8 at most"),
        ({"1K": np.eye(2)}, "letter"),
        ({"K": np.eye(2), "k": np.eye(2)}, "two matrices"),
        ({"K": np.eye(2) * 1j}, "real"),
        ({"K": np.full((2, 2), np.nan)}, "finite"),
        ({"K": np.zeros((0, 3))}, "rows"),
    ],
)
def test_what_does_not_fit_is_not_written(tmp_path, matrices, word):
    with pytest.raises(MatrixError, match=word):
        write_op4(tmp_path / "k.op4", {"GOOD": np.eye(2), **matrices})
    assert list(tmp_path.iterdir()) == []


def test_a_matrix_is_found_by_name_and_only_once():
    matrices = read_op4(DATA / "outboard.op4")
    assert matrix_named("file", matrices, "KXX", "KAA").matrix.shape == (46, 46)
    with pytest.raises(MatrixError, match="expected a matrix NIX, got KXX, MXX"):
        matrix_named("file", matrices, "NIX")
    with pytest.raises(MatrixError, match="each once"):
        matrix_named("file", (*matrices, *matrices), "KXX")


def test_complex_and_oblong_matrices_are_refused_for_a_body():
    matrices = {matrix.name: matrix for matrix in read_op4(DATA / "double_bigmat_le.op4")}
    with pytest.raises(MatrixError, match=r"CMAT: is complex \(type 4\)"):
        real_square(matrices["CMAT"])
    with pytest.raises(MatrixError, match="square"):
        real_square(matrices["RMAT"])


@pytest.mark.parametrize("text", [False, True])
def test_a_file_cut_anywhere_is_refused(tmp_path, pair, text):
    path = tmp_path / "cut.op4"
    write_op4(path, {"b": pair["b_1"]}, text=text)
    content = path.read_bytes()
    last = 26 if text else 0  # bytes of a line that says nothing
    for size in range(0, len(content) - last, 7 if text else 1):
        path.write_bytes(content[:size])
        with pytest.raises(MatrixError) as caught:
            read_op4(path)
        assert str(path) in str(caught.value)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    "name", ["double_bigmat_le.op4", "double_nonbigmat_be.op4", "double_dense_le_i64.op4", "single_nonbigmat_le.op4"]
)
def test_damage_in_any_word_is_refused_without_memory_taken(tmp_path, name):
    """Every 4-byte word of the file replaced by a hostile one: never another error, never memory beyond the file's."""
    content = (DATA / name).read_bytes()[:600]
    path = tmp_path / name
    order = ">" if "_be" in name else "<"
    refusals = []
    read_op4(DATA / name)  # compiled before memory is measured
    tracemalloc.start()
    for at in range(0, len(content), 4):
        for hostile in (0x7FFFFFFF, -0x80000000, 0, 24):
            path.write_bytes(content[:at] + struct.pack(order + "i", hostile) + content[at + 4 :])
            try:
                read_op4(path)
            except MatrixError as error:
                refusals.append(str(error))
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert len(refusals) == len(content)  # the file is cut, too
    assert not any("\n" in text for text in refusals)
    assert peak < 2e6


def test_another_byte_order_inside_a_file_is_refused(tmp_path):
    little = (DATA / "double_bigmat_le.op4").read_bytes()
    big = np.frombuffer((DATA / "double_nonbigmat_be.op4").read_bytes(), "V1").tobytes()
    path = tmp_path / "mixed.op4"
    path.write_bytes(little + big)
    with pytest.raises(MatrixError, match="expected a header of 24 bytes"):
        read_op4(path)


@pytest.mark.parametrize(
    ("content", "word"),
    [
        (b"", "0 bytes"),
        (b"solid cube\n" * 10, "no OP4 file"),
        (b"\0" * 64, "no OP4 file"),
        (
            b"       2       2       6       2K       1P,3E24.16\n       1       1       3\n 1. 2. 3.\n" * 2,
            "rows 1 to 3",
        ),
        (
            b"       2       2       6       2K       1P,3E24.16\n       2       1       1\n" + b"nonsense" * 3,
            "NONSENSE",
        ),
        (b"       2       2       6       2K       3F24.16 \n       2       1       1\n" + b"nonsense" * 3, "format"),
        (
            b"       2       2       6       7K       1P,3E24.16\n       1       1       3\n 1. 2. 3.\n" * 2,
            "no OP4 file",
        ),
        (HEAD + b"       1       1       3\n 1. 2. 3.\n", "rows 1 to 3"),
        (HEAD + b"       2       1       1\n" + b"nonsense" * 3, "NONSENSE"),
        (HEAD.replace(b"1P,3E24.16", b"3F24.16") + b"       2       1       1\n 1.", "format"),
        (HEAD.replace(b"2K", b"7K") + b"       1       1       2\n 1. 2.\n", "no OP4 file"),
        (HEAD + b"       5       1       3\n 1. 2. 3.\n", "column"),
        (HEAD.replace(b"       2", b"99999999", 1) + b"       5       1       3\n 1.\n", "do not fit"),
    ],
)
def test_text_that_makes_no_matrix_is_refused_in_words(tmp_path, content, word):
    path = tmp_path / "bad.op4"
    path.write_bytes(content)
    with pytest.raises(MatrixError, match=word) as caught:
        read_op4(path)
    assert "\n" not in str(caught.value)


def test_no_file_and_a_folder_are_refused(tmp_path):
    for path in (tmp_path / "none.op4", tmp_path):
        with pytest.raises(MatrixError):
            read_op4(path)


def test_exponents_without_a_letter_are_read(tmp_path):
    path = tmp_path / "k.op4"
    path.write_bytes(
        b"       1       2       2       2K       1P,2E16.9\n       1       1       2\n"
        b" 1.500000000-101 2.500000000E+01\n       2       1       1\n 1.000000000E+00\n"
    )
    assert_array_equal(read_op4(path)[0].matrix.toarray(), [[1.5e-101], [25.0]])


def test_meshes_and_decks_are_not_taken_for_op4():
    assert not is_op4(b"$MeshFormat\n2.2 0 8\n" * 3)
    assert not is_op4((DATA / "outboard.pch").read_bytes())
    assert is_op4((DATA / "outboard.op4").read_bytes()[:4096])
    assert is_op4((DATA / "cs.op4").read_bytes()[:4096])
