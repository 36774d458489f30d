"""CalculiX: matrices and substructure of a bar of two bricks (data/calculix), against what it printed."""

import gzip
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

import fe_models
from fe_models.errors import BodyError, MatrixError

DATA = Path(__file__).parent / "data" / "calculix"
SI = fe_models.unit_system("m-kg-s")
DIGITS = 1e-6  #: of the frequencies that CalculiX prints with seven digits


def unpack(name, folder):
    """Write the matrices of one deck of the data into a folder, and return their paths."""
    paths = []
    for suffix in (".sti", ".mas"):
        paths.append(folder / f"{name}{suffix}")
        paths[-1].write_bytes(gzip.decompress((DATA / f"{name}{suffix}.gz").read_bytes()))
    return [*paths, DATA / f"{name}.dof"]


def printed_frequencies(text):
    """Frequencies of a .dat file, imaginary ones as zero, (n,) [Hz]."""
    table = text.split("P A R T I C I P A T I O N")[0].splitlines()
    rows = [line.split() for line in table if len(line.split()) == 5]
    return np.array([float(row[3]) for row in rows if row[0].isdigit()])


def body_of(paths, deck, **options):
    return fe_models.files.body_from_foreign(
        fe_models.files.read_matrices(paths), fe_models.files.read_geometry(deck), name="bar", units=SI, **options
    )


def frequencies(body):
    values = la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)
    return np.sqrt(np.abs(values)) / (2 * np.pi)


@pytest.mark.parametrize(("name", "held", "rigid"), [("bar", False, 6), ("bar_held", True, 0)])
def test_frequencies_are_those_that_calculix_printed(name, held, rigid, tmp_path):
    body = body_of(unpack(name, tmp_path), DATA / f"{name}.inp", held=held)
    theirs = printed_frequencies((DATA / f"{name}.dat").read_text())
    assert len(theirs) == 10
    assert_allclose(frequencies(body)[rigid:10], theirs[rigid:], rtol=DIGITS, atol=0)
    assert body.is_held == held
    assert body.provenance["triangles"] == "K upper, M upper"


def test_matrices_are_those_of_our_elements_on_the_same_mesh(tmp_path):
    """C3D20 with the full 27 points; the files have 14 digits."""
    body = body_of(unpack("bar", tmp_path), DATA / "bar.inp")
    steel = fe_models.Material("steel", E=210e9, nu=0.3, rho=7850.0)
    ours = fe_models.solid_body(fe_models.read_mesh(DATA / "bar.inp"), steel, name="ours", units=SI)
    order = np.lexsort((body.dofs[:, 1], body.dofs[:, 0]))
    mine = np.lexsort((ours.dofs[:, 1], ours.dofs[:, 0]))
    assert_array_equal(body.dofs[order], ours.dofs[mine])
    for name in ("K", "M"):
        theirs = getattr(body, name).toarray()[np.ix_(order, order)]
        expected = getattr(ours, name).toarray()[np.ix_(mine, mine)]
        assert_allclose(theirs, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_a_body_whose_supports_were_taken_out_of_the_rows_is_held(tmp_path):
    paths = unpack("bar_held", tmp_path)
    with pytest.raises(BodyError, match="declare the body as held"):
        body_of(paths, DATA / "bar_held.inp")
    with pytest.raises(MatrixError, match="still not free"):
        body_of(paths, DATA / "bar_held.inp", remove_supports=True)


def test_a_list_of_dofs_that_does_not_fit_is_refused(tmp_path):
    stiffness, mass, _ = unpack("bar", tmp_path)
    with pytest.raises(MatrixError, match="expected a list of 96 dofs, one for each row, got 72"):
        fe_models.files.read_matrices([stiffness, mass, DATA / "bar_held.dof"])
    with pytest.raises(MatrixError, match="numbered 5 to 315 with gaps"):
        body_of([stiffness, mass], DATA / "bar.inp")
    wrong = tmp_path / "wrong.dof"
    wrong.write_text("5.1\n5.7\n")
    with pytest.raises(MatrixError, match=r"line 2: expected node\.component"):
        fe_models.files.read_matrices([stiffness, mass, wrong])


def test_the_stiffness_alone_brings_mass_and_dofs_from_beside_it_and_says_so(tmp_path):
    stiffness, mass, dofs = unpack("bar", tmp_path)
    shutil.copy(dofs, tmp_path)
    alone, named = fe_models.files.read_matrices(stiffness), fe_models.files.read_matrices([stiffness, mass, dofs])
    assert_array_equal(alone.M.toarray(), named.M.toarray())
    assert_array_equal(alone.dofs, named.dofs)
    assert "bar.mas taken from beside the named files" in alone.notes
    assert "bar.dof taken from beside the named files" in alone.notes
    assert sorted(Path(path).name for path in alone.files) == ["bar.dof", "bar.mas", "bar.sti"]
    other = mass.rename(tmp_path / "other.mas")
    chosen = fe_models.files.read_matrices([stiffness, other])
    assert chosen.dofs is None
    assert not chosen.notes
    assert fe_models.files.read_matrices({"K": stiffness}).dofs is None


def test_nodes_that_are_not_in_the_deck_are_named(tmp_path):
    paths = unpack("bar", tmp_path)
    deck = tmp_path / "other.inp"
    deck.write_text((DATA / "bar.inp").read_text().replace("\n315,", "\n316,").replace("315", "316"))
    with pytest.raises(MatrixError, match="1 nodes of the rows are not in the geometry, first 315"):
        body_of(paths, deck)


def test_rows_and_triangle_of_a_substructure_are_those_of_the_whole(tmp_path):
    """CalculiX 2.20 writes the block K_bb of the retained dofs of this deck, not condensed: which shows their order."""
    whole = fe_models.files.read_matrices(unpack("bar", tmp_path))
    part = fe_models.files.read_matrices(DATA / "bar_sub.mtx")
    key = {(node, component): row for row, (node, component) in enumerate(whole.dofs.tolist())}
    b = [key[node, component] for node, component in part.dofs.tolist()]
    assert len(b) == 40
    K_bb = whole.K.toarray()[np.ix_(b, b)]
    assert_allclose(part.K.toarray(), K_bb, rtol=0, atol=1e-12 * np.abs(K_bb).max())
    assert part.triangle == {"K": "upper"}


def test_a_condensed_substructure_of_abaqus_layout_is_a_free_body(tmp_path):
    """Both matrices, two nodes with all dofs and one with other ones, four numbers to a line: written here."""
    whole = fe_models.files.read_matrices(unpack("bar", tmp_path))
    ends = [205, 215, 5, 35, 225, 305]
    b = np.concatenate([np.flatnonzero(whole.dofs[:, 0] == node) for node in ends])
    i = np.setdiff1d(np.arange(whole.n_dof), b)
    K, M = whole.K.toarray(), whole.M.toarray()
    T = np.zeros((whole.n_dof, len(b)))
    T[b], T[i] = np.eye(len(b)), -np.linalg.solve(K[np.ix_(i, i)], K[np.ix_(i, b)])
    lines = ["**", "** SUBSTRUCTURE", "*USER ELEMENT, NODES=  6, LINEAR", "** ELEMENT NODES"]
    lines += ["** 205, 215, 5, 35,", "** 225, 305", " 1, 2, 3"]
    for name, A in (("STIFFNESS", T.T @ K @ T), ("MASS", T.T @ M @ T)):
        lines.append(f"*MATRIX,TYPE={name}")
        for column in range(len(b)):
            words = [f"{value:.17e}" for value in A[: column + 1, column]]
            lines += [", ".join(words[k : k + 4]) + "," for k in range(0, len(words), 4)]
    path = tmp_path / "part.mtx"
    path.write_text("\n".join(lines) + "\n")
    body = body_of(path, DATA / "bar.inp")
    assert not body.is_held
    order = np.argsort(b)
    values = la.eigh(body.K.toarray(), body.M.toarray(), eigvals_only=True)
    expected = la.eigh((T.T @ K @ T)[np.ix_(order, order)], (T.T @ M @ T)[np.ix_(order, order)], eigvals_only=True)
    assert_allclose(values[6:], expected[6:], rtol=1e-9, atol=0)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text[: len(text) // 2], "expected 820 entries, one triangle of 40 rows"),
        (lambda text: text.replace("** ELEMENT NODES", "** NODES"), "and 0 nodes"),
        (lambda text: text.replace("TYPE=STIFFNESS", "TYPE=LOAD"), "unknown matrix"),
        (lambda text: text.replace("         3,         3", "         3,         8"), "expected dofs 1 to 6"),
        (lambda text: text.replace("         3,         3", "        99,         3"), "expected position 1 to 40"),
        (lambda text: text.replace("0.1084401709402E+10", "nan", 1), "expected finite numbers"),
    ],
)
def test_a_damaged_substructure_is_refused(change, words, tmp_path):
    path = tmp_path / "sub.mtx"
    path.write_text(change((DATA / "bar_sub.mtx").read_text()))
    with pytest.raises(MatrixError, match=words):
        fe_models.files.read_matrices(path)


@pytest.mark.external
def test_what_calculix_writes_today_is_read_and_gives_its_frequencies(tmp_path):
    if shutil.which("ccx") is None:
        pytest.skip("CalculiX (ccx) is not installed: Debian package calculix-ccx")
    deck = (DATA / "bar.inp").read_text()
    (tmp_path / "bar.inp").write_text(deck)
    (tmp_path / "modes.inp").write_text(deck.replace(", SOLVER=MATRIXSTORAGE", ""))
    for name in ("bar", "modes"):
        subprocess.run(["ccx", name], cwd=tmp_path, check=True, capture_output=True)
    body = body_of([tmp_path / f"bar.{suffix}" for suffix in ("sti", "mas", "dof")], tmp_path / "bar.inp")
    theirs = printed_frequencies((tmp_path / "modes.dat").read_text())
    assert_allclose(frequencies(body)[6:10], theirs[6:10], rtol=DIGITS, atol=0)
    assert_allclose(body.M.sum(), 3 * 7850 * 0.3 * 0.1 * 0.05, rtol=1e-12, atol=0)
