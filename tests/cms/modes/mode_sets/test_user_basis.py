from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose, assert_array_equal

from cms.errors import ModeSetError
from cms.modes.mode_sets.classical import craig_bampton
from cms.modes.mode_sets.given_columns import user_basis
from cms.modes.mode_sets.mesh_field import coupled_field
from cms.reduction.reduction import reduce
from fe_models.body.couplings.couplings import couple
from fe_models.body.fe_body import Interface
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from tests.bodies import bar, beam, with_interfaces

ROUNDOFF = 1e-12


def body_of(kinds):
    free = bar(nx=3, kind="hexahedron")
    return couple(
        replace(free, interfaces=[replace(x, kind=kind) for x, kind in zip(free.interfaces, kinds, strict=True)])
    )


@pytest.fixture(scope="module")
def body():
    return body_of(["rigid", "distributing"])


@pytest.fixture(scope="module")
def modes(body):
    return craig_bampton(body, n_modes=4)


@pytest.mark.parametrize(
    "kinds", [("rigid", "rigid"), ("rigid", "distributing"), ("distributing", "nodes"), ("nodes", "rigid")]
)
def test_a_field_of_the_mesh_returns_to_the_coupled_body_it_came_from(kinds):
    body = body_of(kinds)
    columns = craig_bampton(body, n_modes=3).columns.copy()
    columns[body.dofs[:, 1] < 0] = 0.0  # a multiplier is a force, not a displacement
    field = coupled_field(body, body.mesh_displacement(columns))
    assert_allclose(field.columns, columns, rtol=0, atol=1e4 * ROUNDOFF * np.abs(columns).max())
    assert all(part < 1e-9 for part in field.departure.values())


def test_rigid_motion_of_the_mesh_is_rigid_motion_of_the_coupled_body():
    free = bar(nx=3, kind="hexahedron")
    body = body_of(["rigid", "distributing"])
    motion = coupled_field(body, rigid_motion_of_dofs(free.nodes, free.dofs)).columns
    assert_allclose(motion, rigid_motion_of_dofs(body.nodes, body.dofs), rtol=0, atol=1e2 * ROUNDOFF)


def test_motion_a_rigid_interface_cannot_follow_is_measured(body):
    stretch = np.zeros((body.recovery.matrix.shape[0], 1))
    stretch[1::3, 0] = body.nodes[: len(stretch) // 3, 1] - 0.025  # y about the middle of the bar: no rigid part
    assert coupled_field(body, stretch).departure["left"] == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("suffix", ["array", ".npy", ".npz"])
def test_the_columns_of_another_set_give_its_reduced_body(body, modes, suffix, tmp_path):
    expected = reduce(body, modes).free_frequencies
    given = modes.columns
    if suffix == ".npy":
        np.save(tmp_path / "modes.npy", modes.columns)
        given = tmp_path / "modes.npy"
    elif suffix == ".npz":
        np.savez(tmp_path / "modes.npz", columns=modes.columns, labels=modes.labels, frequencies=modes.frequencies)
        given = str(tmp_path / "modes.npz")
    basis = user_basis(body, columns=given)
    assert_allclose(reduce(body, basis).free_frequencies, expected, rtol=1e-9)
    if suffix == ".npz":
        assert basis.labels == modes.labels
        assert_array_equal(basis.frequencies, modes.frequencies)
    else:
        assert basis.labels[:2] == ("user 1", "user 2")


def test_columns_over_the_mesh_are_brought_to_the_coupled_body(body, modes):
    basis = user_basis(body, columns=body.mesh_displacement(modes.columns))
    assert_allclose(reduce(body, basis).free_frequencies, reduce(body, modes).free_frequencies, rtol=1e-8)
    assert "motion of interface left that is not rigid" in basis.options


@pytest.mark.parametrize(
    ("columns", "text"),
    [
        (np.zeros((7, 2)), r"expected \(54, k\) over the coupled dofs or \(48, k\) over the dofs of the mesh, got"),
        (np.zeros(54), "got"),
        (np.zeros((54, 0)), "got"),
        (np.full((54, 1), np.nan), "NaN"),
        (np.ones((54, 1), complex), "real numbers"),
        ("nowhere.npz", "no such file"),
        (None, "columns: missing; give an array"),
    ],
)
def test_columns_that_do_not_fit_are_refused(body, columns, text):
    with pytest.raises(ModeSetError, match=text):
        user_basis(body, columns=columns)


def test_wrong_labels_are_refused(body, modes):
    with pytest.raises(ModeSetError, match="16 columns need as many labels"):
        user_basis(body, columns=modes.columns, labels=["one"])


def test_files_that_hold_something_else_are_refused(body, tmp_path):
    (tmp_path / "text.npy").write_text("no array")
    np.save(tmp_path / "pickle.npy", np.array([{"a": 1}], dtype=object), allow_pickle=True)
    np.savez(tmp_path / "other.npz", modes=np.eye(3))
    (tmp_path / "broken.npz").write_bytes(b"PK\x03\x04 no")
    for name, text in (
        ("text.npy", "not a readable"),
        ("pickle.npy", "not a readable"),
        ("other.npz", "expected an array named 'columns', got modes"),
        ("broken.npz", "not a readable"),
    ):
        with pytest.raises(ModeSetError, match=text):
            user_basis(body, columns=tmp_path / name)


# As many dofs of the mesh as of the coupled body ---------------------------------------------------------------------


@pytest.fixture(scope="module")
def pinned():
    """A beam held by single nodes: six dofs become six, at another place."""
    free = beam(10)
    ends = [Interface(name, "rigid", np.array([node]), free.nodes[node]) for name, node in (("a", 0), ("b", 10))]
    return with_interfaces(free, *ends)


@pytest.fixture(scope="module")
def free_modes(pinned):
    """Free modes over the dofs of the mesh, rigid ones first, and their frequencies."""
    omega2, V = la.eigh(pinned.K.toarray(), pinned.M.toarray())
    return V[:, :16], np.sqrt(omega2[6:16]) / (2 * np.pi)


def test_rows_that_may_be_those_of_mesh_or_coupled_body_must_be_told(pinned, free_modes):
    body = couple(pinned)
    V, frequencies = free_modes
    assert len(V) == body.n_dof
    with pytest.raises(ModeSetError, match=r'66 rows may be .* columns_over = "coupled" or columns_over = "mesh"'):
        user_basis(body, columns=V)
    reduced = reduce(body, user_basis(body, columns=V, columns_over="mesh"))
    assert_allclose(reduced.free_frequencies, frequencies, rtol=1e-9)
    coupled = coupled_field(body, V).columns
    assert not np.allclose(coupled, V)
    reduced = reduce(body, user_basis(body, columns=coupled, columns_over="coupled"))
    assert_allclose(reduced.free_frequencies, frequencies, rtol=1e-9)


def test_rows_that_look_like_the_other_dofs_are_refused(pinned, free_modes):
    body = couple(pinned)
    V, _ = free_modes
    with pytest.raises(ModeSetError, match=r'columns_over = "coupled": with these dofs.*give columns_over = "mesh"'):
        user_basis(body, columns=V, columns_over="coupled")
    with pytest.raises(ModeSetError, match=r'columns_over = "mesh": with these dofs.*give columns_over = "coupled"'):
        user_basis(body, columns=coupled_field(body, V).columns, columns_over="mesh")
    # columns that do not tell either way are taken as they are said to be
    assert user_basis(body, columns=np.eye(66), columns_over="coupled").columns.shape == (66, 66)


def test_what_is_told_of_the_rows_is_checked(body, modes):
    with pytest.raises(ModeSetError, match="columns_over = 'mash': unknown; did you mean 'mesh'"):
        user_basis(body, columns=modes.columns, columns_over="mash")
    with pytest.raises(ModeSetError, match=r"expected \(48, k\) over the dofs of the mesh, got \(54, 16\)"):
        user_basis(body, columns=modes.columns, columns_over="mesh")


def test_an_uncoupled_mesh_is_its_own_body(pinned, free_modes):
    """Without rigid or distributing interfaces there is one order of dofs only."""
    body = couple(beam(10))
    V, frequencies = free_modes
    for over in (None, "mesh", "coupled"):
        reduced = reduce(body, user_basis(body, columns=V, columns_over=over))
        assert_allclose(reduced.free_frequencies, frequencies, rtol=1e-9)


def test_what_a_rigid_interface_leaves_out_and_false_frequencies_are_told(body, pinned, free_modes, caplog):
    stretch = np.zeros((body.recovery.matrix.shape[0], 1))
    stretch[1::3, 0] = body.nodes[: len(stretch) // 3, 1] - 0.025
    user_basis(body, columns=stretch)
    assert "100 % of the motion of rigid interface 'left'" in caplog.text
    caplog.clear()
    V, frequencies = free_modes
    stated = np.r_[np.full(6, np.nan), frequencies]
    user_basis(couple(pinned), columns=V, columns_over="mesh", frequencies=stated)
    assert not caplog.text
    user_basis(couple(pinned), columns=V, columns_over="mesh", frequencies=1e3 * stated)
    assert "has the stated frequency" in caplog.text
