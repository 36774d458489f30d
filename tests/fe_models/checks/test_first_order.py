"""How much too stiff cells of first order are: the figure against the frequencies of whole meshes of second order."""

import numpy as np
import pytest
import scipy.sparse.linalg as spla
from numpy.testing import assert_allclose

from fe_models.checks.first_order import N_MODES, first_order_error
from fe_models.checks.mesh_report import report_mesh
from fe_models.elements.solids.body import solid_body
from fe_models.foundation.units import unit_system
from fe_models.meshes.boundary import boundary_triangles
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.quadratic_mesh import quadratic_mesh, tetrahedra_of
from tests.bodies import ALUMINIUM, STEEL, box_mesh, distorted

BAR = (20, 2, 1, 1.0, 0.1, 0.05)
PLATE = (10, 8, 1, 1.0, 0.8, 0.05)
BLOCK = (6, 4, 2, 0.4, 0.3, 0.1)
HALVES = {"left half": STEEL, "right half": ALUMINIUM}


def free_frequencies(mesh, materials=STEEL, **options):
    body = solid_body(mesh, materials, name="b", units=unit_system("m-kg-s"), **options)
    v0 = np.random.default_rng(0).normal(size=body.n_dof)
    omega2 = spla.eigsh(body.K, 6 + N_MODES, body.M, sigma=-1e4, v0=v0, return_eigenvectors=False)
    return np.sqrt(np.sort(omega2)[6:])


@pytest.mark.parametrize("size", [BAR, PLATE, BLOCK])
@pytest.mark.parametrize(("kind", "second"), [("tetra", "tetra10"), ("hexahedron", "hexahedron27")])
def test_the_figure_is_the_error_against_the_same_cells_of_second_order(kind, second, size):
    """A few steps leave it a little below: never above, and not by more than 3 % of itself."""
    mesh = box_mesh(*size, kind)
    exact = (free_frequencies(mesh, HALVES) / free_frequencies(box_mesh(*size, second), HALVES)).max() - 1
    found = first_order_error(mesh, HALVES)
    assert 0.97 * exact < found.error < exact * (1 + 1e-6)
    assert found.is_whole
    assert found.kinds == (kind,)


def test_wedges_and_meshes_of_several_types_are_measured_against_tetrahedra_of_ten_nodes():
    wedges = box_mesh(*BAR, "wedge")
    fine = free_frequencies(box_mesh(40, 4, 2, *BAR[3:], "hexahedron20"))
    exact = (free_frequencies(wedges) / fine).max() - 1
    assert_allclose(first_order_error(wedges).error, exact, rtol=0.05)
    bricks = box_mesh(10, 2, 1, 0.5, 0.1, 0.05)
    other = box_mesh(10, 2, 1, 0.5, 0.1, 0.05, "wedge")
    nodes = np.vstack([bricks.nodes, other.nodes + np.array([0.5, 0, 0])])
    unique, number = np.unique(nodes.round(9), axis=0, return_inverse=True)
    cells = {
        "hexahedron": number[bricks.cells["hexahedron"]],
        "wedge": number[other.cells["wedge"] + len(bricks.nodes)],
    }
    mixed = first_order_error(Mesh(unique, cells))
    assert mixed.is_whole
    exact = (free_frequencies(Mesh(unique, cells)) / fine).max()
    assert_allclose(mixed.error, exact - 1, rtol=0.05)


def test_second_order_and_bricks_that_bend_have_none():
    for kind in ("tetra10", "hexahedron20", "hexahedron27"):
        assert report_mesh(box_mesh(*BLOCK, kind), STEEL).first_order is None
    bricks = box_mesh(*BAR)
    assert report_mesh(bricks, STEEL, incompatible_modes=True).first_order is None
    assert (
        free_frequencies(bricks, incompatible_modes=True)[0]
        < 1.01 * free_frequencies(box_mesh(*BAR, "hexahedron27"))[0]
    )


def test_a_single_cell_has_a_figure():
    for kind in ("tetra", "hexahedron", "wedge"):
        assert 0 < first_order_error(distorted(box_mesh(1, 1, 1, kind=kind), 0.05)).error < 2


def test_of_a_large_mesh_a_piece_of_the_thinnest_wall_is_measured():
    """A plate of one cell on a block: the piece is of the plate, whose error is that of a plate alone."""
    plate, block = box_mesh(30, 30, 1, 3.0, 3.0, 0.1), box_mesh(10, 10, 10, 1.0, 1.0, 1.0)
    nodes = np.vstack([plate.nodes, block.nodes + np.array([0, 0, 0.1])])
    unique, number = np.unique(nodes.round(9), axis=0, return_inverse=True)
    cells = np.vstack([number[plate.cells["hexahedron"]], number[block.cells["hexahedron"] + len(plate.nodes)]])
    found = first_order_error(Mesh(unique, {"hexahedron": cells}))
    assert not found.is_whole
    assert 300 < found.n_cells < 600
    alone = first_order_error(box_mesh(20, 20, 1, 2.0, 2.0, 0.1))
    assert_allclose(found.error, alone.error, rtol=0.2)
    assert found.error > 3 * first_order_error(block).error


@pytest.mark.parametrize("kind", ["tetra", "hexahedron"])
def test_a_raised_mesh_holds_the_field_and_the_cells_of_the_old_one(kind):
    mesh = box_mesh(2, 2, 1, kind=kind)
    raised, P = quadratic_mesh(mesh)
    second = box_mesh(2, 2, 1, kind={"tetra": "tetra10", "hexahedron": "hexahedron27"}[kind])
    assert sorted(map(tuple, raised.nodes.round(9))) == sorted(map(tuple, second.nodes.round(9)))
    u = np.random.default_rng(0).normal(size=3 * len(mesh.nodes))
    coarse = solid_body(mesh, STEEL, name="c", units=unit_system("m-kg-s"))
    fine = solid_body(raised, STEEL, name="f", units=unit_system("m-kg-s"))
    v = (P @ u.reshape(-1, 3)).ravel()
    assert_allclose(v @ (fine.K @ v), u @ (coarse.K @ u), rtol=1e-11)  # the energy of the same field
    assert_allclose(v @ (fine.M @ v), u @ (coarse.M @ u), rtol=1e-11)


@pytest.mark.parametrize("kind", ["hexahedron", "wedge", "tetra"])
def test_tetrahedra_of_a_mesh_fill_it_and_fit_together(kind):
    mesh = distorted(box_mesh(2, 2, 2, kind=kind), 0.1)
    cut, P, owner = tetrahedra_of(mesh)
    X = cut.nodes[cut.cells["tetra"]]
    volume = np.linalg.det(X[:, 1:] - X[:, :1]) / 6
    assert (volume > 0).all()
    assert len(boundary_triangles(cut)) == 48  # two for each square of the surface: none inside
    assert_allclose(P @ mesh.nodes, cut.nodes, rtol=0, atol=1e-15)
    n_of = np.bincount(owner)
    assert (n_of == {"hexahedron": 12, "wedge": 8, "tetra": 1}[kind]).all()


def test_the_mesh_report_warns_with_the_figure_and_the_cure():
    report = report_mesh(box_mesh(*PLATE, "tetra"), STEEL)
    (finding,) = [finding for finding in report.findings if finding.kind == "first-order"]
    assert not finding.is_error
    assert report.first_order.error > 1.5
    assert f"lowest frequencies {100 * report.first_order.error:.2g} % or more too high" in finding.text
    assert "tetra10" in finding.text
    bricks = report_mesh(box_mesh(*PLATE), STEEL)
    assert "incompatible modes" in next(f.text for f in bricks.findings if f.kind == "first-order")
    assert report_mesh(box_mesh(*PLATE), STEEL, incompatible_modes=True).first_order is None
    fine = report_mesh(box_mesh(6, 6, 6), STEEL)
    assert fine.first_order.error < 0.1


def test_a_mesh_that_has_no_modes_is_not_measured():
    mesh = box_mesh(2, 1, 1)
    doubled = Mesh(mesh.nodes, {"hexahedron": np.vstack([mesh.cells["hexahedron"]] * 3)})
    report = report_mesh(doubled)
    assert "overlap" in {finding.kind for finding in report.errors}
    assert report.first_order is None
