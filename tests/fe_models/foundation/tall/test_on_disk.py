"""Tall arrays on disk: the numbers of arrays in memory, without their memory."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from cms.linear_algebra.memory.size import resident_bytes
from cms.modes.families.families import Families
from fe_models.elements.interfaces import nodes_interface, rigid_interface
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.errors import StorageError
from fe_models.foundation.tall import on_disk as room
from fe_models.foundation.tall.columns import beside, combine, combined, copied, dots, in_memory, inner, subtract
from fe_models.foundation.tall.on_disk import is_on_disk, on_disk, release, row_slices
from fe_models.meshes.selections import NodeSet
from tests.bodies import STEEL, box_mesh


@pytest.fixture
def tiny(monkeypatch):
    """Everything is large, and slices have few rows."""
    monkeypatch.setattr(room, "LARGE", 0)
    monkeypatch.setattr(room, "SLICE_BYTES", 1.0)


def stored(X):
    kept = on_disk(X.shape)
    kept[:] = X
    release(kept)
    return kept


def test_numbers_stay_where_memory_is_given_back(tiny):
    X = np.random.default_rng(0).standard_normal((100, 7))
    kept = stored(X)
    assert is_on_disk(kept[3:, 2:4].T)
    assert not is_on_disk(X)
    assert_array_equal(kept, X)
    for made in (copied(kept), beside(kept[:, :3], X[:, 3:])):
        assert is_on_disk(made)
        assert_array_equal(made, X)
    assert not is_on_disk(in_memory(kept))
    assert_array_equal(in_memory(kept[:, 2:5]), X[:, 2:5])
    assert [rows.stop - rows.start for rows in row_slices(slice(10, 50), kept)] == [16, 16, 8]
    assert list(row_slices(100, X)) == [slice(0, 100)]


def test_memory_of_a_large_array_is_given_back():
    kept = on_disk((2000, 5000))
    kept[:] = 1.0
    touched = resident_bytes()
    release(kept)
    assert touched - resident_bytes() > 0.9 * kept.nbytes
    assert kept[1999, 4999] == 1.0


def test_tall_products_are_those_of_arrays_in_memory(tiny):
    rng = np.random.default_rng(1)
    X, Y, C = rng.standard_normal((90, 8)), rng.standard_normal((90, 8)), rng.standard_normal((8, 6))
    assert_allclose(inner(stored(X), stored(Y)), X.T @ Y, rtol=0, atol=1e-12)
    assert_allclose(combine(stored(X), C), X @ C, rtol=0, atol=1e-12)
    assert_allclose(combined(stored(X), C), X @ C, rtol=0, atol=1e-12)
    assert_allclose(dots(stored(X), stored(X), Y[:, 0]), Y[:, 0] @ X**2, rtol=0, atol=1e-12)
    changed = stored(Y)
    subtract(changed, stored(X), np.eye(8))
    assert_allclose(changed, Y - X, rtol=0, atol=1e-12)


def test_a_body_reduced_from_disk_is_the_one_reduced_in_memory(tiny):
    """Every stage: constraint modes, interface reduction, basis, moments, stress, geometric stiffness, the file."""
    mesh = box_mesh(4, 2, 2, 0.7, 0.13, 0.21)  # no two frequencies are equal
    ends = [nodes_interface(mesh, "left", NodeSet("left")), rigid_interface(mesh, "right", NodeSet("right"))]
    body = cms.couple(solid_body(mesh, STEEL, name="block", units=cms.unit_system("m-kg-s"), interfaces=ends))
    made = []
    for to_disk in (False, True):
        with Families(body, to_disk=to_disk) as families:
            modes = cms.craig_bampton(families, 4)
            states = cms.reduction.unit_states(families)
        assert is_on_disk(modes.columns) == to_disk
        few = cms.modes.with_characteristic_modes(modes, body, 3)
        made.append((cms.reduce(body, modes, geometric=states), cms.reduce(body, few, geometric=states)))
    assert is_on_disk(made[1][0].stress)
    for inside, outside in zip(*made, strict=True):
        for path in ("K", "Phi", "stress", "moments.P", "moments.S_kl", "moments.C5", "geometric.spin"):
            expected, found = inside, outside
            for name in path.split("."):
                expected, found = getattr(expected, name), getattr(found, name)
            assert_allclose(found, expected, rtol=0, atol=1e-10 * np.abs(expected).max(), err_msg=path)


def test_no_room_is_told_before_the_work(monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.posix_fallocate", full)
    with pytest.raises(StorageError, match=r"columns of 8e-06 GB do not go to disk in .*: No space left.*TMPDIR"):
        on_disk((10, 100))
