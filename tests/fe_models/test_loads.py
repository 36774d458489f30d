"""Load cases are consistent: resultants and work are those of the load itself."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.errors import BodyError
from fe_models.body.couplings.couplings import couple
from fe_models.body.load_cases import LoadCase
from fe_models.body.loads import gravity_load, interface_load, nodal_load, pressure_load, selection_load
from fe_models.body.rigid_motion import rigid_motion_of_dofs
from fe_models.elements.solids.body import solid_body
from fe_models.errors import InterfaceError, LoadError
from fe_models.foundation.units import unit_system
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.selections import Box, FaceGroup, NearestNode, NodeSet, Plane
from tests.bodies import STEEL, bar, beam, box_mesh, distorted, with_interfaces

KINDS = ["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27", "wedge"]
EVERYWHERE = Box((-9, -9, -9), (9, 9, 9))
ROUNDOFF = 1e-12


def body_of(mesh):
    return solid_body(mesh, STEEL, name="box", units=unit_system("m-kg-s"))


def resultant(body, case, about=(0.0, 0.0, 0.0)):
    return rigid_motion_of_dofs(body.nodes, body.dofs, np.array(about)).T @ case.f


def volume(body):
    return body.element_model.mass_gram(np.zeros((len(body.dofs), 0)))[0, 0] / STEEL.rho


@pytest.mark.parametrize("kind", KINDS)
def test_pressure_on_a_flat_side_has_the_resultant_of_statics(kind):
    mesh = box_mesh(2, 2, 2, 1.0, 0.6, 0.5, kind)
    body = body_of(mesh)
    case = pressure_load(body, mesh, "push", Plane((1, 0, 0), (1, 0, 0)), 4.0)
    expected = [-4.0 * 0.3, 0, 0, 0, -4.0 * 0.3 * 0.25, 4.0 * 0.3 * 0.3]  # at the centre of the side (1, 0.3, 0.25)
    assert_allclose(resultant(body, case), expected, rtol=0, atol=ROUNDOFF * 4)
    off_side = np.abs(mesh.nodes[body.dofs[:, 0], 0] - 1) > 1e-9
    assert_allclose(case.f[off_side], 0, rtol=0, atol=0)


@pytest.mark.parametrize("kind", KINDS)
def test_pressure_all_around_is_in_balance_and_works_on_the_volume(kind):
    """Gauss: ∫ n dA = 0, ∫ x × n dA = 0, and the work on u = A x is -p tr(A) V, on a distorted, curved mesh."""
    mesh = distorted(box_mesh(2, 2, 2, 1.0, 0.6, 0.5, kind), amount=0.3)
    body = body_of(mesh)
    case = pressure_load(body, mesh, "depth", EVERYWHERE, 4.0)
    assert np.abs(case.f).max() > 0.01
    assert_allclose(resultant(body, case), 0, rtol=0, atol=ROUNDOFF)
    A = np.random.default_rng(0).normal(size=(3, 3))
    u = (mesh.nodes @ A.T).ravel()
    assert_allclose(u @ case.f, -4.0 * np.trace(A) * volume(body), rtol=0, atol=ROUNDOFF * 10)


def test_pressure_on_a_curved_face_is_that_of_its_rim():
    """Two facets with the same rim have one area vector: bulge the middle nodes inside the side, not its edges."""
    mesh = box_mesh(2, 1, 1, 1.0, 1.0, 1.0, "hexahedron27")
    nodes = mesh.nodes.copy()
    inner = (nodes[:, 0] == 1) & (np.abs(nodes[:, 1:] - 0.5) < 0.4).all(axis=1)
    nodes[inner, 0] += 0.1
    bulged = Mesh(nodes, mesh.cells, mesh.cell_sets, node_sets=mesh.node_sets)
    body = body_of(bulged)
    case = pressure_load(body, bulged, "push", NodeSet("right"), 2.0)
    assert inner.sum() == 1
    assert_allclose(resultant(body, case)[:3], [-2.0, 0, 0], rtol=0, atol=ROUNDOFF)


def test_uniform_pressure_gives_the_bar_a_uniform_stress():
    """Consistent nodal loads pass the patch test: sigma_xx = -p everywhere, nothing else."""
    from scipy.sparse.linalg import spsolve

    mesh = distorted_inside(box_mesh(2, 2, 2, 1.0, 0.6, 0.5, "hexahedron20"))
    body = body_of(mesh)
    f = sum(pressure_load(body, mesh, "p", NodeSet(end), 5.0).f for end in ("left", "right"))
    corner, along_x, along_y = (
        int(np.linalg.norm(mesh.nodes - p, axis=1).argmin()) for p in ([0, 0, 0], [1, 0, 0], [0, 0.6, 0])
    )
    held = np.array([3 * corner, 3 * corner + 1, 3 * corner + 2, 3 * along_x + 1, 3 * along_x + 2, 3 * along_y + 2])
    free = np.setdiff1d(np.arange(body.n_dof), held)
    u = np.zeros((body.n_dof, 1))
    u[free, 0] = spsolve(body.K[free][:, free], f[free])
    expected = np.zeros((len(mesh.nodes), 6))
    expected[:, 0] = -5.0
    assert_allclose(body.element_model.nodal_stress(u)[..., 0], expected, rtol=0, atol=1e-9 * 5)


def distorted_inside(mesh):
    """Move the nodes off the outer planes only."""
    moved = distorted(mesh, amount=0.2).nodes
    lo, hi = mesh.nodes.min(axis=0), mesh.nodes.max(axis=0)
    on_wall = (np.isclose(mesh.nodes, lo) | np.isclose(mesh.nodes, hi)).any(axis=1)
    return Mesh(np.where(on_wall[:, None], mesh.nodes, moved), mesh.cells, mesh.cell_sets, node_sets=mesh.node_sets)


def test_gravity_weighs_the_body_at_its_centre_of_mass():
    body = couple(bar(nx=3, kind="hexahedron"))
    g = np.array([1.0, -2.0, 9.81])
    case = gravity_load(body, "weight", g)
    m = STEEL.rho * 1.0 * 0.05 * 0.04
    expected = np.r_[m * g, m * np.cross([0.5, 0.025, 0.02], g)]
    assert_allclose(resultant(body, case), expected, rtol=0, atol=ROUNDOFF * m * 10)


@pytest.mark.parametrize("kind", ["rigid", "distributing", "nodes"])
def test_a_load_at_an_interface_does_the_work_of_its_reference_node(kind):
    """Made before the coupling and carried by it, it is the load put on the reference node after it."""
    body = bar(nx=3, kind="hexahedron")
    left, right = body.interfaces
    rng = np.random.default_rng(1)
    weights = rng.uniform(0.5, 2.0, len(right.nodes))
    body = with_interfaces(body, left, replace(right, kind=kind, weights=weights, reference=np.array([1.1, 0.0, 0.03])))
    wrench = {"force": (1.0, 2.0, 3.0), "torque": (0.4, 0.5, 0.6)}
    before = couple(body.with_load_cases(interface_load(body, "pull", "right", **wrench)))
    after = interface_load(couple(body), "pull", "right", **wrench)
    Psi_R = rigid_motion_of_dofs(before.nodes, before.dofs, np.array([1.1, 0.0, 0.03]))
    assert_allclose(Psi_R.T @ before.load_cases[0].f, [1, 2, 3, 0.4, 0.5, 0.6], rtol=0, atol=1e-12)
    assert_allclose(Psi_R.T @ after.f, [1, 2, 3, 0.4, 0.5, 0.6], rtol=0, atol=1e-12)
    if kind == "distributing":  # the two differ by a state of the multipliers: the displacement is the same
        u = [statics(before, f) for f in (before.load_cases[0].f, after.f)]
        assert_allclose(u[0], u[1], rtol=0, atol=1e-9 * np.abs(u[0]).max())
    else:
        assert_allclose(before.load_cases[0].f, after.f, rtol=0, atol=1e-12)


def statics(body, f):
    """Return the mesh displacement of the body under f, held at its left interface."""
    free = np.setdiff1d(np.arange(body.n_dof), body.interface("left").dofs)
    u = np.zeros((body.n_dof, 1))
    u[free, 0] = np.linalg.solve(body.K.toarray()[np.ix_(free, free)], f[free])
    return body.mesh_displacement(u)


def test_a_coupling_carries_loads_by_their_work():
    """fᵀ u of the mesh is f_coupledᵀ u_coupled for any motion of the coupled body."""
    body = bar(nx=3, kind="hexahedron")
    left, right = body.interfaces
    rng = np.random.default_rng(2)
    f = rng.normal(size=body.n_dof)
    body = with_interfaces(body, left, replace(right, kind="distributing"))
    coupled = couple(body.with_load_cases(LoadCase("any", "user", f)))
    u = rng.normal(size=(coupled.n_dof, 4))
    assert_allclose(coupled.load_cases[0].f @ u, f @ coupled.mesh_displacement(u), rtol=1e-12)


def test_a_load_on_a_selection_has_its_resultant_and_spreads_by_area():
    mesh = box_mesh(2, 2, 2, 1.0, 0.6, 0.5, "tetra10")
    body = body_of(mesh)
    side = Plane((1, 0, 0), (1, 0, 0))
    case = selection_load(body, mesh, "pull", side, force=(3, 0, 0))
    assert_allclose(case.f, -pressure_load(body, mesh, "p", side, 3.0 / 0.3).f, rtol=0, atol=1e-12)
    twisted = selection_load(body, mesh, "twist", side, force=(0, 2, 0), torque=(7, 1, 2), reference=(1, 0, 0.5))
    assert_allclose(resultant(body, twisted, (1, 0, 0.5)), [0, 2, 0, 7, 1, 2], rtol=0, atol=1e-11)


def test_forces_at_nodes_stand_where_they_were_put():
    body = beam(3)
    case = nodal_load(body, "hit", {2: (1, 2, 3), 1: (0, 0, 0, 4, 5, 6)})
    assert_allclose(case.f.reshape(4, 6), [[0] * 6, [0, 0, 0, 4, 5, 6], [1, 2, 3, 0, 0, 0], [0] * 6], rtol=0, atol=0)
    on_node = interface_load(body, "turn", "right", force=(1, 0, 0), torque=(0, 0, 2))
    assert_allclose(on_node.f.reshape(4, 6)[3], [1, 0, 0, 0, 0, 2], rtol=0, atol=1e-12)


def test_impossible_loads_are_refused_with_what_to_do():
    mesh = box_mesh(2, 1, 1, kind="hexahedron")
    body = body_of(mesh)
    other = box_mesh(1, 1, 1, kind="hexahedron")
    inside = Mesh(
        mesh.nodes, mesh.cells, faces={"quad": mid_face(mesh)}, face_sets={"mid": {"quad": np.array([0])}}
    )  # fmt: skip
    corner = NearestNode((0, 0, 0))
    for make, words in [
        (lambda: pressure_load(body, mesh, "p", NodeSet("left"), np.nan), "pressure: expected a finite number"),
        (lambda: pressure_load(body, other, "p", NodeSet("left"), 1.0), "not that of body 'box'"),
        (lambda: pressure_load(body, mesh, "p", corner, 1.0), "no complete facet of the surface"),
        (lambda: pressure_load(body, inside, "p", FaceGroup("mid"), 1.0), "1 of 1 faces .quad. are not facets of the"),
        (lambda: gravity_load(body, "g", (0, 0)), "acceleration: expected 3 finite numbers"),
        (lambda: nodal_load(body, "n", {99: (1, 0, 0)}), r"no node 99; expected 0\.\.11"),
        (lambda: nodal_load(body, "n", {0: (0, 0, 0, 1, 0, 0)}), "node 0 at .* has no rotations: spread a torque"),
        (lambda: selection_load(body, mesh, "s", corner, torque=(1, 0, 0)), "1 nodes cannot carry this force"),
        (lambda: selection_load(body, mesh, "s", corner, force=(1, 0, 0), reference=(0, 1, 0)), "no lever arm"),
    ]:
        with pytest.raises(LoadError, match=words):
            make()
    with pytest.raises(InterfaceError, match="no face group 'bore'"):
        pressure_load(body, mesh, "p", FaceGroup("bore"), 1.0)
    with pytest.raises(BodyError, match="no interface 'left'"):
        interface_load(body, "i", "left")


def mid_face(mesh):
    rows = mesh.cells["hexahedron"]
    return np.intersect1d(rows[0], rows[1])[None]


def test_load_cases_that_do_not_fit_the_body_are_refused():
    body = beam(3)
    with pytest.raises(BodyError, match="two load cases are named 'a'"):
        body.with_load_cases(LoadCase("a", "user", np.zeros(24)), LoadCase("a", "user", np.zeros(24)))
    with pytest.raises(BodyError, match=r"load case 'a': f: expected shape \(24,\)"):
        body.with_load_cases(LoadCase("a", "user", np.zeros(23)))
    with pytest.raises(BodyError, match="LoadCase 'a': f: expected finite"):
        LoadCase("a", "user", np.full(3, np.inf))
    with pytest.raises(BodyError, match=r"LoadCase 'a': f: expected shape \(n_dof,\), got \(3, 1\)"):
        LoadCase("a", "user", np.zeros((3, 1)))
    with pytest.raises(BodyError, match="expected a name"):
        LoadCase("", "user", np.zeros(3))
