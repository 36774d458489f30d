"""MBSim's input, read by names and orders of that program and compared with sums over the points of the body."""

import h5py
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from tests.cms.exchange.exporters.small_bodies import cloud_body


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    body, cloud = cloud_body()
    path = tmp_path_factory.mktemp("mbsim") / "body.h5"
    exported = cms.exchange.export_body(body, path, to="mbsim", units="m-kg-s")
    return body, cloud.in_si(body.units), path, exported


def test_integrals_are_the_sums_over_the_points(written):
    """Row 3 a + b of the position shape integral is int c_a phi_b; six blocks xx xy xz yy yz zz of int phi_a phi_b."""
    body, cloud, path, _ = written
    m, c, phi, n = cloud.mass, cloud.c, cloud.phi, body.n_q
    with h5py.File(path) as file:
        data = {name: file[name][()] for name in file}
    assert_allclose(data["mass"], m.sum(), rtol=1e-12)
    assert_allclose(data["position integral"], m @ c, rtol=1e-11)
    assert_allclose(data["position position integral"], np.einsum("i,ia,ib->ab", m, c, c), rtol=1e-11)
    assert_allclose(data["shape function integral"], np.einsum("i,iak->ak", m, phi), rtol=0, atol=1e-11)
    P = data["position shape function integral"].reshape(3, 3, n)
    assert_allclose(P, np.einsum("i,ia,ibk->abk", m, c, phi), rtol=0, atol=1e-12)
    blocks = data["shape function shape function integral"].reshape(6, n, n)
    for (a, b), block in zip(((0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)), blocks, strict=True):
        assert_allclose(block, np.einsum("i,ik,il->kl", m, phi[:, a], phi[:, b]), rtol=0, atol=1e-12)
    assert_array_equal(data["stiffness matrix"], body.K)
    assert_array_equal(data["damping matrix"], body.D)


def test_nodes_move_as_in_the_body_and_faces_end_by_minus_one(written):
    body, cloud, path, _ = written
    n_kept = len(body.nodes)
    with h5py.File(path) as file:
        positions = file["nodal relative position"][()].reshape(-1, 3)
        phi = file["nodal shape matrix of translation"][()].reshape(-1, 3, body.n_q)
        psi = file["nodal shape matrix of rotation"][()].reshape(-1, 3, body.n_q)
        faces = file["openmbv indices"][()].reshape(-1, 4)
        stress = file["nodal stress matrix"][()].reshape(-1, 6, body.n_q)
        row = int(file.attrs["interface big_end"]) - 1
    assert_allclose(positions[:n_kept], cloud.c, rtol=1e-14)
    assert_allclose(phi[:n_kept], cloud.phi, rtol=1e-14)
    assert_array_equal(faces[:, :3], body.surface)
    assert (faces[:, 3] == -1).all()
    interface = cms.body.convert_units(body, "m-kg-s").interface("big_end")
    assert_allclose(positions[row], interface.position)
    assert_allclose(np.concatenate([phi[row], psi[row]]), interface.Psi)
    ours = np.asarray(cms.body.convert_units(body, "m-kg-s").stress)  # xx yy zz yz xz xy
    assert_allclose(stress[:n_kept, 3], ours[:, 5])  # xy
    assert_allclose(stress[:n_kept, 4], ours[:, 3])  # yz
    assert_allclose(stress[:n_kept, 5], ours[:, 4])  # zx


def test_it_says_where_interfaces_are_and_what_is_left_out(written):
    _, _, path, exported = written
    assert exported.files == (path,)
    assert any(note.startswith("interface big_end: node 31") for note in exported.notes)
    assert "load cases" in exported.left_out
    with h5py.File(path) as file:
        assert "synthetic" in file.attrs["header 1"]
        assert "m-kg-s" in file.attrs["header 2"]
