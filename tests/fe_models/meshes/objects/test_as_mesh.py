import meshio
import numpy as np
import pytest
import skfem
from numpy.testing import assert_allclose, assert_array_equal

from fe_models import Material, report_mesh, rigid_interface, shell_body, solid_body, unit_system
from fe_models.beams import as_line_mesh
from fe_models.errors import MeshError
from fe_models.meshes import as_mesh
from fe_models.meshes.mesh import SOLID_TYPES
from fe_models.meshes.objects.as_mesh import VTK_TYPES
from fe_models.selections import FaceGroup, Plane
from fe_models.shells import ShellProperty, as_shell_mesh
from tests.bodies import box_mesh

SI = unit_system("m-kg-s")
STEEL = Material("steel", E=2.1e11, nu=0.3, rho=7850.0)
SKFEM = {
    "tetra": skfem.MeshTet1, "tetra10": skfem.MeshTet2, "hexahedron": skfem.MeshHex1, "hexahedron27": skfem.MeshHex2,
    "wedge": skfem.MeshWedge1,
}  # fmt: skip


def as_meshio(mesh):
    return meshio.Mesh(mesh.nodes, [(kind, cells) for kind, cells in mesh.cells.items()])


@pytest.mark.parametrize("kind", [kind for kind in SOLID_TYPES if kind in meshio._mesh.topological_dimension])
def test_a_meshio_mesh_is_the_mesh_it_was_made_of(kind):
    mesh = box_mesh(2, 1, 1, 2.0, 1.0, 1.5, kind)
    again = as_mesh(as_meshio(mesh))
    assert_array_equal(again.nodes, mesh.nodes)
    assert_array_equal(again.cells[kind], mesh.cells[kind])


def test_named_sets_and_values_of_a_meshio_mesh_are_groups():
    mesh = as_meshio(box_mesh(2, 1, 1, 2.0, 1.0, 1.5, "hexahedron"))
    left = np.flatnonzero(mesh.points[:, 0] == 0)
    mesh.cells.append(meshio.CellBlock("quad", mesh.cells[0].data[:1, [0, 4, 7, 3]]))
    mesh.cell_sets = {"left": [np.zeros(0, int), np.array([0])], "first": [np.array([0]), np.zeros(0, int)]}
    mesh.cell_data = {"layer": [np.array([4, 5]), np.array([0])]}
    mesh.point_sets = {"end": left}
    again = as_mesh(mesh)
    assert_array_equal(FaceGroup("left").members(again), left)
    assert_array_equal(again.cell_sets["first"]["hexahedron"], [0])
    assert_array_equal(again.cell_sets["layer_5"]["hexahedron"], [1])
    assert_array_equal(again.node_sets["end"], left)


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_a_pyvista_grid_is_the_mesh_it_was_made_of(kind):
    import pyvista

    mesh = box_mesh(2, 1, 1, 2.0, 1.0, 1.5, kind)
    (number,) = [number for number, name in VTK_TYPES.items() if name == kind]
    grid = pyvista.UnstructuredGrid({number: mesh.cells[kind]}, mesh.nodes)
    grid.cell_data["part"] = np.arange(mesh.n_cells) % 2
    again = as_mesh(grid)
    assert_array_equal(again.cells[kind], mesh.cells[kind])
    assert_array_equal(again.cell_sets["part_1"][kind], np.arange(1, mesh.n_cells, 2))


def small_skfem(kind):
    first = {"tetra10": "tetra", "hexahedron27": "hexahedron"}.get(kind, kind)
    if first == "wedge":
        mesh = skfem.MeshWedge1()
    else:
        mesh = SKFEM[first].init_tensor(np.array([0, 0.7, 1.5]), np.array([0, 1.0]), np.array([0, 0.8]))
    return mesh if first == kind else SKFEM[kind].from_mesh(mesh)


@pytest.mark.parametrize("kind", SKFEM)
def test_a_mesh_of_scikit_fem_has_the_volume_and_upright_cells(kind):
    mesh = as_mesh(small_skfem(kind))
    assert list(mesh.cells) == [kind]
    report = report_mesh(mesh)
    assert_allclose(report.volume, 1.0 if kind == "wedge" else 1.2, rtol=1e-12, atol=0)
    assert not report.findings or all(not finding.is_error for finding in report.findings)


@pytest.mark.parametrize("kind", SKFEM)
def test_boundaries_and_subdomains_of_scikit_fem_are_groups(kind):
    mesh = small_skfem(kind)
    mesh = mesh.with_boundaries({"end": lambda x: x[0] == 0}).with_subdomains({"all of it": lambda x: x[0] > -1})
    ours = as_mesh(mesh)
    on_end = Plane((0, 0, 0), (1, 0, 0)).members(ours)
    assert_array_equal(FaceGroup("end").members(ours), on_end)
    assert len(ours.cell_sets["all of it"][kind]) == ours.n_cells


def test_bodies_reports_and_interfaces_take_meshes_of_other_libraries():
    mesh = small_skfem("tetra10").with_boundaries({"end": lambda x: x[0] == 0})
    interface = rigid_interface(mesh, "end", FaceGroup("end"))
    body = solid_body(mesh, STEEL, name="box", units=SI, interfaces=[interface])
    assert_allclose(body.M.sum() / 3, 7850 * 1.2, rtol=1e-12, atol=0)
    assert_allclose(report_mesh(mesh, STEEL).mass, 7850 * 1.2, rtol=1e-12, atol=0)
    assert_allclose(interface.reference, [0, 0.5, 0.4], rtol=0, atol=1e-14)
    assert body.provenance["mesh"] == "skfem.MeshTet2"


def test_a_flat_mesh_of_scikit_fem_is_a_shell_at_z_0():
    mesh = skfem.MeshQuad.init_tensor(np.linspace(0, 2, 3), np.linspace(0, 1, 2))
    body = shell_body(mesh, ShellProperty(0.01, STEEL), name="plate", units=SI)
    assert_allclose(body.node_volumes.sum(), 2 * 0.01, rtol=1e-12, atol=0)
    assert_array_equal(as_shell_mesh(mesh).nodes[:, 2], 0)


def test_lines_of_meshio_are_a_frame():
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    mesh = as_line_mesh(meshio.Mesh(points, [("line", np.array([[0, 1], [1, 2]]))]))
    assert_array_equal(mesh.lines, [[0, 1], [1, 2]])


WRONG = [
    (np.zeros((3, 3)), "expected a mesh of fe_models, or one of meshio.Mesh, .*; got numpy.ndarray"),
    (meshio.Mesh(np.zeros((3, 3)), [("triangle", np.array([[0, 1, 2]]))]), "expected solid cells"),
    (meshio.Mesh(np.zeros((4, 3)), [("tetra", np.array([[0, 1, 2, 9]]))]), "names a node that is not in the file"),
    (meshio.Mesh(np.full((4, 3), np.nan), [("tetra", np.array([[0, 1, 2, 3]]))]), "expected finite coordinates"),
    (skfem.MeshTri(), "expected solid cells"),
    (skfem.MeshTri2.from_mesh(skfem.MeshTri()), "got ElementTriP2; convert the mesh"),
]


@pytest.mark.parametrize(("mesh", "words"), WRONG)
def test_what_is_no_solid_mesh_is_refused(mesh, words):
    with pytest.raises(MeshError, match=words):
        as_mesh(mesh)
