"""The way back from diagonalised modes without rigid motion to a superelement over the interfaces."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

import cms
from cms.errors import ExportError
from cms.reduction.interface_model import boundary_of, interface_model
from fe_models.files.matrices.given import body_from_matrices
from fe_models.meshes.numbering import Numbering
from tests.bodies import bar, with_interfaces
from tests.cms.exchange.exporters.small_bodies import RUBBER


@pytest.fixture(scope="module")
def coupled():
    return cms.couple(bar(nx=6, material=RUBBER))


@pytest.fixture(scope="module")
def modes(coupled):
    return cms.craig_bampton(coupled, n_modes=5)


FRAMES = {"nodal": cms.NodalFrame("left"), "tisserand": cms.TisserandFrame()}


@pytest.mark.parametrize("frame", FRAMES)
def test_a_craig_bampton_body_gives_its_superelement_back(coupled, modes, frame):
    """K and M over constraint and fixed-interface modes, formed from the full matrices, whatever frame lies between."""
    model = interface_model(cms.reduce(coupled, modes, frame=FRAMES[frame], geometric=False))
    V = modes.columns
    K, M = V.T @ (coupled.K @ V), V.T @ (coupled.M @ V)
    signs = np.ones(len(K))
    signs[12:] = np.sign(np.sum(model.M[:12, 12:] * M[:12, 12:], axis=0))  # a mode has no sign
    S = np.diag(signs)
    assert (model.n_boundary, model.n_modes) == (12, 5)
    assert_allclose(S @ model.K @ S, K, rtol=0, atol=1e-11 * np.abs(K).max())
    assert_allclose(S @ model.M @ S, M, rtol=0, atol=1e-9 * np.abs(M).max())


def test_frequencies_free_and_held_are_those_of_the_reduced_body(coupled, modes):
    reduced = cms.reduce(coupled, modes, geometric=False)
    model = interface_model(reduced)
    omega2 = la.eigvalsh(model.K, model.M)
    assert np.abs(omega2[:6]).max() < 1e-9 * omega2[6]
    assert_allclose(np.sqrt(omega2[6:]) / 2 / np.pi, reduced.free_frequencies, rtol=1e-7)
    assert_allclose(model.omega / 2 / np.pi, modes.frequencies[~modes.is_static], rtol=1e-9)


def test_rigid_motion_costs_nothing_and_has_the_mass_of_the_body(coupled, modes):
    """The interfaces moved as a rigid body carry it along: no energy, the mass, the inertia about the mesh origin."""
    reduced = cms.reduce(coupled, modes, frame=FRAMES["nodal"], geometric=False)
    model = interface_model(reduced)
    motion = np.zeros((len(model.K), 6))
    for node in model.nodes:
        x, y, z = node.position
        motion[node.first : node.first + 6] = np.eye(6)
        motion[node.first : node.first + 3, 3:] = [[0, z, -y], [-z, 0, x], [y, -x, 0]]
    assert_allclose(model.K @ motion, 0, rtol=0, atol=1e-11 * np.abs(model.K).max())
    inertia = motion.T @ model.M @ motion
    moments, o = reduced.moments, reduced.frame.origin
    assert_allclose(inertia[:3, :3], moments.m * np.eye(3), rtol=0, atol=1e-9 * moments.m)
    c = o + moments.S / moments.m
    central = moments.J0 - moments.m * ((c - o) @ (c - o) * np.eye(3) - np.outer(c - o, c - o))
    J = central + moments.m * (c @ c * np.eye(3) - np.outer(c, c))
    assert_allclose(inertia[3:, 3:], J, rtol=0, atol=1e-8 * np.abs(J).max())


def test_recovery_and_loads_follow_the_nodes(coupled, modes):
    """Nodes of the left interface move by its six dofs; the work of a tip force on all shapes is that of its node."""
    reduced = cms.reduce(coupled, modes, geometric=False)
    model = interface_model(reduced)
    R, left = model.recovery(), reduced.interface("left")
    y = np.random.default_rng(0).normal(size=len(model.K))
    rows = [node.first for node in model.nodes if node.interface == "left"]
    d, theta = y[rows[0] : rows[0] + 3], y[rows[0] + 3 : rows[0] + 6]
    arms = reduced.nodes[left.members] - left.position
    expected = d + np.cross(theta, arms @ reduced.frame.axes.T)
    assert_allclose(R[left.members] @ y, expected, rtol=0, atol=1e-9)


def test_missing_constraint_modes_are_named(coupled):
    reduced = cms.reduce(coupled, cms.modes.normal_modes(coupled, n_modes=4), geometric=False)
    with pytest.raises(ExportError, match=r"move only 10 of the 12 dofs .* missing constraint modes: .* ux, right rx"):
        interface_model(reduced)


def test_an_interface_that_does_not_hold_the_body_is_refused():
    body = bar(nx=3)
    pin = cms.Interface("pin", "nodes", np.array([0]), body.nodes[0])
    pinned = cms.couple(with_interfaces(body, pin))
    with pytest.raises(ExportError, match="its interfaces do not hold it: 3 motions without energy"):
        interface_model(cms.reduce(pinned, cms.craig_bampton(pinned, n_modes=2), geometric=False))


def test_nodes_that_keep_their_own_dofs_are_rows_of_three():
    body = bar(nx=3, material=RUBBER)
    left = np.flatnonzero(body.nodes[:, 0] == 0)[:4]
    ends = cms.Interface("left", "nodes", left, body.nodes[left].mean(axis=0))
    pinned = cms.couple(with_interfaces(body, ends))
    modes = cms.craig_bampton(pinned, n_modes=3)
    model = interface_model(cms.reduce(pinned, modes, geometric=False))
    V = modes.columns
    K = V.T @ (pinned.K @ V)
    assert [len(node.components) for node in model.nodes] == [3, 3, 3, 3]
    assert_allclose(model.K[:12, :12], K[:12, :12], rtol=0, atol=1e-9 * np.abs(K).max())


def test_a_held_body_has_no_rigid_motion_added():
    free = bar(nx=6, material=RUBBER)
    keep = np.flatnonzero(free.nodes[free.dofs[:, 0], 0] > 0)
    held = cms.couple(
        body_from_matrices(
            free.M[keep][:, keep], free.K[keep][:, keep], free.nodes, free.dofs[keep], name="cantilever",
            units=cms.unit_system("m-kg-s"), interfaces=[free.interfaces[1]], held=True,
        )
    )  # fmt: skip
    modes = cms.craig_bampton(held, n_modes=3)
    model = interface_model(cms.reduce(held, modes))
    V = modes.columns
    K, M = V.T @ (held.K @ V), V.T @ (held.M @ V)
    assert_allclose(model.K[:6, :6], K[:6, :6], rtol=0, atol=1e-10 * np.abs(K).max())
    assert_allclose(model.M[:6, :6], M[:6, :6], rtol=0, atol=1e-9 * np.abs(M).max())


def test_rounding_at_an_interface_that_the_frame_holds_is_no_motion(coupled):
    """A nodal frame at the only interface: K_bb = 0 and the constraint modes are the rigid motions."""
    alone = cms.couple(with_interfaces(bar(nx=6, material=RUBBER), bar(nx=6, material=RUBBER).interface("left")))
    reduced = cms.reduce(alone, cms.craig_bampton(alone, n_modes=5), frame=cms.NodalFrame("left"), geometric=False)
    noise = np.random.default_rng(0).normal(size=(6, reduced.n_q)) * 1e-18 * np.abs(reduced.Phi).max()
    port = replace(reduced.interface("left"), Psi=noise)
    rounded = interface_model(replace(reduced, interfaces=(port,)))
    exact = interface_model(reduced)
    assert_allclose(rounded.K, exact.K, rtol=0, atol=1e-9 * np.abs(exact.K).max())
    assert_allclose(rounded.M, exact.M, rtol=0, atol=1e-9 * np.abs(exact.M).max())
    assert_allclose(rounded.K[:6], 0, rtol=0, atol=1e-9 * np.abs(exact.K).max())


@pytest.mark.parametrize("kind", ["translation", "rotation"])
@pytest.mark.parametrize("length", [1e-3, 1.0, 1e3])
def test_what_is_rounding_of_a_motion_is_the_same_in_every_unit_of_length(coupled, modes, kind, length):
    """A rotation counts by the path at the far end of the body, 1 m long; a mode that moves it by 1e-11 is kept."""
    reduced = cms.reduce(coupled, modes, frame=cms.NodalFrame("left"), geometric=False)
    largest, port = np.abs(reduced.Phi).max(axis=(0, 1)), reduced.interface("left")
    for part, is_kept in ((1e-11, True), (1e-13, False)):
        Psi = np.zeros((6, reduced.n_q))
        if kind == "translation":
            Psi[1] = part * largest * length
        else:
            Psi[4] = part * largest
        scaled = replace(
            reduced, nodes=reduced.nodes * length, Phi=reduced.Phi * length,
            interfaces=(replace(port, Psi=Psi, position=length * port.position),),
        )  # fmt: skip
        assert boundary_of(scaled)[1][:, 6:].any() == is_kept


def test_a_body_that_keeps_one_node_has_the_matrices_of_one_that_keeps_all(coupled, modes):
    """No length lies between its nodes, by which its rotations were all rounding."""
    reduced = cms.reduce(coupled, modes, geometric=False)
    node = reduced.interface("left").members[0]
    ports = tuple(replace(port, members=np.zeros(0, int)) for port in reduced.interfaces)
    alone = replace(
        reduced, nodes=reduced.nodes[[node]], Phi=reduced.Phi[[node]], interfaces=ports,
        surface=np.zeros((0, 3), int), stress=None, node_ids=reduced.node_ids[[node]], numbering=Numbering(),
    )  # fmt: skip
    whole, one = interface_model(reduced), interface_model(alone)
    assert_allclose(one.K, whole.K, rtol=0, atol=1e-12 * np.abs(whole.K).max())
