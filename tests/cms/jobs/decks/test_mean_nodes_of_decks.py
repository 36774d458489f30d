"""Nodes of decks that follow the mean of others: the loads of a mass there turn with the body, which only they know."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

import cms
from cms.assessment.quality.of_body.second_order import turned_loads
from cms.reduction.geometric_stiffness.geometric_reduction import link_work, mean_nodes_part
from fe_models.body.weld import weld
from tests.cms.jobs.decks.nastran_bodies import body_of

POINTS = [
    (0, 0, 0), (1, 0, 0), (1, 0.5, 0), (0, 0.5, 0), (0, 0, 0.4), (1, 0, 0.4), (1.1, 0.5, 0.4), (0, 0.5, 0.4),
    (2, 0, 0), (2, 0.5, 0.1), (2, 0, 0.4), (2, 0.6, 0.4),
]  # fmt: skip
BLOCK = "".join(f"GRID,{k},,{x + 0.3},{y + 0.2},{z - 0.1}\n" for k, (x, y, z) in enumerate(POINTS, start=1))
BLOCK += "CHEXA,1,9,1,2,3,4,5,6\n,7,8\nCHEXA,2,9,2,9,10,3,6,11\n,12,7\nPSOLID,9,1\nMAT1,1,2.+9,,.3,1000.\n"
BLOCK += "PARAM,COUPMASS,1\nSPC1,1,123,1\nGRID,50,,3.,1.,.5\n"
MEAN = "RBE3,77,,50,123456,1.,123,9,10\n,11,2.,123,12\n"


@pytest.mark.parametrize(
    "mass",
    [
        "CONM2,88,50,,400.\n",
        "CONM2,88,50,,400.,.3,.2,-.4,\n,9.,.5,8.,.1,.2,7.\n",
        "GRID,51,,3.2,1.1,.2\nRBE2,66,50,123456,51\nCONM2,88,51,,400.\n",
    ],
)
def test_loads_of_a_mass_on_a_mean_node_turn_with_the_body(tmp_path, mass):
    """phi · K_j (theta × c) = ∫ (theta × f_j) · phi, whose right-hand side takes the moments of mass alone."""
    body, deck = body_of(tmp_path, BLOCK + MEAN + mass, is_coupled=True)
    assert not any(row[0] == "RBE3" for row in deck.ledger.rows())
    reduced = cms.reduce(body, cms.rubin(body, n_modes=6))
    geometric = reduced.geometric
    expected = turned_loads(reduced, geometric)[:12]
    found = np.concatenate([geometric.turned.translation, geometric.turned.rotation, geometric.turned.spin])
    assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    assert np.abs(expected[6:]).max() > 1e-2 * np.abs(expected).max()


def test_forces_work_on_the_second_order_of_the_nearest_rotation(tmp_path):
    """Second differences of f·x + m·theta, with R(theta) the rotation nearest to the moved members, by their SVD."""
    chain = "GRID,51,,3.2,1.1,.2\nRBE2,66,50,123456,51\nCONM2,88,51,,400.\n"
    body, _ = body_of(tmp_path, BLOCK + MEAN + chain, is_coupled=True)
    (mean,) = body.mean_nodes
    rng = np.random.default_rng(4)
    Phi = rng.normal(size=(body.n_dof, 3))
    mesh, at_mesh = body.to_mesh.dofs, body.mesh_displacement(Phi)
    node, follower = (int(np.flatnonzero(np.linalg.norm(body.nodes - x, axis=1) < 1e-9)[-1]) for x in
                      ((3, 1, 0.5), (3.2, 1.1, 0.2)))  # fmt: skip
    force = {(n, c): rng.normal() for n in (node, follower) for c in range(6)}
    f = np.zeros((len(mesh), 1))
    for key, value in force.items():
        f[(mesh == key).all(axis=1)] = value
    x = body.nodes[mean.members]
    v = np.stack([[at_mesh[(mesh == (m, c)).all(axis=1)][0] for c in range(3)] for m in mean.members])
    center = mean.weights @ x

    def work(q):
        moved = x + v @ q
        now = mean.weights @ moved
        U, _, Vt = np.linalg.svd(np.einsum("i,ia,ib->ab", mean.weights, moved - now, x - center))
        R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
        theta = Rotation.from_matrix(R).as_rotvec()
        return sum(
            np.array([force[n, c] for c in range(6)]) @ np.concatenate([now + R @ (body.nodes[n] - center), theta])
            for n in (node, follower)
        )

    h, e = 1e-4, np.eye(3)
    found = mean_nodes_part(body, f, Phi)[0]
    expected = [[(work(h * (a + b)) - work(h * (a - b)) - work(h * (b - a)) + work(-h * (a + b))) / (4 * h**2)
                 for a in e] for b in e]  # fmt: skip
    assert_allclose(found, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def test_the_mean_of_followers_of_two_leaders_has_their_second_order(tmp_path):
    """Second differences of the work at node 53 and its follower 55, of a mean of a solid's node and rigid followers.

    Members 51 and 52 turn with leader 40, members 61 and 62 with leader 60; the mean turns as in the test above.
    """
    places = {40: (2.5, 0.9, 0.3), 51: (3.2, 1.1, 0.2), 52: (2.9, 0.3, 0.4), 60: (-0.2, 0.4, 0.1),
              61: (-0.4, 0.9, 0.5), 62: (-0.3, 0.2, -0.6), 53: (1.1, 1.3, 0.7), 55: (1.4, 1.5, 0.2)}  # fmt: skip
    links = "".join(f"GRID,{k},,{x},{y},{z}\n" for k, (x, y, z) in places.items())
    links += "RBE2,66,40,123,9,10,11\nRBE2,67,40,123456,51,52\nRBE2,68,60,123,1,4,5\nRBE2,69,60,123456,61,62\n"
    links += "RBE3,77,,53,123456,1.,123,51,61\n,2.,123,52,3\n,.5,123,62\nRBE2,70,53,123456,55\n"
    links += "".join(f"CONM2,{k + 100},{k},,{k}.\n" for k in (51, 52, 61, 62, 53, 55))
    body, deck = body_of(tmp_path, BLOCK + links, is_coupled=True)
    assert not any("takes their mean as linear" in row[2] for row in deck.ledger.rows())
    places = {k: np.array(x) for k, x in (places | {3: np.add(POINTS[2], (0.3, 0.2, -0.1))}).items()}
    node = {k: int(np.flatnonzero(np.linalg.norm(body.nodes - x, axis=1) < 1e-9)[-1]) for k, x in places.items()}
    rng = np.random.default_rng(5)
    Phi = rng.normal(size=(body.n_dof, 3))
    mesh, at_mesh = body.to_mesh.dofs, body.mesh_displacement(Phi)
    force = {k: rng.normal(size=6) for k in (53, 55)}
    f = np.zeros((len(mesh), 1))
    for k, six in force.items():
        for c in range(6):
            f[(mesh == (node[k], c)).all(axis=1)] = six[c]
    six_of = {k: np.stack([Phi[(body.dofs == (node[k], c)).all(axis=1)][0] for c in range(6)]) for k in (40, 60)}
    of_solid = np.stack([at_mesh[(mesh == (node[3], c)).all(axis=1)][0] for c in range(3)])
    weights = np.array([1, 1, 2, 2, 0.5]) / 6.5
    x = np.array([places[k] for k in (51, 61, 52, 3, 62)])
    center = weights @ x

    def led(k, leader, q):
        motion = six_of[leader] @ q
        turn = Rotation.from_rotvec(motion[3:]).as_matrix()
        return places[leader] + motion[:3] + turn @ (places[k] - places[leader])

    def work(q):
        moved = np.array([led(51, 40, q), led(61, 60, q), led(52, 40, q), places[3] + of_solid @ q, led(62, 60, q)])
        now = weights @ moved
        U, _, Vt = np.linalg.svd(np.einsum("i,ia,ib->ab", weights, moved - now, x - center))
        R = U @ np.diag([1, 1, np.linalg.det(U @ Vt)]) @ Vt
        theta = Rotation.from_matrix(R).as_rotvec()
        return sum(six @ np.concatenate([now + R @ (places[k] - center), theta]) for k, six in force.items())

    h, e = 1e-4, np.eye(3)
    T, dofs = body.recovery.matrix, body.recovery.dofs
    found = (link_work(T, dofs, body.dofs, f, Phi) + mean_nodes_part(body, f, Phi))[0]
    expected = [[(work(h * (a + b)) - work(h * (a - b)) - work(h * (b - a)) + work(-h * (a + b))) / (4 * h**2)
                 for a in e] for b in e]  # fmt: skip
    assert_allclose(found, expected, rtol=0, atol=1e-5 * np.abs(expected).max())


def test_mean_nodes_of_welded_decks_stay_where_they_are(tmp_path):
    """Two of these bodies side by side, joined to nothing: the records follow nodes and rows of their body."""
    one, _ = body_of(tmp_path, BLOCK + MEAN + "CONM2,88,50,,400.\n", is_coupled=True)
    both = weld([one, replace(one, name="other")], [], name="both")
    first, second = both.mean_nodes
    assert_allclose(second.members - first.members, len(one.nodes))
    assert_allclose(both.nodes[second.members], one.nodes[one.mean_nodes[0].members])
    half = first.follows.shape[0] // 2
    assert_allclose(first.follows.toarray()[:half], second.follows.toarray()[half:])
    assert not first.follows.toarray()[half:].any()
    assert not second.follows.toarray()[:half].any()


def test_means_whose_second_order_is_not_known_are_named(tmp_path):
    chain = "GRID,51,,3.2,1.1,.2\nGRID,52,,2.9,.3,.2\nGRID,54,,3.,.6,.9\nRBE2,66,50,123456,51,52,54\n"
    chain += "GRID,53,,3.3,.8,.1\nRBE3,67,,53,123456,1.,123,51,52\n,54\nCONM2,88,53,,400.\n"
    chain += "CONM2,1,51,,5.\nCONM2,2,52,,5.\nCONM2,3,54,,5.\n"
    _, deck = body_of(tmp_path, BLOCK + MEAN + chain)
    (row,) = [row for row in deck.ledger.rows() if "takes their mean as linear" in row[2]]
    assert row[0] == "rbe3_67"
    _, deck = body_of(tmp_path, BLOCK + MEAN.replace("1.,123,9", "1.,13,9") + "CONM2,88,50,,400.\n")
    assert any("the geometric stiffness takes their mean as linear" in row[2] for row in deck.ledger.rows())
