from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models.body.material import Material
from fe_models.checks.mesh_report import report_mesh
from fe_models.errors import MaterialError, MeshError
from fe_models.foundation.units import UNIT_SYSTEMS
from fe_models.meshes.boundary import boundary_facets
from fe_models.meshes.cell_shapes import CELL_SHAPES, quadrature, shape_values
from fe_models.meshes.cells.raw_mesh import mirrored_order
from fe_models.meshes.mesh import Mesh, drop_unused_nodes
from fe_models.meshes.quadratic_mesh import FIRST_ORDER
from tests.bodies import ALUMINIUM, STEEL
from tests.fe_models.small_meshes import SOLID_TYPES, cell_mesh, faced_box, joined

ROUNDOFF = 1e-12


def kinds(report):
    return {finding.kind for finding in report.findings}


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_report_of_a_box(kind):
    mesh = faced_box(kind, (3, 2, 2))
    report = report_mesh(mesh, STEEL)
    assert report.n_nodes == len(mesh.nodes)
    assert report.n_cells == {kind: len(mesh.cells[kind])}
    assert_allclose([report.lo, report.hi], [[0, 0, 0], [2, 1, 1.5]], rtol=0, atol=0)
    assert_allclose(report.volume, 3, rtol=ROUNDOFF, atol=0)
    assert_allclose(report.mass, 3 * 7850, rtol=ROUNDOFF, atol=0)
    assert_allclose(report.mass_centre, [1, 0.5, 0.75], rtol=ROUNDOFF, atol=0)
    assert report.n_parts == 1
    assert kinds(report) == ({"first-order"} if kind in FIRST_ORDER else set())
    report.raise_for_errors()


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_mass_of_two_materials_adds_their_halves(kind):
    materials = {"left half": STEEL, "right half": ALUMINIUM}
    report = report_mesh(faced_box(kind), materials)
    left, right = 1.5 * 7850, 1.5 * 2700
    assert_allclose(report.mass, left + right, rtol=ROUNDOFF, atol=0)
    assert_allclose(report.mass_centre[0], (0.5 * left + 1.5 * right) / (left + right), rtol=ROUNDOFF, atol=0)


def test_volume_of_curved_tetrahedra_equals_the_flux_through_their_boundary():
    mesh = faced_box("tetra10", (2, 2, 2), (1, 1, 1))
    rng = np.random.default_rng(4)
    bent = replace(mesh, nodes=mesh.nodes + rng.uniform(-0.01, 0.01, mesh.nodes.shape))
    points, weights = quadrature("triangle6")
    N, dN = shape_values("triangle6", points)
    X = bent.nodes[boundary_facets(bent)["triangle6"]]
    tangents = np.einsum("fnd,pna->fpad", X, dN)
    normals = np.cross(tangents[:, :, 0], tangents[:, :, 1])
    flux = np.einsum("p,fpd,pn,fnd->", weights, normals, N, X) / 3
    assert_allclose(report_mesh(bent).volume, flux, rtol=ROUNDOFF, atol=0)


def test_materials_are_optional():
    report = report_mesh(faced_box("tetra"))
    assert report.mass is None
    assert not any(label == "mass" for label, _ in report.rows())


def test_cells_without_a_material_are_refused():
    with pytest.raises(MaterialError, match="cells without a material"):
        report_mesh(faced_box("tetra"), {"left half": STEEL})


def test_rows_and_lines_say_the_numbers_with_units():
    report = report_mesh(faced_box("tetra"), Material("steel", 2.1e5, 0.3, 7.85e-9), units="mm-t-s")
    assert ("volume", "3 mm³") in report.rows()
    assert any(line.startswith("mass") and line.endswith("2.355e-08 t") for line in report.lines())


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_mirrored_mesh_is_told_as_such(kind):
    mesh = faced_box(kind)
    report = report_mesh(replace(mesh, cells={kind: mesh.cells[kind][:, mirrored_order(kind)]}))
    assert report.inverted[kind].size == len(mesh.cells[kind])
    with pytest.raises(MeshError, match="all cells are inside out: the mesh is mirrored"):
        report.raise_for_errors()


def test_inverted_cell_is_named_by_its_number_in_the_file():
    mesh = faced_box("tetra")
    cells = mesh.cells["tetra"].copy()
    cells[3] = cells[3][[0, 2, 1, 3]]
    numbers = {"tetra": np.arange(101, 101 + len(cells))}
    report = report_mesh(replace(mesh, cells={"tetra": cells}, cell_numbers=numbers))
    assert_array_equal(report.inverted["tetra"], [3])
    with pytest.raises(MeshError, match=r"1 tetra cells \(numbers 104; .* are inverted"):
        report.raise_for_errors()


def test_middle_node_dragged_through_the_cell_inverts_it():
    nodes = CELL_SHAPES["tetra10"].nodes.copy()
    nodes[4] = [0.5, 0.9, 0.3]
    assert "inverted" in kinds(report_mesh(cell_mesh("tetra10", nodes)))


def test_jacobian_below_zero_at_a_node_only_is_a_warning():
    nodes = CELL_SHAPES["tetra10"].nodes.copy()
    nodes[4] = [0.2, 0, 0]  # beyond the quarter point of its edge
    report = report_mesh(cell_mesh("tetra10", nodes))
    assert kinds(report) == {"distorted"}
    report.raise_for_errors()


def test_flat_cell_is_degenerate():
    nodes = CELL_SHAPES["tetra"].nodes.copy()
    nodes[3] = [0.2, 0.2, 0]
    report = report_mesh(cell_mesh("tetra", nodes))
    assert "degenerate" in kinds(report)
    with pytest.raises(MeshError, match="without volume"):
        report.raise_for_errors()


def test_hexahedron_collapsed_to_a_wedge_is_only_distorted():
    nodes = CELL_SHAPES["hexahedron"].nodes.copy()
    nodes[[3, 7]] = nodes[[2, 6]]
    report = report_mesh(cell_mesh("hexahedron", nodes))
    assert "distorted" in kinds(report)
    assert not {"inverted", "degenerate"} & kinds(report)


def test_parts_that_are_not_connected_are_counted():
    first = faced_box("tetra", (2, 1, 1))
    second = faced_box("hexahedron", (1, 1, 1))
    report = report_mesh(joined(first, replace(second, nodes=second.nodes + np.array([2, 0, 0]))))
    assert report.n_parts == 2
    assert report.part_cells == (12, 1)
    assert report.n_coincident == 8
    with pytest.raises(MeshError, match=r"falls into 2 parts that are not connected .* 8 nodes coincide"):
        report.raise_for_errors()
    report.raise_for_errors(accept=["parts"])


def test_parts_that_meet_in_an_edge_warn_of_a_hinge():
    nodes = np.concatenate([CELL_SHAPES["hexahedron"].nodes, CELL_SHAPES["hexahedron"].nodes + np.array([1, 1, 0])])
    unique, number = np.unique(nodes, axis=0, return_inverse=True)
    report = report_mesh(Mesh(unique, {"hexahedron": number.reshape(2, 8)}))
    assert report.n_parts == 1
    assert kinds(report) == {"hinge", "first-order"}


def test_coincident_nodes_of_a_crack_warn():
    mesh = faced_box("hexahedron", (2, 2, 1))
    doubled = int(np.flatnonzero((mesh.nodes == [1, 0, 0]).all(axis=1))[0])
    cells = mesh.cells["hexahedron"].copy()
    cells[cells == doubled] = np.where((cells == doubled).nonzero()[0] == 0, len(mesh.nodes), doubled)
    report = report_mesh(Mesh(np.vstack([mesh.nodes, mesh.nodes[doubled]]), {"hexahedron": cells}))
    assert report.n_coincident == 2
    assert kinds(report) == {"coincident", "first-order"}


@pytest.mark.parametrize("scale", [1e-6, 1.0, 1e6])
def test_coincidence_is_relative_to_the_size(scale):
    mesh = faced_box("tetra")
    near = np.vstack([mesh.nodes, mesh.nodes[0] + [0, 0, 1e-7]]) * scale
    cells = mesh.cells["tetra"].copy()
    cells[0][cells[0] == 0] = len(mesh.nodes)
    assert report_mesh(Mesh(near, {"tetra": cells})).n_coincident == 2
    assert report_mesh(replace(mesh, nodes=mesh.nodes * scale)).n_coincident == 0


def test_three_cells_on_one_facet_overlap():
    apex = [[0.3, 0.3, 1], [0.3, 0.3, 0.5], [0.3, 0.3, -1]]
    nodes = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], *apex], dtype=float)
    report = report_mesh(Mesh(nodes, {"tetra": np.array([[0, 1, 2, 3], [0, 1, 2, 4], [0, 2, 1, 5]])}))
    assert "overlap" in {finding.kind for finding in report.errors}


def test_linear_beside_quadratic_cells_are_refused():
    quadratic = CELL_SHAPES["tetra10"].nodes
    nodes = np.vstack([quadratic, [0.3, 0.3, -1]])
    report = report_mesh(Mesh(nodes, {"tetra10": np.arange(10)[None], "tetra": np.array([[0, 2, 1, 10]])}))
    assert "transition" in {finding.kind for finding in report.errors}


def test_tetrahedra_on_a_quadrilateral_facet_warn():
    hexahedron = CELL_SHAPES["hexahedron"].nodes
    nodes = np.vstack([hexahedron, [0.5, 0.5, 2]])
    cells = {"hexahedron": np.arange(8)[None], "tetra": np.array([[4, 5, 6, 8], [4, 6, 7, 8]])}
    report = report_mesh(Mesh(nodes, cells))
    assert "tetra-on-quad" in kinds(report)


def test_unused_nodes_are_counted_and_dropped_with_all_sets_renumbered():
    mesh = faced_box("tetra10")
    shift = 3
    nodes = np.vstack([np.full((shift, 3), 77.0), mesh.nodes, [[88.0, 0, 0]]])
    faces = {"triangle6": np.vstack([mesh.faces["triangle6"] + shift, [[0, 1, 2, 3, 4, 5]]])}
    n_faces = len(mesh.faces["triangle6"])
    dirty = Mesh(
        nodes,
        {"tetra10": mesh.cells["tetra10"] + shift},
        mesh.cell_sets,
        faces,
        {"mixed": {"triangle6": np.array([0, n_faces])}, "loose": {"triangle6": np.array([n_faces])}},
        {"some": np.array([0, shift + 5]), "none": np.array([1])},
        node_numbers=np.arange(1000, 1000 + len(nodes)),
    )
    report = report_mesh(dirty)
    assert report.n_unused_nodes == 4
    assert_array_equal(report.hi, [2, 1, 1.5])
    clean = drop_unused_nodes(dirty)
    assert_array_equal(clean.nodes, mesh.nodes)
    assert_array_equal(clean.cells["tetra10"], mesh.cells["tetra10"])
    assert_array_equal(clean.faces["triangle6"], mesh.faces["triangle6"])
    assert_array_equal(clean.face_sets["mixed"]["triangle6"], [0])
    assert_array_equal(clean.node_sets["some"], [5])
    assert_array_equal(clean.node_numbers, np.arange(1003, 1003 + len(mesh.nodes)))
    assert clean.face_sets["loose"] == {}
    assert clean.node_sets["none"].size == 0
    assert "4 nodes that belong to no solid cell were dropped, with 1 faces" in clean.notes[0]
    assert "became empty: loose, none" in clean.notes[0]
    assert drop_unused_nodes(mesh) is mesh


@pytest.mark.parametrize("name", UNIT_SYSTEMS)
def test_steel_and_rubber_parts_are_plausible_in_every_unit_system(name):
    units = UNIT_SYSTEMS[name]
    density = units.to_si(mass=1, length=-3)
    modulus = units.to_si(mass=1, length=-1, time=-2)
    mesh = faced_box("tetra")
    mesh = replace(mesh, nodes=mesh.nodes * 0.1 / units.length)
    for E, rho in ((2.1e11, 7850), (1e6, 1100)):
        report = report_mesh(mesh, Material("m", E / modulus, 0.3, rho / density), units=name)
        assert kinds(report) == {"first-order"}


def unit_error(material, units, size=1.0):
    mesh = faced_box("tetra")
    report = report_mesh(replace(mesh, nodes=mesh.nodes * size), material, units=units)
    with pytest.raises(MeshError) as caught:
        report.raise_for_errors()
    return str(caught.value)


def test_density_in_si_for_a_mesh_in_millimetres_names_what_it_should_be():
    text = unit_error(Material("steel", 2.1e5, 0.3, 7850), "mm-t-s", 100)
    assert "density of 'steel' 7850 t/mm³ = 7.85e+15 kg/m³" in text
    assert "steel in mm-t-s is 7.85e-09" in text


def test_numbers_of_another_system_name_the_one_that_fits():
    text = unit_error(Material("steel", 2.1e5, 0.3, 7.85e-9), "m-kg-s", 100)
    assert "density of 'steel' 7.85e-09 kg/m³" in text
    assert "all numbers would fit mm-t-s" in text


def test_body_of_a_hundred_kilometres_is_refused():
    assert "expected 0.0001 to 1000 m" in unit_error(STEEL, "m-kg-s", 1e5)


def test_modulus_in_gigapascal_is_refused():
    assert "modulus of 'steel' 210 Pa" in unit_error(Material("steel", 210, 0.3, 7850), "m-kg-s")


def test_modulus_and_density_of_different_systems_warn():
    report = report_mesh(faced_box("tetra"), Material("steel", 2.1e5, 0.3, 7850))
    assert kinds(report) == {"units", "first-order"}
    assert "run at sqrt(E/rho) = 5.172 m/s" in report.warnings[-1].text
