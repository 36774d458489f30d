"""MBDyn's .fem file, read as its parser reads it; invariants by the loops of its own source over lumped masses."""

import re

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
from tests.cms.exchange.exporters.examples import stiffened
from tests.cms.exchange.exporters.small_bodies import cloud_body


def groups_of(text: str) -> dict[int, tuple[list[str], list[float]]]:
    """Heading lines and numbers of each record group, as MBDyn finds them: lines that begin with ** hold no numbers."""
    found: dict[int, tuple[list[str], list[float]]] = {}
    for line in text.splitlines():
        heading = re.match(r"\*\* RECORD GROUP (\d+)", line)
        if heading:
            current = found.setdefault(int(heading[1]), ([], []))
        elif not line.startswith("**"):
            current[0].append(line)
            current[1].extend(float(word) for word in line.split() if word != "REV0")
    return found


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    body, cloud = cloud_body()
    body = stiffened(body)
    path = tmp_path_factory.mktemp("mbdyn") / "body.fem"
    exported = cms.exchange.export_body(body, path, to="mbdyn", units=body.units)
    return body, cloud, groups_of(path.read_text()), exported


def test_invariants_are_those_that_mbdyn_forms_from_lumped_masses(written):
    body, cloud, groups, _ = written
    n = body.n_q
    Inv3, Inv4, Inv8 = np.zeros((3, n)), np.zeros((3, n)), np.zeros((3, 3 * n))
    Inv5, Inv9 = np.zeros((3, n * n)), np.zeros((3, 3 * n * n))

    def wedge(v):
        return np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])

    for m, u, phi in zip(cloud.mass, cloud.c, cloud.phi, strict=True):
        Inv3 += m * phi
        Inv4 += m * wedge(u) @ phi
        for j in range(n):
            Inv8[:, 3 * j : 3 * j + 3] += -m * wedge(u) @ wedge(phi[:, j])
            for k in range(n):
                Inv5[:, j * n + k] += m * wedge(phi[:, j]) @ phi[:, k]
                column = (j * n + k) * 3
                Inv9[:, column : column + 3] += m * wedge(phi[:, j]) @ wedge(phi[:, k])
    for number, expected in {14: Inv3, 15: Inv4, 16: Inv8, 17: Inv5, 18: Inv9}.items():
        assert_allclose(np.reshape(groups[number][1], expected.shape), expected, rtol=0, atol=1e-12, err_msg=number)


def test_rigid_inertia_is_about_the_centre_of_mass(written):
    _, cloud, groups, _ = written
    numbers = np.array(groups[12][1])
    center = cloud.mass @ cloud.c / cloud.mass.sum()
    d = cloud.c - center
    J = np.einsum("i,ia,ia->", cloud.mass, d, d) * np.eye(3) - np.einsum("i,ia,ib->ab", cloud.mass, d, d)
    assert_allclose(numbers[0], cloud.mass.sum(), rtol=1e-12)
    assert_allclose(numbers[1:4], center, rtol=0, atol=1e-12)
    assert_allclose(numbers[4:].reshape(3, 3), J, rtol=0, atol=1e-11)


def test_matrices_nodes_and_shapes_are_those_of_the_body(written):
    body, _, groups, exported = written
    n = body.n_q
    assert groups[1][0][0].split() == ["REV0", "2", str(n), "0", "0", "0"]
    for number, matrix in {9: body.M, 10: body.K, 13: body.D}.items():
        assert_array_equal(np.reshape(groups[number][1], (n, n)), matrix)
    positions = np.array([groups[5 + c][1] for c in range(3)]).T
    assert_array_equal(positions, [interface.position for interface in body.interfaces])
    shapes = np.reshape(groups[8][1], (n, 2, 6))
    assert_array_equal(shapes.transpose(1, 2, 0), [interface.Psi for interface in body.interfaces])
    assert exported.notes[:1] == ("interface big_end: node 1",)


def test_stress_stiffening_is_that_of_the_body_for_any_motion(written):
    """MBDyn: K = sum K_w w_i w_j (each product once) + sum K_wp alpha + sum K_vp (a - g) + sum K_F F + K_M M."""
    body, _, groups, _ = written
    n, K = body.n_q, body.geometric
    numbers = np.array(groups[19][1])
    assert numbers[0] == 12 + 6 * 2
    records = numbers[1:].reshape(24, 1 + n * n)
    assert_array_equal(records[:, 0], np.arange(1, 25))
    theirs = records[:, 1:].reshape(24, n, n)
    rng = np.random.default_rng(5)
    w, alpha, a, wrench = rng.normal(size=3), rng.normal(size=3), rng.normal(size=3), rng.normal(size=(2, 6))
    products = [w[0] ** 2, w[1] ** 2, w[2] ** 2, w[0] * w[1], w[1] * w[2], w[2] * w[0]]
    found = np.einsum("i,ikl->kl", np.concatenate([products, alpha, a, wrench.reshape(-1)]), theirs)
    full = np.zeros((3, 3, n, n))
    for (i, j), matrix in zip(((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)), K.spin, strict=True):
        full[i, j] = full[j, i] = matrix
    expected = np.einsum("a,b,abkl->kl", w, w, full) + np.einsum("a,akl->kl", a, K.translation)
    expected += np.einsum("a,akl->kl", alpha, K.rotation) + np.einsum("ic,ickl->kl", wrench, K.interfaces)
    assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_all_nodes_on_request(tmp_path):
    body, cloud = cloud_body()
    cms.exchange.export_body(body, tmp_path / "all.fem", to="mbdyn", units=body.units, nodes="all")
    groups = groups_of((tmp_path / "all.fem").read_text())
    n_nodes = int(groups[1][0][0].split()[1])
    shapes = np.reshape(groups[8][1], (body.n_q, n_nodes, 6))[:, : len(cloud.mass), :3]
    assert_array_equal(shapes.transpose(1, 2, 0), cloud.phi)
