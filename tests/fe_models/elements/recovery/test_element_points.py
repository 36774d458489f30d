"""Stress of each element by itself: where means over the elements about a node cancel, its own does not."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose

import fe_models as fm
from fe_models.errors import BeamError
from fe_models.foundation.errors import BodyError
from fe_models.meshes.numbering import NamedSet
from tests.bodies import box_mesh
from tests.fe_models.small_frames import SI, STEEL, space_frame, straight
from tests.fe_models.small_shells import of_nodes, plate, solved

B, H = 0.02, 0.03


def mesh_columns(body, u):
    return body.mesh_displacement(np.asarray(u)[:, None])


def test_a_moment_led_into_the_middle_of_a_beam_bends_both_sides_though_their_mean_is_none():
    """Simply supported, moment M about y in the middle: My = ± M/2 beside it, sigma = My z / Iy."""
    body = fm.body.element_points(straight(2, length=1.0))
    f, M = np.zeros(body.n_dof), 60.0
    f[6 + 4] = M
    u = solved(body, f, np.array([0, 1, 2, 3, 12 + 2]))
    model, points = body.element_model, body.stress_points
    stress, names = points.stress(mesh_columns(body, u))[:, 0, 0], points.names
    expected = M / 2 * (H / 2) / (B * H**3 / 12)
    at_middle = [k for k, name in enumerate(names) if name.startswith(("beam 0 end B", "beam 1 end A"))]
    top = [k for k in at_middle if points.positions[k, 2] > 0.49 * H]
    assert len(top) == 6  # corners and middle of the upper side, of both elements
    assert_allclose(np.abs(stress[top]), expected, rtol=1e-9)
    assert_allclose(stress[top[:3]], -stress[top[3:]], rtol=1e-9)
    ring = np.abs(body.nodes[:, 0] - 0.5) < 1e-9
    mean = model.nodal_stress(mesh_columns(body, u))[:, 0, 0]
    assert np.abs(mean[ring]).max() < 1e-6 * expected < expected / 2


def test_points_of_a_frame_are_the_section_forces_of_each_element():
    body = space_frame()
    shapes = [str(k) for k in range(5)]
    with pytest.raises(BeamError, match="beam 5 has a section given by numbers without outline"):
        fm.body.element_points(body)
    chosen = fm.body.element_points(body, [int(k) for k in shapes])
    named = fm.beams.section_points(body, range(5))
    u = np.random.default_rng(1).standard_normal((body.n_dof, 3))
    mesh = body.mesh_displacement(u)
    assert_allclose(chosen.stress_points.stress(mesh), named.stress_points.stress(mesh), rtol=1e-12, atol=1e-3)
    assert_allclose(chosen.stress_points.positions, named.stress_points.positions, rtol=1e-14, atol=1e-14)
    both = fm.body.element_points(named, [2])
    assert both.stress_points.names[: len(named.stress_points.names)] == named.stress_points.names
    assert both.provenance["stress points"] == "at beams warping stresses are left out"
    outline = np.array([(0.01, -0.02), (0.01, 0.02), (-0.01, 0.02), (-0.01, -0.02)])
    general = straight(2, fm.beams.GeneralSection(1e-3, 2e-7, 3e-7, 1e-7, outline=outline))
    assert "no shear stress" in fm.body.element_points(general).provenance["stress points"]


@pytest.mark.parametrize("kind", ["quad", "triangle"])
def test_corners_of_shells_show_their_cell_at_both_faces(kind):
    """A strip without Poisson's ratio under a line moment m in the middle: sigma = ± 6 (m/2) / t² on each side."""
    a, b, t, m = 2.0, 0.5, 0.02, 300.0
    body = plate(kind, 8, a, b, t, n_b=2, material=fm.Material("flat", E=2e11, nu=0.0, rho=1.0))
    body = fm.body.element_points(body)
    nodes = body.nodes[: body.element_model.n_nodes]
    middle = np.flatnonzero(np.abs(nodes[:, 0] - a / 2) < 1e-9)
    share = np.where(np.isin(np.abs(nodes[middle, 1] - b / 2), [b / 2]), 0.25, 0.5)
    f = np.zeros(body.n_dof)
    f[6 * middle + 4] = m * b * share
    ends = np.flatnonzero((nodes[:, 0] < 1e-9) | (nodes[:, 0] > a - 1e-9))
    fixed = np.concatenate([of_nodes(ends, 1, 2, 3, 5), of_nodes(ends[nodes[ends, 0] < 1e-9], 0)])
    u = solved(body, f, np.unique(fixed))
    points = body.stress_points
    stress = points.stress(mesh_columns(body, u))[:, 0, 0]
    at = np.abs(points.positions[:, 0] - a / 2) < 1e-9
    top = np.array([name.endswith("top") for name in points.names])
    expected = 3 * m / t**2
    assert_allclose(np.abs(stress[at]).mean(), expected, rtol=0.04 if kind == "quad" else 0.1)
    assert stress[at & top].max() > 0.9 * expected
    assert stress[at & top].min() < -0.9 * expected  # the two sides pull against each other
    assert_allclose(stress[top], -stress[~top], rtol=0, atol=1e-6 * expected)
    mean = body.element_model.nodal_stress(mesh_columns(body, u))[:, 0, 0]
    on_line = np.abs(body.nodes[:, 0] - a / 2) < 1e-9
    assert np.abs(mean[on_line]).max() < 0.2 * expected


def test_elements_are_chosen_by_number_and_set_and_refused_by_name():
    body = straight(3)
    triangles = np.flatnonzero(np.asarray(body.element_model.skin.line_of) == 2)
    numbers = 100 + np.asarray(body.element_model.skin.line_of)
    numbering = replace(body.numbering, elements=numbers, sets=(NamedSet("LAST", "elements", triangles, 1),))
    body = replace(body, numbering=numbering)
    assert {name.split()[1] for name in fm.body.element_points(body, [101]).stress_points.names} == {"101"}
    assert {name.split()[1] for name in fm.body.element_points(body, "LAST").stress_points.names} == {"102"}
    with pytest.raises(BodyError, match="no element, set or part 'LOST'"):
        fm.body.element_points(body, ["LOST"])
    with pytest.raises(BodyError, match="or 'all', got none"):
        fm.body.element_points(body, [])
    mesh = fm.beams.LineMesh(np.array([[0.0, 0, 0], [1, 0, 0]]), np.array([[0, 1]]))
    welded = fm.beam_body(mesh, fm.beams.BeamProperty(fm.beams.Circle(0.01), STEEL), name="one", units=SI)
    assert len(fm.body.element_points(welded).stress_points.names) == 2 * len(welded.element_model.sections[0].points)


@pytest.mark.parametrize("kind", ["quad", "triangle"])
def test_of_one_cell_the_corners_are_the_points_of_its_skin(kind):
    body = fm.body.element_points(plate("quad", 1, 1.0, 0.7, 0.1) if kind == "quad" else one_triangle())
    mesh = mesh_columns(body, np.random.default_rng(2).standard_normal(body.n_dof))
    skin = body.element_model.nodal_stress(mesh)
    points = body.stress_points
    away = np.linalg.norm(points.positions[:, None] - body.nodes[None], axis=2)
    assert away.min(axis=1).max() < 1e-12
    assert_allclose(points.stress(mesh), skin[away.argmin(axis=1)], rtol=1e-12, atol=1e-9 * np.abs(skin).max())


def one_triangle():
    nodes = np.array([[0.0, 0, 0], [1, 0, 0.2], [0.1, 0.8, 0]])
    mesh = fm.shells.ShellMesh(nodes, {"triangle": np.array([[0, 1, 2]])})
    return fm.shell_body(mesh, fm.shells.ShellProperty(0.05, STEEL), name="one", units=SI)


def layered(incompatible=False, kind="hexahedron"):
    """A bar of two materials without lateral contraction, side by side in x."""
    stiff, soft = (fm.Material(n, E=E, nu=0.0, rho=1000.0) for n, E in (("stiff", 2e11), ("soft", 5e8)))
    mesh = box_mesh(4, 2, 2, 1.0, 0.3, 0.2, kind)
    materials = {"left half": soft, "right half": stiff}
    return fm.solid_body(mesh, materials, name="b", units=SI, incompatible_modes=incompatible)


@pytest.mark.parametrize("incompatible", [False, True])
def test_at_borders_each_material_has_its_own_stress(incompatible):
    """A strain of one size in both: E eps in each, and the node shows the stiffest."""
    body = fm.body.element_points(layered(incompatible), "borders")
    eps = 1e-3
    u = np.zeros((body.n_dof, 1))
    u[0::3, 0] = eps * body.nodes[:, 0]
    points = body.stress_points
    stress = points.stress(u)[:, :, 0]
    assert len(points.names) == 2 * 9
    assert_allclose(points.positions[:, 0], 0.5)
    for name, value in zip(points.names, stress, strict=True):
        modulus = 5e8 if name.startswith("soft node ") else 2e11
        assert_allclose(value, [modulus * eps, 0, 0, 0, 0, 0], rtol=0, atol=1e-9 * modulus * eps)
    at_border = np.abs(body.nodes[:, 0] - 0.5) < 1e-12
    nodal = body.element_model.nodal_stress(u)[at_border, 0, 0]
    assert_allclose(nodal, 2e11 * eps, rtol=1e-9)
    with pytest.raises(BodyError, match="borders: it has no node at which solid cells of different materials meet"):
        fm.body.element_points(fm.solid_body(box_mesh(2, 1, 1), STEEL, name="one", units=SI), "borders")


def test_solid_cells_have_their_own_stress_where_the_nodal_one_is_a_mean():
    """Strains that jump from cell to cell: at a node between them each cell keeps its own, the node has their mean."""
    mesh = box_mesh(2, 1, 1, 1.0, 0.3, 0.2, "hexahedron20")
    body = fm.body.element_points(
        fm.solid_body(mesh, fm.Material("m", E=2e11, nu=0.0, rho=1.0), name="b", units=SI), "all"
    )
    x, first, second = body.nodes[:, 0], 1e-3, -4e-4
    u = np.zeros((body.n_dof, 1))
    u[0::3, 0] = first * np.minimum(x, 0.5) + second * np.maximum(x - 0.5, 0.0)
    points, stress = body.stress_points, body.stress_points.stress(u)[:, :, 0]
    assert len(points.names) == 2 * 20
    cells = mesh.cells["hexahedron20"]
    is_first = np.repeat(mesh.nodes[cells].mean(axis=1)[:, 0] < 0.5, 20)
    assert_allclose(stress[:, 0], 2e11 * np.where(is_first, first, second), rtol=1e-9)
    assert_allclose(points.positions, mesh.nodes[cells.ravel()], rtol=0, atol=0)
    middle = np.abs(x - 0.5) < 1e-12
    assert_allclose(body.element_model.nodal_stress(u)[middle, 0, 0], 2e11 * (first + second) / 2, rtol=1e-9)
    assert points.names[0].startswith("solid ")
    assert points.names[0].endswith(" inside")


def test_nodal_stress_at_a_clamp_is_that_of_bending():
    """F L z / I at the root of a cantilever without lateral contraction, extrapolated from the points inside."""
    length, b, h, F = 1.0, 0.06, 0.1, 1e3
    mesh = box_mesh(10, 1, 2, length, b, h, "hexahedron20")
    body = fm.solid_body(mesh, fm.Material("m", E=2e11, nu=0.0, rho=1.0), name="b", units=SI)
    root, tip = (np.flatnonzero(np.abs(mesh.nodes[:, 0] - x) < 1e-12) for x in (0.0, length))
    f = np.zeros(body.n_dof)
    f[3 * tip + 2] = F / len(tip)
    u = solved(body, f, (3 * root[:, None] + np.arange(3)).ravel())
    stress = body.element_model.nodal_stress(mesh_columns(body, u))[root, 0, 0]
    z = mesh.nodes[root, 2] - h / 2
    expected = -F * length * z / (b * h**3 / 12)
    assert_allclose(stress, expected, rtol=0, atol=0.02 * np.abs(expected).max())
