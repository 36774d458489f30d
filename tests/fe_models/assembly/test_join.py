"""Bodies on shared nodes: the whole is the whole, constraints are congruences, rigid motions stay free."""

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.assembly.constraints import MeanMotion, NodeEquation, RigidNodes, weighted_motion
from fe_models.assembly.join import Part, join
from fe_models.body.couplings.couplings import couple, mean_motion
from fe_models.body.fe_body import MULTIPLIER, Interface
from fe_models.body.loads import nodal_load
from fe_models.elements.beams.attachments import PointMass
from fe_models.elements.beams.beam_property import BeamProperty
from fe_models.elements.beams.body import beam_body
from fe_models.elements.beams.sections import Circle
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.errors import BodyError
from fe_models.foundation.units import unit_system
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import Mesh, drop_unused_nodes
from tests.bodies import STEEL, box_mesh

UNITS = unit_system("m-kg-s")
STEEL_BEAM = BeamProperty(Circle(0.05), STEEL)


def solid_part(mesh, rows):
    kind = next(iter(mesh.cells))
    piece = drop_unused_nodes(Mesh(mesh.nodes, {kind: mesh.cells[kind][rows]}, node_numbers=np.arange(len(mesh.nodes))))
    return Part(solid_body(piece, STEEL, name=f"part {rows[0]}", units=UNITS), piece.node_numbers)


def rigid_motions(body):
    motion = np.zeros((body.n_dof, 6))
    for k, (node, component) in enumerate(body.dofs):
        r = body.nodes[node]
        spin = np.array([[0, r[2], -r[1]], [-r[2], 0, r[0]], [r[1], -r[0], 0]])
        motion[k] = [*np.eye(3)[component], *spin[component]] if component < 3 else np.eye(6)[component]
    return motion


def test_two_halves_on_shared_nodes_are_the_whole():
    mesh = box_mesh(4, 2, 1, kind="hexahedron20")
    whole = solid_body(mesh, STEEL, name="whole", units=UNITS)
    joined = join("joined", [solid_part(mesh, np.arange(4)), solid_part(mesh, np.arange(4, 8))], mesh.nodes)
    place = np.zeros((len(mesh.nodes), 3), np.int64)
    for k, (node, component) in enumerate(joined.body.dofs):
        place[np.flatnonzero(joined.place == node)[0], component] = k
    order = place.ravel()
    assert joined.body.n_dof == whole.n_dof
    for ours, theirs in ((joined.body.K, whole.K), (joined.body.M, whole.M)):
        ours, theirs = ours.toarray()[np.ix_(order, order)], theirs.toarray()
        assert_allclose(ours, theirs, rtol=0, atol=1e-13 * np.abs(theirs).max())
    u = np.random.default_rng(0).normal(size=(whole.n_dof, 2))
    v = np.zeros_like(u)
    v[order] = u
    gram = joined.body.element_model.mass_gram(joined.body.mesh_displacement(v))
    assert_allclose(gram, whole.element_model.mass_gram(u), rtol=0, atol=1e-12 * np.abs(gram).max())


def test_a_rigid_group_is_the_rigid_interface_of_the_same_nodes():
    mesh = box_mesh(3, 1, 1)
    body = solid_body(mesh, STEEL, name="b", units=UNITS)
    members, point = mesh.node_sets["right"], np.array([1.3, 0.5, 0.5])
    coupled = couple(body.with_interfaces(Interface("right", "rigid", members, point)))
    points = np.vstack([mesh.nodes, point])
    leader = len(mesh.nodes)
    part = Part(body, np.arange(len(mesh.nodes)))
    joined = join("j", [part], points, [RigidNodes("right", leader, members)]).body
    for ours, theirs in ((joined.K, coupled.K), (joined.M, coupled.M)):
        assert_allclose(ours.toarray(), theirs.toarray(), rtol=0, atol=1e-12 * np.abs(theirs.toarray()).max())


def test_mass_on_the_leader_of_a_group_and_rotations_without_stiffness():
    """A mass at a node of a solid has no rotation there; on the leader of a rigid group its inertia counts."""
    mesh = box_mesh(3, 1, 1)
    body = solid_body(mesh, STEEL, name="b", units=UNITS)
    members, leader = mesh.node_sets["right"], len(mesh.nodes)
    points = np.vstack([mesh.nodes, [1.3, 0.5, 0.5]])
    at = np.array([0, leader])
    attached = beam_body(
        LineMesh(points[at], np.zeros((0, 2), np.int64)), {}, name="masses", units=UNITS,
        point_masses=[PointMass(0, 7.0), PointMass(1, 11.0, (1.0, 2.0, 3.0))],
    )  # fmt: skip
    parts = [Part(body, np.arange(leader)), Part(attached, at)]
    joined = join("j", parts, points, [RigidNodes("right", leader, members)]).body
    rotations = joined.dofs[joined.dofs[:, 1] >= 3]
    assert len(rotations) == 3  # of the leader alone
    R = rigid_motions(joined)
    assert np.abs(joined.K @ R).max() < 1e-12 * np.abs(joined.K.toarray()).max()
    mass = R.T @ joined.M @ R
    assert_allclose(mass[0, 0], STEEL.rho + 18.0, rtol=1e-12)
    solid = rigid_motions(body)
    arms = [np.array([0.0, 0.0, 0.0]), points[leader]]
    inertia = (solid.T @ body.M @ solid)[3:, 3:] + np.diag([1.0, 2.0, 3.0])
    inertia += sum(m * (r @ r * np.eye(3) - np.outer(r, r)) for m, r in zip((7.0, 11.0), arms, strict=True))
    assert_allclose(mass[3:, 3:], inertia, rtol=0, atol=1e-11 * np.abs(inertia).max())


def test_a_mean_motion_follows_its_members_and_leaves_rigid_motions_free():
    mesh = box_mesh(3, 1, 1)
    body = solid_body(mesh, STEEL, name="b", units=UNITS)
    members, node = mesh.node_sets["right"], len(mesh.nodes)
    points = np.vstack([mesh.nodes, [1.3, 0.5, 0.5]])
    attached = beam_body(
        LineMesh(points[[node]], np.zeros((0, 2), np.int64)), {}, name="m", units=UNITS,
        point_masses=[PointMass(0, 11.0, (1.0, 2.0, 3.0))],
    )  # fmt: skip
    weights = np.array([1.0, 2.0, 3.0, 4.0])
    coupling = MeanMotion("c", node, members, weights)
    joined = join("j", [Part(body, np.arange(node)), Part(attached, np.array([node]))], points, [coupling]).body
    assert joined.n_dof == body.n_dof
    dofs = (3 * members[:, None] + np.arange(3)).ravel()
    A = mean_motion(points[members], weights, points[node])
    expected = body.M.toarray()
    expected[np.ix_(dofs, dofs)] += A.T @ np.diag([11.0, 11.0, 11.0, 1.0, 2.0, 3.0]) @ A
    assert_allclose(joined.M.toarray(), expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    assert_array_equal(joined.K.toarray(), body.K.toarray())


def test_equations_are_resolved_along_their_chain_and_rings_are_refused():
    mesh = box_mesh(1, 1, 1)
    body = solid_body(mesh, STEEL, name="b", units=UNITS)
    part = [Part(body, np.arange(8))]
    first = NodeEquation("first", ((0, 0, 2.0), (1, 0, -1.0)))  # u_0 = u_1 / 2
    second = NodeEquation("second", ((1, 0, 1.0), (2, 1, 3.0)))  # u_1 = -3 v_2
    joined = join("j", part, mesh.nodes, [first, second]).body
    T = np.delete(np.eye(24), [0, 3], axis=1)
    v_2 = 7 - 2
    T[0, v_2], T[3, v_2] = -1.5, -3.0
    assert_allclose(joined.K.toarray(), T.T @ body.K @ T, rtol=0, atol=1e-12 * np.abs(body.K.toarray()).max())
    ring = NodeEquation("ring", ((2, 1, 1.0), (0, 0, 1.0)))
    with pytest.raises(BodyError, match="form a loop"):
        join("j", part, mesh.nodes, [first, second, ring])
    with pytest.raises(BodyError, match="component 1 of node 0 is defined by two of them, first and again"):
        join("j", part, mesh.nodes, [first, NodeEquation("again", ((0, 0, 1.0), (2, 0, 1.0)))])
    with pytest.raises(BodyError, match="node 1 has no dof for component 4; nodes of solids have no rotations"):
        join("j", part, mesh.nodes, [NodeEquation("turn", ((0, 0, 1.0), (1, 3, 1.0)))])


def test_a_mean_motion_with_weights_per_component_holds_rotations_too():
    """A mass on a node that follows two nodes of a beam by translations and rotations: T'MT with the rows of both."""
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0], [1, 1, 0]])
    frame = beam_body(LineMesh(points[:3], np.array([[0, 1], [1, 2]])), STEEL_BEAM, name="f", units=UNITS)
    attached = beam_body(
        LineMesh(points[3:], np.zeros((0, 2), np.int64)), {}, name="a", units=UNITS, point_masses=[PointMass(0, 7.0)]
    )
    weights = np.array([[1.0, 1, 1, 0, 0, 0], [2, 0, 2, 0.5, 0.5, 0], [1, 1, 1, 0, 0, 1], [0, 1, 0, 0, 0, 0]])
    members = np.array([0, 1, 2, 1])  # node 1 is there twice, its weights add up
    coupling = MeanMotion("c", 3, members, weights)
    parts = [Part(frame, np.arange(3)), Part(attached, np.array([3]))]
    joined = join("j", parts, points, [coupling]).body
    summed = weights[:3].copy()
    summed[1] += weights[3]
    A = weighted_motion(points[:3], summed, points[3])
    expected = frame.M.toarray()
    expected[:18, :18] += A.T @ np.diag([7.0, 7, 7, 0, 0, 0]) @ A
    assert_allclose(joined.M.toarray(), expected, rtol=0, atol=1e-12 * np.abs(expected).max())
    with pytest.raises(BodyError, match="c: weighted motion"):
        join("j", parts, points, [MeanMotion("c", 3, members[:3], np.ones(3))])


@pytest.mark.parametrize("at", [[0.3, 0.5, 0.5], [1.3, 0.5, 0.5]])
def test_a_leader_without_elements_is_seen_to_move_with_the_interface_on_it(at):
    """Two roads: the same nodes as a rigid interface of its own; and the leader's node against its interface."""
    mesh = box_mesh(3, 1, 1)
    body = solid_body(mesh, STEEL, name="b", units=UNITS)
    members, point, leader = mesh.node_sets["right"], np.array(at), len(mesh.nodes)
    part = Part(body, np.arange(leader))
    joined = join("j", [part], np.vstack([mesh.nodes, point]), [RigidNodes("right", leader, members)])
    place = int(joined.place[leader])
    ours = couple(joined.body.with_interfaces(Interface("tip", "rigid", np.array([place]), point)))
    theirs = couple(body.with_interfaces(Interface("tip", "rigid", members, point)))
    u = np.random.default_rng(4).normal(size=(ours.n_dof, 3))
    assert_array_equal(ours.translations(u)[place], u[ours.interface("tip").dofs[:3]])
    assert_allclose(ours.translations(u)[:leader], theirs.translations(u)[:leader], rtol=0, atol=1e-13)
    force = np.random.default_rng(5).normal(size=6)
    for held in (joined.body, ours):  # the work of a load on the leader is that on its own six components
        at_node = np.flatnonzero(held.dofs[:, 0] == (place if held is joined.body else ours.dofs[-1, 0]))
        load = nodal_load(held, "f", {place: force})
        assert_allclose(load.f @ u, force @ u[at_node], rtol=1e-12, atol=0)


def test_rotations_that_nothing_moves_are_unknown_at_leaders_and_zero_at_nodes_of_parts():
    """A node of a solid that follows a mean motion in translations alone, and a point mass without inertia."""
    mesh = box_mesh(3, 1, 1)
    body = solid_body(mesh, STEEL, name="b", units=UNITS)
    members, at = mesh.node_sets["right"], np.array([0])
    follower = int(np.setdiff1d(np.arange(len(mesh.nodes)), [*members, 0])[0])
    attached = beam_body(
        LineMesh(mesh.nodes[at], np.zeros((0, 2), np.int64)), {}, name="m", units=UNITS,
        point_masses=[PointMass(0, 7.0)],
    )  # fmt: skip
    coupling = MeanMotion("c", follower, members, np.ones(len(members)), components=(0, 1, 2))
    parts = [Part(body, np.arange(len(mesh.nodes))), Part(attached, at)]
    joined = join("j", parts, mesh.nodes, [coupling]).body
    assert (joined.dofs[:, 1] < 3).all()  # no rotation has mass or stiffness
    T, dofs = joined.recovery.matrix.toarray(), joined.recovery.dofs
    n_of_parts = 3 * len(mesh.nodes) + 6
    assert len(dofs) == n_of_parts + 3  # the rotations of the follower
    assert_array_equal(dofs[n_of_parts:], [[follower, MULTIPLIER]] * 3)
    assert_array_equal(dofs[:n_of_parts, 1], [*np.tile([0, 1, 2], len(mesh.nodes)), *range(6)])
    assert not T[n_of_parts - 3 :].any()


@pytest.mark.parametrize("factor", [0.0, 1e-15, -1e-15])
def test_the_first_coefficient_of_an_equation_must_not_vanish_beside_the_others(factor):
    mesh = box_mesh(1, 1, 1)
    part = [Part(solid_body(mesh, STEEL, name="b", units=UNITS), np.arange(8))]
    for others in ((4e5, 1.0), (1.0, -4e5)):
        terms = [(0, 0, 4e5 * factor), (1, 0, others[0]), (2, 0, others[1])]
        with pytest.raises(BodyError, match=r"e: the first coefficient is .*; it must not vanish"):
            join("j", part, mesh.nodes, [NodeEquation("e", tuple(terms))])
    with pytest.raises(BodyError, match=r"the first coefficient is 0; it must not vanish"):
        join("j", part, mesh.nodes, [NodeEquation("e", ((0, 0, 0.0), (1, 0, 0.0)))])


@pytest.mark.parametrize("a", [1e-7, -1e-7])
def test_the_first_coefficient_of_an_equation_may_be_small_in_any_unit(a):
    """The smaller the first coefficient, the further its dof moves: u_0 = -u_1 / a, in coefficients of 1e-20 too."""
    mesh = box_mesh(1, 1, 1)
    body = solid_body(mesh, STEEL, name="b", units=UNITS)
    for unit in (1.0, 1e-20):
        equation = NodeEquation("e", ((0, 0, a * unit), (1, 0, unit)))
        joined = join("j", [Part(body, np.arange(8))], mesh.nodes, [equation]).body
        assert_allclose(joined.recovery.matrix.toarray()[0], [0, 0, -1 / a, *np.zeros(20)], rtol=1e-14)
