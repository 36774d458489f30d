"""Energy errors of elements by recovered stress: fields that a mesh represents, and a rod with a closed form."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fe_models as fm
from fe_models.elements.recovery import mesh_error
from fe_models.elements.recovery.mesh_error import energy_errors, free_surface, without_estimate
from fe_models.meshes.mesh import Mesh
from tests.bodies import beam, box_mesh, distorted

MM = fm.unit_system("mm-kg-ms")
TURN = np.linalg.qr(np.random.default_rng(5).normal(size=(3, 3)))[0]
TURN = TURN * np.linalg.det(TURN)
FIRST = ("tetra", "hexahedron", "wedge", "pyramid")
SECOND = ("tetra10", "hexahedron20", "hexahedron27", "wedge15", "pyramid13")


def turned(mesh: Mesh) -> Mesh:
    """The mesh in general position."""
    return replace(mesh, nodes=mesh.nodes @ TURN.T + [400.0, -90.0, 30.0])


def solid(mesh, nu=0.3, **options):
    """A body of steel in mm and ms."""
    return fm.solid_body(mesh, fm.Material("steel", 210.0, nu, 7.85e-6), name="solid", units=MM, **options)


def everywhere(body):
    """All nodes, so that no surface is free."""
    return np.arange(len(body.nodes))


@pytest.mark.parametrize("kind", [*FIRST, *SECOND])
def test_a_field_whose_stress_the_mesh_represents_has_no_error(kind):
    """Linear displacements; quadratic ones with elements of second order, whose stress is linear."""
    mesh = turned(box_mesh(2, 2, 2, 30.0, 20.0, 25.0, kind))
    if kind in FIRST:
        mesh = distorted(mesh, 0.2)
    body = solid(mesh)
    x = (body.nodes - body.nodes.mean(axis=0)) / 30.0
    rng = np.random.default_rng(1)
    u = x @ rng.normal(size=(3, 3))
    if kind in SECOND:
        u = u + np.einsum("na,nb,abc->nc", x, x, rng.normal(size=(3, 3, 3)))
    found = energy_errors(body.element_model, u.reshape(-1, 1), np.ones(1), everywhere(body))
    assert_allclose(found.energy.sum(), u.ravel() @ (body.K @ u.ravel()), rtol=1e-9)
    assert found.total[0] < 1e-4 * found.energy.sum()  # of the ridge of the fit


@pytest.mark.parametrize("kind", ["tetra", "tetra10"])
def test_nodal_defects_of_straight_tetrahedra_give_the_integral_by_quadrature(monkeypatch, kind):
    """Some cells of second order are curved, and the columns are in two blocks."""
    mesh = turned(box_mesh(3, 2, 2, 30.0, 20.0, 25.0, kind))
    n_curved = 0
    if kind == "tetra10":
        nodes = mesh.nodes.copy()
        nodes[mesh.cells[kind][:3, 4:]] += 0.3
        mesh = replace(mesh, nodes=nodes)
        n_curved = (np.isin(mesh.cells[kind], mesh.cells[kind][:3, 4:]).any(axis=1)).sum()
    body = solid(mesh)
    u = np.random.default_rng(2).normal(size=(3 * len(body.nodes), 5))
    affine, others = mesh_error.affine_cells(body.element_model, kind)
    assert len(others) == n_curved < len(affine)
    found = energy_errors(body.element_model, u, np.ones(5), np.arange(9))
    monkeypatch.setattr(mesh_error, "affine_cells", lambda model, kind: (np.zeros(0, int), np.sort([*affine, *others])))
    monkeypatch.setattr(mesh_error, "SAMPLE_BYTES", 48 * 4 * 3 * 72)
    by_quadrature = energy_errors(body.element_model, u, np.ones(5), np.arange(9))
    assert_allclose(found.error, by_quadrature.error, rtol=1e-10)
    assert_allclose(found.energy, by_quadrature.energy, rtol=1e-10)


def test_stress_that_jumps_between_materials_is_no_error():
    mesh = turned(box_mesh(4, 2, 1, 40.0, 20.0, 10.0, "tetra10"))
    materials = {
        "left half": fm.Material("soft", 70.0, 0.0, 2.7e-6), "right half": fm.Material("steel", 210.0, 0.0, 7.85e-6)
    }  # fmt: skip
    body = fm.solid_body(mesh, materials, name="two", units=MM)
    u = np.outer((body.nodes @ TURN)[:, 0], TURN[:, 0]).reshape(-1, 1)
    found = energy_errors(body.element_model, u, np.ones(1), everywhere(body))
    assert found.total[0] < 1e-12 * found.energy.sum()


def test_the_error_of_a_rod_of_linear_elements_is_that_of_its_eigenvalue():
    """u = cos(k x) at the nodes: lambda_h / lambda - 1 = (k h)² / 12 + O(h⁴), as consistent linear elements have it."""
    n, length = 24, 240.0
    body = solid(turned(box_mesh(n, 1, 1, length, 10.0, 8.0)), nu=0.0)
    along = ((body.nodes - [400.0, -90.0, 30.0]) @ TURN)[:, 0]
    k = 2 * np.pi / length
    u = np.outer(np.cos(k * along), TURN[:, 0]).reshape(-1, 1)
    found = energy_errors(body.element_model, u, np.ones(1), everywhere(body))
    assert_allclose(found.total / found.energy.sum(), (k * length / n) ** 2 / 12, rtol=0.1)


def test_free_surfaces_lose_their_traction_and_edges_all_but_the_stress_along_them():
    mesh = turned(box_mesh(2, 2, 2, 30.0, 20.0, 25.0))
    nodes, P = free_surface(mesh, np.array([0]))
    assert 0 not in nodes
    assert len(nodes) == 27 - 1 - 1  # the centre, and the loaded corner
    stress = np.random.default_rng(0).normal(size=6)
    local = (mesh.nodes - [400.0, -90.0, 30.0]) @ TURN / [30.0, 20.0, 25.0]
    for node, part in zip(nodes, P @ stress, strict=True):
        xx, yy, zz, yz, xz, xy = part
        own = TURN.T @ np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ TURN
        is_outer = np.abs(local[node] - 0.5) > 0.4
        assert_allclose(own[is_outer], 0, atol=1e-12)
        assert np.linalg.matrix_rank(own, tol=1e-9) == 3 - is_outer.sum()


def test_re_entrant_edges_keep_their_stress():
    mesh = box_mesh(2, 2, 3)
    center = mesh.nodes[mesh.cells["hexahedron"]].mean(axis=1)
    stays = (center[:, 0] < 0.5) | (center[:, 1] < 0.5)
    nodes, _ = free_surface(Mesh(mesh.nodes, {"hexahedron": mesh.cells["hexahedron"][stays]}), np.zeros(0, int))
    left = np.setdiff1d(np.unique(mesh.cells["hexahedron"][stays]), nodes)
    inner = (mesh.nodes[left, 2] > 0) & (mesh.nodes[left, 2] < 1)
    assert_allclose(mesh.nodes[left[inner], :2], 0.5)
    assert inner.sum() == 2


def test_bodies_without_stress_say_why():
    assert without_estimate(beam().element_model) == "the body consists of matrices"
    line = fm.beams.LineMesh(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0, 1]]))
    section = fm.beams.BeamProperty(fm.beams.Circle(0.01), fm.Material("steel", 2.1e11, 0.3, 7850.0))
    frame = fm.beam_body(line, section, name="b", units=fm.unit_system("m-kg-s"))
    assert without_estimate(frame.element_model) == "the stress of beams is not recovered"
