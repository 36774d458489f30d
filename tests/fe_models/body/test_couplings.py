from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.testing import assert_allclose, assert_array_equal
from scipy.spatial.transform import Rotation

from fe_models.body.couplings.couplings import couple, mean_motion, round_surface
from fe_models.body.fe_body import MULTIPLIER, Interface
from fe_models.body.rigid_motion import rigid_motion_of_dofs, rigid_motion_of_points
from fe_models.errors import InterfaceError
from tests.bodies import bar, box_mesh, with_interfaces

ROUNDOFF = 1e-12


def end_faces(kinds, weights=None):
    body = bar(nx=4, kind="hexahedron")
    return with_interfaces(
        body,
        *(
            Interface(face.name, kind, face.nodes, face.reference + np.array([0.01, 0.002, -0.003]), weights=weights)
            for face, kind in zip(body.interfaces, kinds, strict=True)
        ),
    )


@pytest.mark.parametrize("kinds", [("rigid", "rigid"), ("rigid", "distributing"), ("nodes", "distributing")])
def test_rigid_modes_of_a_coupled_body_are_its_uncoupled_ones(kinds):
    body = end_faces(kinds)
    coupled = couple(body)
    Psi = rigid_motion_of_dofs(coupled.nodes, coupled.dofs)
    assert_allclose(coupled.mesh_displacement(Psi), rigid_motion_of_dofs(body.nodes, body.dofs), rtol=0, atol=ROUNDOFF)
    assert_allclose(coupled.K @ Psi, 0, rtol=0, atol=ROUNDOFF * abs(coupled.K).max())
    assert_allclose(
        Psi.T @ (coupled.M @ Psi),
        rigid_motion_of_dofs(body.nodes, body.dofs).T @ (body.M @ rigid_motion_of_dofs(body.nodes, body.dofs)),
        rtol=0,
        atol=ROUNDOFF * body.M.sum(),
    )


def test_rigid_coupling_is_the_congruence_with_its_recovery_matrix():
    body = end_faces(("rigid", "rigid"))
    coupled = couple(body)
    T = coupled.recovery.matrix
    for name in ("K", "M"):
        expected = (T.T @ getattr(body, name) @ T).toarray()
        assert_allclose(getattr(coupled, name).toarray(), expected, rtol=0, atol=ROUNDOFF * np.abs(expected).max())


def test_distributing_reference_follows_the_weighted_mean_translation_and_moves_nothing_else():
    """A unit force on the reference node acts on the members as their weights, and its motion is their mean."""
    weights = np.array([1.0, 2.0, 3.0, 4.0])
    body = end_faces(("rigid", "distributing"), weights)
    coupled = couple(body)
    left, right = coupled.interfaces
    free = np.setdiff1d(np.arange(coupled.n_dof), left.dofs)
    force = np.zeros(coupled.n_dof)
    force[right.dofs[1]] = 1.0
    u = np.zeros(coupled.n_dof)
    u[free] = spla.spsolve(coupled.K[free][:, free].tocsc(), force[free])
    members = body.nodes[right.nodes]
    mesh = coupled.mesh_displacement(u[:, None])[:, 0]
    at_members = mesh.reshape(-1, 3)[right.nodes]
    # its motion: least squares written out as a sum over members
    d, theta = u[right.dofs[:3]], u[right.dofs[3:]]
    residual = at_members - d - np.cross(theta, members - right.reference)
    assert_allclose(weights @ residual, 0, rtol=0, atol=1e-10 * np.abs(u).max())
    moment = weights @ np.cross(members - right.reference, residual)
    assert_allclose(moment, 0, rtol=0, atol=1e-10 * np.abs(u).max())
    # its force: statically equivalent to the unit force at the reference point
    nodal = (body.K @ mesh).reshape(-1, 3)[right.nodes]
    assert_allclose(nodal.sum(axis=0), [0, 1, 0], rtol=0, atol=1e-8)
    assert_allclose(np.cross(members - right.reference, nodal).sum(axis=0), 0, rtol=0, atol=1e-8)


def test_mean_motion_reproduces_rigid_motion_for_any_weights():
    rng = np.random.default_rng(3)
    points, weights, reference = rng.normal(size=(7, 3)), rng.uniform(0, 1, 7), rng.normal(size=3)
    A = mean_motion(points, weights, reference)
    motion = rigid_motion_of_points(points, reference).reshape(-1, 6)
    assert_allclose(A @ motion, np.eye(6), rtol=0, atol=1e-12)


def test_multipliers_have_no_mass_and_their_own_component():
    coupled = couple(end_faces(("distributing", "rigid")))
    is_multiplier = coupled.dofs[:, 1] == MULTIPLIER
    assert is_multiplier.sum() == 6
    assert np.abs(coupled.M[:, np.flatnonzero(is_multiplier)]).max() == 0
    assert not is_multiplier[coupled.b].any()


def test_boundary_is_the_reference_dofs_or_all_member_dofs():
    coupled = couple(end_faces(("nodes", "rigid")))
    nodes, rigid = coupled.interfaces
    assert_array_equal(coupled.dofs[nodes.dofs, 0], np.repeat(nodes.nodes, 3))
    assert_array_equal(coupled.dofs[rigid.dofs], np.stack([np.full(6, len(coupled.nodes) - 1), np.arange(6)], axis=1))


@pytest.mark.parametrize("kind", ["rigid", "distributing"])
@pytest.mark.parametrize("n_members", [1, 2, 3])
def test_members_on_one_line_are_refused(kind, n_members):
    mesh = box_mesh(4, 1, 1, kind="hexahedron")
    on_edge = np.flatnonzero((mesh.nodes[:, 1] == 0) & (mesh.nodes[:, 2] == 0))[:n_members]
    body = with_interfaces(bar(nx=4, kind="hexahedron"), Interface("edge", kind, on_edge, np.zeros(3)))
    words = f"not on one line, got {n_members}" if n_members < 3 else "its 3 nodes lie on one line"
    with pytest.raises(InterfaceError, match=f"'edge'.*{words}"):
        couple(body)


def test_overlapping_interfaces_are_refused_by_name():
    body = bar(nx=4, kind="hexahedron")
    left = body.interfaces[0]
    twin = Interface("twin", "nodes", left.nodes[:2], left.reference)
    with pytest.raises(InterfaceError, match="'left' and 'twin' share 2 nodes"):
        couple(with_interfaces(body, left, twin))


def turned(points):
    """Points in a general position."""
    return points @ Rotation.from_rotvec((0.4, -1.1, 0.7)).as_matrix().T + np.array([3.0, -2.0, 1.0])


def bore(arc, length, radius=0.4):
    """Points on a part of a cylinder about z, from z = 0."""
    angle, z = np.meshgrid(np.linspace(0.3, 0.3 + arc, 25)[:-1], np.linspace(0, length, 5) if length else [0.0])
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), z], axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("arc", [2 * np.pi, 4.0, np.pi])
@pytest.mark.parametrize("length", [0.0, 0.25, 2.0])
def test_the_axis_of_a_bore_or_of_a_part_of_it_is_found(arc, length):
    found = round_surface(turned(bore(arc, length)))
    expected = turned(np.array([[0.0, 0.0, length / 2], [0.0, 0.0, length / 2 + 1.0]]))
    assert_allclose(found.middle, expected[0], rtol=0, atol=1e-12)
    assert_allclose(np.abs(found.axis @ (expected[1] - expected[0])), 1.0, rtol=1e-12)
    assert_allclose((found.radius, found.length), (0.4, length), rtol=1e-12, atol=1e-12)


@pytest.mark.parametrize(
    "points",
    [
        np.array(np.meshgrid([0.0, 1.0], [0.0, 1.0], [0.0, 1.0])).reshape(3, -1).T,
        np.array(np.meshgrid(np.arange(5.0), np.arange(4.0), [0.0])).reshape(3, -1).T,
        np.linspace(0.0, 1.0, 9)[:, None] * (1.0, 2.0, 3.0),
        bore(1.0, 0.5),
        bore(2 * np.pi, 0.5) * (1.0, 1.1, 1.0),
    ],
    ids=["box", "plane", "line", "short arc", "ellipse"],
)
def test_other_points_lie_on_no_cylinder(points):
    assert round_surface(turned(points)) is None


@pytest.mark.parametrize(
    ("moved", "told"),
    [
        ((0.0, 0.0, 0.0), None),
        ((0.03, 0.04, 0.0), "0.05 off its axis; joints"),
        ((0.0, 0.0, 0.25), "0.25 from the middle of its length; joints"),
        ((0.03, 0.04, 0.25), "0.05 off its axis and 0.25 from the middle of its length; joints"),
    ],
)
def test_a_reference_beside_the_middle_of_its_bore_is_noted(moved, told, caplog):
    points = bore(2 * np.pi, 0.5)
    ring = bar(nx=4, kind="hexahedron")
    body = replace(
        ring, nodes=np.concatenate([ring.nodes, turned(points)]), node_volumes=None,
        dofs=np.concatenate([ring.dofs, [(len(ring.nodes) + k, c) for k in range(len(points)) for c in range(3)]]),
        M=sp.block_diag([ring.M, sp.eye_array(3 * len(points))], format="csr"),
        K=sp.block_diag([ring.K, sp.eye_array(3 * len(points))], format="csr"),
        numbering=ring.numbering.with_nodes_added(len(points)),
        interfaces=(
            Interface("eye", "rigid", len(ring.nodes) + np.arange(len(points)), turned(np.array([0, 0, 0.25]) + moved)),
        ),
    )  # fmt: skip
    couple(body)
    messages = [record.message for record in caplog.records]
    if told is None:
        assert messages == []
    else:
        assert told in messages[0]
        assert "reference = [" + ", ".join(f"{x:.6g}" for x in turned(np.array([0, 0, 0.25]))) + "]" in messages[0]
