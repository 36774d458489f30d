from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from cms.errors import ModeSetError
from cms.families.rigid_modes import geometric_rigid_modes
from cms.mode_sets.craig_bampton import craig_bampton
from cms.mode_sets.mesh_field import coupled_field
from cms.mode_sets.user_basis import user_basis
from cms.reduction import reduce
from fe_models.body.couplings import couple
from tests.bodies import bar

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
    motion = coupled_field(body, geometric_rigid_modes(free)).columns
    assert_allclose(motion, geometric_rigid_modes(body), rtol=0, atol=1e2 * ROUNDOFF)


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
