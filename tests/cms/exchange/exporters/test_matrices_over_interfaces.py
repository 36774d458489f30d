"""Files of matrices over the interfaces: what other programs' readers, or readers by documentation, find in them."""

import re
from dataclasses import replace

import h5py
import numpy as np
import pytest
import scipy.io
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms.errors import ExportError
from cms.reduction.interface_model import interface_model
from fe_models.body.fe_body import Interface
from tests.bodies import bar, with_interfaces
from tests.cms.exchange.exporters.examples import reduced_bar
from tests.cms.exchange.exporters.small_bodies import RUBBER


@pytest.fixture(scope="module")
def reduced():
    return reduced_bar()


@pytest.fixture(scope="module")
def model(reduced):
    return interface_model(reduced)


def export(body, tmp_path, name, to, **options):
    return cms.exchange.export_body(body, tmp_path / name, to=to, units="m-kg-s", **options)


def test_mat_of_version_5(reduced, model, tmp_path):
    export(reduced, tmp_path, "bar.mat", "mat")
    found = scipy.io.loadmat(tmp_path / "bar.mat")
    for name, matrix in {"K": model.K, "M": model.M, "D": model.D, "F": model.loads, "T": model.T}.items():
        assert_array_equal(found[name], matrix)
    assert_array_equal(found["dofs"][:7], [[1, 1], [1, 2], [1, 3], [1, 4], [1, 5], [1, 6], [2, 1]])
    assert [name.strip() for name in found["interfaces"]] == ["left", "right"]
    assert_array_equal(found["nodes"], [node.position for node in model.nodes])
    assert_array_equal(found["R"].reshape(-1, 3, len(model.K)), model.recovery())
    assert b"bar" in found["__header__"]
    head = (tmp_path / "bar.mat").read_bytes()
    export(reduced, tmp_path, "again.mat", "mat")
    assert head == (tmp_path / "again.mat").read_bytes()  # no time in it


def test_mat_of_version_7_3(reduced, model, tmp_path):
    """MATLAB's container: 116 bytes of words, version 0x0200 and IM, HDF5 from byte 512; arrays transposed."""
    export(reduced, tmp_path, "bar.mat", "mat73")
    head = (tmp_path / "bar.mat").read_bytes()[:520]
    assert head.startswith(b"MATLAB 7.3 MAT-file")
    assert head[116:128] == bytes(8) + b"\x00\x02IM"
    assert head[512:516] == b"\x89HDF"
    with h5py.File(tmp_path / "bar.mat") as file:
        for name, matrix in {"K": model.K, "M": model.M, "F": model.loads, "T": model.T}.items():
            assert_array_equal(file[name][()].T, matrix)
            assert file[name].attrs["MATLAB_class"] == b"double"
        words = file["interfaces"]
        assert words.attrs["MATLAB_class"] == b"char"
        assert words.attrs["MATLAB_int_decode"] == 2
        rows = ["".join(chr(letter) for letter in row) for row in words[()].T]
    assert [row.strip() for row in rows] == ["left", "right"]


def test_simscape_has_frames_and_matrices_of_a_free_solid(reduced, model, tmp_path):
    export(reduced, tmp_path, "rom.mat", "simscape")
    rom = scipy.io.loadmat(tmp_path / "rom.mat", simplify_cells=True)["rom"]
    assert rom["P"].shape == (2, 3)
    assert_array_equal(rom["K"], model.K)
    assert_array_equal(rom["C"], model.D)
    omega2 = la.eigvalsh(rom["K"], rom["M"])  # the block wants six rigid motions
    assert (np.abs(omega2[:6]) < 1e-8 * omega2[6]).all()
    assert_allclose(np.sqrt(omega2[6:]) / 2 / np.pi, reduced.free_frequencies, rtol=1e-6)


def test_matrix_market_reads_back_bit_for_bit(reduced, model, tmp_path):
    exported = export(reduced, tmp_path, "bar.mtx", "matrix-market")
    assert [path.name for path in exported.files] == ["bar_K.mtx", "bar_M.mtx", "bar_C.mtx", "bar_F.mtx"]
    for letter, matrix in {"K": model.K, "M": model.M, "C": model.D, "F": model.loads}.items():
        assert_array_equal(scipy.io.mmread(tmp_path / f"bar_{letter}.mtx").toarray(), matrix)
    text = (tmp_path / "bar_K.mtx").read_text()
    assert "symmetric" in text.splitlines()[0]
    assert "row 9: right uz" in text


def test_op4_is_read_by_pyyeti_bit_for_bit(reduced, model, tmp_path):
    op4 = pytest.importorskip("pyyeti.nastran.op4", reason="pyYeti is not installed: pip install 'floatframe[nastran]'")
    exported = export(reduced, tmp_path, "bar.op4", "nastran-op4")
    assert [path.suffix for path in exported.files] == [".op4", ".asm", ".pch"]
    found = {name.lower(): matrix for name, matrix in op4.read(str(tmp_path / "bar.op4")).items()}
    expected = {"kxx": model.K, "mxx": model.M, "bxx": model.D, "px": model.loads}
    for name, matrix in expected.items():
        values = found[name]
        assert_array_equal(values.toarray() if hasattr(values, "toarray") else values, matrix)


def test_asm_and_pch_say_the_order_of_the_rows(reduced, model, tmp_path):
    bulk = pytest.importorskip(
        "pyyeti.nastran.bulk", reason="pyYeti is not installed: pip install 'floatframe[nastran]'"
    )
    export(reduced, tmp_path, "bar.op4", "nastran-op4")
    extrn = bulk.rdextrn(str(tmp_path / "bar.pch"))
    expected = [(k + 1, c + 1) for k in range(2) for c in range(6)] + [(1000001 + k, 0) for k in range(3)]
    assert_array_equal(extrn, expected)
    spoints = bulk.rdspoints(str(tmp_path / "bar.asm"))
    assert_array_equal(np.ravel(spoints), [1000001, 1000002, 1000003])
    grids = bulk.rdgrids(str(tmp_path / "bar.asm"))
    assert_allclose(grids[:, 2:5], [node.position for node in model.nodes], rtol=1e-9, atol=1e-12)


def test_dmig_is_read_by_pyyeti_to_ten_digits(reduced, model, tmp_path):
    bulk = pytest.importorskip(
        "pyyeti.nastran.bulk", reason="pyYeti is not installed: pip install 'floatframe[nastran]'"
    )
    export(reduced, tmp_path, "bar.pch", "nastran-dmig")
    found = bulk.rddmig(str(tmp_path / "bar.pch"))
    for name, matrix in {"kaax": model.K, "maax": model.M, "baax": model.D}.items():
        values = found[name].to_numpy()
        rows = [tuple(row) for row in found[name].index]
        assert rows == [(k + 1, c + 1) for k in range(2) for c in range(6)] + [(1000001 + k, 0) for k in range(3)]
        assert_allclose(values, matrix, rtol=1e-9, atol=1e-30)


def flex_ascii(text):
    """A reader of FlexASCII by OpenFAST's documentation: keywords are case insensitive, headers begin with !."""
    lines = text.splitlines()
    assert lines[0].startswith("!")
    assert "flex 5 format" in lines[1].lower()
    n = int(re.search(r"^!dimension:\s*(\d+)", text.lower(), re.MULTILINE)[1])
    found = {}
    for name in ("mass matrix", "stiffness matrix", "damping matrix", "loading"):
        at = next(k for k, line in enumerate(lines) if line.lower().startswith(f"!{name}"))
        rows = lines[at + 2 : at + 2 + n] if name != "loading" else lines[at + 2 :]
        found[name] = np.array([[float(word) for word in row.split()] for row in rows])
    return found


def test_ext_ptfm_has_one_node_and_constant_loads(tmp_path):
    body = reduced_bar("left")
    model = interface_model(body)
    exported = export(body, tmp_path, "bar.dat", "ext_ptfm", loads={"tip": 3.0})
    found = flex_ascii((tmp_path / "bar.dat").read_text())
    assert_array_equal(found["mass matrix"], model.M)
    assert_array_equal(found["stiffness matrix"], model.K)
    assert_array_equal(found["damping matrix"], model.D)
    loading = found["loading"]
    assert loading.shape == (2, len(model.K) + 2)
    assert_allclose(loading[:, 1:-1], np.tile(3 * model.loads[:, 0], (2, 1)), rtol=1e-15)
    assert_array_equal(loading[:, 0], [0, 10000])
    assert any("the body is free" in note for note in exported.notes)
    assert "static load tip, amplitude 3" in exported.notes


def test_ext_ptfm_wants_one_interface_and_known_loads(reduced, tmp_path):
    with pytest.raises(ExportError, match=r"one interface node, body 'bar' has 2 \(left, right\)"):
        export(reduced, tmp_path, "bar.dat", "ext_ptfm")
    with pytest.raises(ExportError, match=r"no load case 'tipp'; did you mean 'tip'"):
        export(reduced_bar("left"), tmp_path, "bar.dat", "ext_ptfm", loads={"tipp": 1.0})
    with pytest.raises(ExportError, match="mat cannot hold constant loads"):
        export(reduced, tmp_path, "bar.mat", "mat", loads={"tip": 1.0})
    assert not list(tmp_path.iterdir())


def test_our_own_reader_of_superelements_finds_the_same(reduced, model, tmp_path):
    from cms.exchange.programs.nastran import read_nastran

    exported = export(reduced, tmp_path, "bar.op4", "nastran-op4")
    found = read_nastran(exported.files, "bar")
    assert_array_equal(found.K, model.K)
    assert_array_equal(found.M, model.M)
    assert_array_equal(found.D, model.D)
    assert_array_equal(found.loads["load 1"], model.loads[:, 0])
    rows = found.recovery.dofs
    translations = found.recovery.matrix[rows[:, 1] < 3].reshape(-1, 3, len(model.K))
    assert_array_equal(translations, model.recovery())
    places = dict(zip(found.node_numbers.tolist(), found.nodes, strict=True))
    kept = [places[2000001 + k] for k in range(len(reduced.nodes))]
    assert_allclose(kept, model.mesh_positions(), rtol=1e-9, atol=1e-12)
    # members of rigid interfaces turn with them; of other nodes no rotation is on record
    left = reduced.interface("left").members[0]
    turn = found.recovery.matrix[(rows[:, 0] == 2000001 + left) & (rows[:, 1] >= 3)]
    assert_allclose(turn, np.eye(6, len(model.K))[3:], rtol=0, atol=1e-9)


WITHOUT_NAMES = {"mat": "bar.mat", "mat73": "bar.mat", "nastran-dmig": "bar.pch"}


@pytest.mark.parametrize("to", WITHOUT_NAMES)
def test_superelements_come_back_with_their_frequencies(to, reduced, tmp_path):
    """Through `cms.exchange.import_body`: its own modes and frame, the same free body; ten digits of DMIG."""
    exported = export(reduced, tmp_path, WITHOUT_NAMES[to], to)
    back = cms.exchange.import_body(exported.files, units="m-kg-s")
    assert back.n_q == reduced.n_q
    assert_allclose(back.free_frequencies, reduced.free_frequencies, rtol=1e-6 if to == "nastran-dmig" else 1e-8)
    assert_allclose(back.moments.m, reduced.moments.m, rtol=1e-8)
    assert back.moments.missing == ("3C", "4C", "5C")
    own = ["left", "right"] if to in ("mat", "mat73") else ["node 1", "node 2"]  # where the file holds them
    assert [each.name for each in back.interfaces] == own
    places = [back.frame.origin + back.frame.axes @ each.position for each in back.interfaces]
    expected = [reduced.frame.origin + reduced.frame.axes @ each.position for each in reduced.interfaces]
    assert_allclose(places, expected, rtol=0, atol=1e-9)


def test_a_user_element_of_abaqus_holds_dofs_and_triangles(reduced, model, tmp_path):
    """The reader of substructures of Abaqus and CalculiX: modes are dof 1 of nodes of their own."""
    from fe_models.files.read_matrices import read_matrices

    export(reduced, tmp_path, "bar.inp", "abaqus")
    (tmp_path / "bar.inp").rename(tmp_path / "bar.mtx")
    found = read_matrices(tmp_path / "bar.mtx")
    for name, matrix in {"K": model.K, "M": model.M, "D": model.D}.items():
        assert_array_equal(getattr(found, name).toarray(), matrix)
    expected = [(k + 1, c) for k in range(2) for c in range(6)] + [(1000001 + k, 0) for k in range(3)]
    assert_array_equal(found.dofs, expected)
    text = (tmp_path / "bar.mtx").read_text()
    assert "*USER ELEMENT, TYPE=U1, NODES=5, LINEAR" in text
    assert "1, 1, 2, 1000001, 1000002, 1000003" in text  # the element and its nodes
    places = np.array(
        [line.split(", ") for line in text.partition("*NODE\n")[2].split("*")[0].splitlines()], dtype=float
    )
    assert_array_equal(places[:2, 1:], [node.position for node in model.nodes])


def test_comments_of_bulk_data_hold_the_whole_header_in_72_columns(reduced, tmp_path):
    """Nastran reads 72 columns of a comment; what a header says beyond them goes on in the next line."""
    long = "x".join(str(k) for k in range(60))
    body = replace(reduced, provenance={**reduced.provenance, "made of": long})
    export(body, tmp_path, "bar.pch", "nastran-dmig")
    lines = (tmp_path / "bar.pch").read_text().splitlines()
    comments = [line for line in lines if line.startswith("$")]
    assert max(len(line) for line in lines) <= 72
    assert all(line.startswith("$ ") for line in comments)
    assert f"made of: {long}" in "".join(line[2:] for line in comments)
    assert "".join(line[2:] for line in comments).count(long) == 1
    assert comments[-1] == "$ case control: K2GG = KAAX, M2GG = MAAX, B2GG = BAAX, P2G = PAX"


def test_grids_of_bulk_data_hold_the_components_that_the_body_lacks(tmp_path):
    """A point of three translations is held in its rotations, one of six in nothing: fields 7 of GRID."""
    body = bar(nx=4, material=RUBBER)
    right = next(interface for interface in body.interfaces if interface.name == "right")
    one = Interface("corner", "nodes", right.nodes[:1], body.nodes[right.nodes[0]])
    left = next(interface for interface in body.interfaces if interface.name == "left")
    coupled = cms.couple(with_interfaces(body, left, one))
    made = cms.reduce(coupled, cms.craig_bampton(coupled, n_modes=2), geometric=False)
    export(made, tmp_path, "bar.pch", "nastran-dmig")
    lines = (tmp_path / "bar.pch").read_text().splitlines()
    grids = [k for k, line in enumerate(lines) if line.startswith("GRID*")]
    assert [lines[k + 1][40:56].strip() for k in grids] == ["", "456"]
