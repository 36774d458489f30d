import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import scipy.sparse.linalg as spl
from numpy.testing import assert_allclose, assert_array_equal

from fe_models import Material, read_mesh, report_mesh, solid_body, unit_system
from fe_models.errors import InterfaceError, MeshError
from fe_models.files import MeshSize, mesh_cad
from fe_models.selections import FaceGroup
from tests.fe_models.small_solids import PLATE, PLATE_VOLUME, drawn, in_unit, plate_file
from tests.root import ROOT

STEEL = Material("steel", E=210000.0, nu=0.3, rho=7.85e-9)
COARSE = MeshSize(20.0)


@pytest.fixture(scope="module")
def plate(tmp_path_factory):
    path = plate_file(tmp_path_factory.mktemp("plate") / "plate.step")
    return mesh_cad(path, COARSE, units="mm-t-s", faces=["cylinder r=6", "plane x=0", "face 1"])


def body_of(mesh, **more):
    return solid_body(mesh, STEEL, name="plate", units=unit_system("mm-t-s"), **more)


def free_frequencies(body, n=4):
    start = np.random.default_rng(1).standard_normal(body.n_dof)
    values = spl.eigsh(body.K, 6 + n, body.M, sigma=-1e7, v0=start, return_eigenvectors=False)
    return np.sqrt(np.sort(values)[6:]) / (2 * np.pi)


def test_mesh_has_volume_mass_centre_and_inertia_of_the_plate(plate):
    gram = body_of(plate).element_model.mass_gram(np.zeros((3 * len(plate.nodes), 0)))
    (a, b, h), r, (x, y), rho = PLATE["size"], PLATE["bore"], PLATE["at"], STEEL.rho
    box, bore = rho * a * b * h, rho * np.pi * r**2 * h
    assert_allclose(gram[0, 0], rho * PLATE_VOLUME, rtol=2e-5, atol=0)
    assert_allclose(gram[0, 1:4], [box * a / 2 - bore * x, box * b / 2 - bore * y, (box - bore) * h / 2], rtol=2e-5)
    squares = np.array([box * a**2 / 3 - bore * (x**2 + r**2 / 4), box * b**2 / 3 - bore * (y**2 + r**2 / 4)])
    assert_allclose([gram[1, 1], gram[2, 2], gram[3, 3]], [*squares, (box - bore) * h**2 / 3], rtol=2e-5, atol=0)


def test_groups_are_the_nodes_on_the_faces(plate):
    on_bore = np.flatnonzero(np.abs(np.hypot(*(plate.nodes[:, :2] - PLATE["at"]).T) - PLATE["bore"]) < 1e-6)
    assert_array_equal(FaceGroup("cylinder r=6").members(plate), on_bore)
    at_end = np.flatnonzero(np.abs(plate.nodes[:, 0]) < 1e-6)
    assert_array_equal(FaceGroup("plane x=0").members(plate), at_end)
    assert_array_equal(FaceGroup("plane x=0").members(plate), FaceGroup("face 1").members(plate))
    both = FaceGroup("plane x=0", ("cylinder r=6",)).members(plate)
    assert_array_equal(both, np.union1d(on_bore, at_end))


def test_frequencies_are_those_of_a_mesh_file_of_the_same_body(plate, tmp_path):
    """A second road: gmsh's own file of a drawing that never was a STEP file, by the reader of meshes."""
    from fe_models.files.cad.gmsh_model import gmsh_model

    options = {"Mesh.ElementOrder": 2, "Mesh.MeshSizeMax": 20, "Mesh.MeshSizeMin": 1, "Mesh.MeshSizeFromCurvature": 12}
    with gmsh_model("second", options) as gmsh:
        box, tool = gmsh.model.occ.addBox(0, 0, 0, 100, 40, 10), gmsh.model.occ.addCylinder(20, 20, -5, 0, 0, 20, 6)
        gmsh.model.occ.cut([(3, box)], [(3, tool)])
        gmsh.model.occ.synchronize()
        gmsh.model.addPhysicalGroup(3, [1], name="plate")
        gmsh.model.mesh.generate(3)
        gmsh.write(str(tmp_path / "plate.msh"))
    other = read_mesh(tmp_path / "plate.msh")
    assert_allclose(free_frequencies(body_of(other)), free_frequencies(body_of(plate)), rtol=2e-3, atol=0)


def test_a_file_in_inches_gives_the_mesh_of_one_in_millimetres_25_times_as_large(plate, tmp_path):
    path = in_unit(plate_file(tmp_path / "plate.step"), "inch")
    inches = mesh_cad(path, COARSE, units="in-slinch-s")
    assert_allclose(np.ptp(inches.nodes, axis=0), PLATE["size"], rtol=1e-9, atol=0)
    millimetres = mesh_cad(path, MeshSize(20 * 25.4), units="mm-t-s")
    assert_allclose(np.ptp(millimetres.nodes, axis=0), 25.4 * np.array(PLATE["size"]), rtol=1e-9, atol=0)
    assert millimetres.n_cells == inches.n_cells
    rows = dict(report_mesh(inches, units="in-slinch-s").numbers())
    assert rows["geometry"] == "STEP in inch, taken to in; 1 solid, 7 faces, volume 38869 in³"
    assert rows["mesh size"] == "20 in, 12 elements around a circle, order 2"
    assert rows["size"] == "(100, 40, 10) in"


CLOSED_PIPE = """
import os, sys
from concurrent.futures import ThreadPoolExecutor
from fe_models.files.cad.gmsh_model import gmsh_model

def mesh():
    with gmsh_model("empty", {}):
        pass

mesh() if sys.argv[1] == "main thread" else ThreadPoolExecutor().submit(mesh).result()
reader, writer = os.pipe()
os.close(reader)
try:
    os.write(writer, b"x")
except BrokenPipeError:
    print("an error of Python")
"""


@pytest.mark.skipif(sys.platform == "win32", reason="has no SIGPIPE")
@pytest.mark.parametrize("thread", ["main thread", "another thread"])
def test_a_write_to_a_closed_pipe_does_not_end_a_process_that_has_meshed(thread):
    done = subprocess.run([sys.executable, "-c", CLOSED_PIPE, thread], cwd=ROOT, capture_output=True, text=True)
    assert done.stdout == "an error of Python\n", (done.returncode, done.stderr)


def test_the_same_file_gives_the_same_mesh(plate):
    again = mesh_cad(plate.source, COARSE, units="mm-t-s")
    assert_array_equal(again.cells["tetra10"], plate.cells["tetra10"])
    assert_allclose(again.nodes, plate.nodes, rtol=0, atol=1e-10 * 100)


def test_order_and_curvature_are_obeyed(plate):
    linear = mesh_cad(plate.source, replace(COARSE, order=1), units="mm-t-s")
    assert list(linear.cells) == ["tetra"]
    bore = FaceGroup("face 7")
    fine = mesh_cad(plate.source, replace(COARSE, curvature=40.0), units="mm-t-s")
    counts = [np.isclose(m.nodes[bore.members(m), 2], 0).sum() / 2 for m in (plate, fine)]  # corners and middles
    assert 10 <= counts[0] <= 14
    assert 36 <= counts[1] <= 44


def test_two_solids_hang_together_and_take_two_materials(tmp_path):
    with drawn(tmp_path / "two.step") as occ:
        occ.addBox(0, 0, 0, 10, 10, 10)
        occ.addBox(10, 2, 2, 10, 6, 6)
    mesh = mesh_cad(tmp_path / "two.step", MeshSize(5.0), units="mm-t-s")
    report = report_mesh(mesh, {"solid 1": STEEL, "solid 2": replace(STEEL, name="heavy", rho=2e-8)}, units="mm-t-s")
    assert report.n_parts == 1
    assert_allclose(report.mass, 1000 * STEEL.rho + 360 * 2e-8, rtol=1e-9, atol=0)


def test_a_report_names_angles_and_jacobians(plate):
    report = report_mesh(plate, STEEL, units="mm-t-s")
    assert 5 < report.angles[0] < 60
    assert 80 < report.angles[1] < 175
    assert 0.1 < report.lowest_jacobian <= 1


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"size": 0.0}, "size: expected a length above zero"),
        ({"size": 5.0, "smallest": 6.0}, "smallest: expected at most the size 5"),
        ({"size": 5.0, "order": 3}, r"order: expected 1 \(tetra\) or 2"),
        ({"size": 5.0, "curvature": 2.0}, "curvature: expected 3 to 1000"),
    ],
)
def test_impossible_sizes_are_refused(options, words):
    with pytest.raises(MeshError, match=words):
        MeshSize(**options)


def test_a_size_in_another_unit_is_refused_before_the_mesh_is_made(plate):
    with pytest.raises(MeshError, match=r"would make about 4\.4e\+13 tetrahedra of a body 108\.2 mm large"):
        mesh_cad(plate.source, MeshSize(0.002), units="mm-t-s")


def test_a_selector_without_faces_is_refused(plate):
    with pytest.raises(InterfaceError, match="no face of the body is such; it has cylinder r=6 hole"):
        mesh_cad(plate.source, COARSE, units="mm-t-s", faces=["cylinder r=8"])


def test_read_mesh_says_how_a_geometry_is_meshed(plate):
    with pytest.raises(MeshError, match=r"\[mesh_size\] in a job"):
        read_mesh(plate.source)
