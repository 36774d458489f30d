import meshio
import numpy as np
import pytest
import scipy.linalg as la
from numpy.testing import assert_allclose

from cms.cli.split import SplitRequest, split_job
from cms.errors import JobError
from cms.jobs.body_of_job import job_body, shell_mesh
from cms.jobs.job import read_job
from cms.pipeline import reduce_job
from fe_models.assembly.tables.materials import material_of
from fe_models.assembly.tables.shells import shell_properties
from fe_models.elements.shells.shell_property import LaminateProperty, Layer
from fe_models.errors import FeModelsError, MaterialError

TRAY = """
[body]
mesh = "tray.msh"
units = "m-kg-s"

[materials.steel]
young = 2e11
poisson = 0.3
density = 8000

[materials.tin]
young = 7e10
poisson = 0.3
density = 2700

[shells.floor]
thickness = 0.01
cells = "floor"
material = "steel"
offset = 0.005

[shells.wall]
thickness = 0.02
cells = ["wall"]
material = "tin"
added_mass = 10

[sections.rib]
shape = "rectangle"
width = 0.01
height = 0.04
lines = "rib"
material = "steel"

[masses.bob]
node = "corner"
mass = 2.0

[interfaces.hinge]
kind = "rigid"
nodes = "hinge"

[interfaces.top]
kind = "distributing"
box = {lo = [0, 0, 0.7], hi = [2, 2, 2]}

[load_cases.blow]
kind = "pressure"
faces = "floor"
pressure = 100.0

[reduction]
n_modes = 4
frame = "nodal"
at = "hinge"
"""


@pytest.fixture
def job_file(tmp_path):
    """A floor of quads, a wall of triangles, a rib across the floor."""
    n = 4
    index = np.arange((2 * n + 1) * (n + 1)).reshape(2 * n + 1, n + 1)
    s, y = np.meshgrid(np.linspace(0, 2, 2 * n + 1), np.linspace(0, 1, n + 1), indexing="ij")
    points = np.stack([np.minimum(s, 1), y, np.maximum(s - 1, 0)], axis=-1).reshape(-1, 3)
    quads = np.stack([index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]], axis=-1)
    wall = quads[n:].reshape(-1, 4)
    triangles = np.concatenate([wall[:, [0, 1, 2]], wall[:, [0, 2, 3]]])
    blocks = [
        ("quad", quads[:n].reshape(-1, 4), 1),
        ("triangle", triangles, 2),
        ("line", np.stack([index[:n, 2], index[1 : n + 1, 2]], axis=1), 3),
        ("line", np.stack([index[0, :-1], index[0, 1:]], axis=1), 4),
        ("vertex", index[:1, :1], 5),
    ]
    meshio.write(
        tmp_path / "tray.msh",
        meshio.Mesh(
            points,
            [(kind, cells) for kind, cells, _ in blocks],
            cell_data={
                "gmsh:physical": [np.full(len(cells), tag) for _, cells, tag in blocks],
                "gmsh:geometrical": [np.full(len(cells), tag) for _, cells, tag in blocks],
            },
            field_data={
                name: np.array([tag, dim])
                for name, tag, dim in [
                    ("floor", 1, 2),
                    ("wall", 2, 2),
                    ("rib", 3, 1),
                    ("hinge", 4, 1),
                    ("corner", 5, 0),
                ]
            },
        ),
        file_format="gmsh22",
        binary=False,
    )

    def write(text):
        path = tmp_path / "tray.toml"
        path.write_text(text)
        return path

    return write


def test_a_job_makes_the_shell_with_its_ribs_masses_interfaces_and_loads(job_file):
    job = read_job(job_file(TRAY))
    body = job_body(job)
    reports = []
    reduced = reduce_job(job, on_report=reports.append)
    floor, wall, rib = 8000 * 0.01, 2700 * 0.02 + 10, 8000 * 0.01 * 0.04
    assert_allclose(reduced.moments.m, floor + wall + rib + 2.0, rtol=1e-12)
    assert [interface.name for interface in body.interfaces] == ["hinge", "top"]
    assert_allclose(body.interfaces[1].reference, [1, 0.5, 0.875])
    assert_allclose(reduced.load_cases[0].force, [0, 0, -100.0], rtol=0, atol=1e-9)
    assert reduced.stress is not None
    assert reduced.geometric is not None
    assert reports[0].n_lines == 4
    assert reduced.provenance["cells triangle"] == "32"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("thickness = 0.01\n", "", "shells.floor.thickness: missing"),
        ("thickness = 0.01", "thickness = 0", "shells.floor.thickness = 0: expected a number above 0"),
        (
            'material = "tin"',
            'material = "tim"',
            'shells.wall.material = "tim": there is no such material; did you mean',
        ),
        ('material = "steel"\noffset', "offset", "shells.floor.material: missing; there are 2 materials"),
        ('cells = "floor"\n', "", 'shells.floor: cells = "all", but there are 2 tables'),
        ('lines = "rib"\n', "", "sections.rib.lines: missing"),
        ('units = "m-kg-s"', 'units = "m-kg-s"\nplane = "xy"', "body.plane: belongs to beams alone"),
        (
            "[masses.bob]",
            '[ties.bob]\nkind = "rigid"\nfaces = "wall"\nnode = "corner"\n[masses.bob]',
            "ties: belong to",
        ),
    ],
)
def test_a_bad_job_of_shells_is_refused(job_file, old, new, words):
    assert old in TRAY
    with pytest.raises(JobError) as caught:
        read_job(job_file(TRAY.replace(old, new, 1)))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('cells = "floor"', 'cells = "flor"', "the mesh has no group of cells 'flor'; did you mean 'floor'"),
        ('lines = "rib"', 'lines = "ribs"', "no group of lines 'ribs'; did you mean 'rib'"),
        ('faces = "floor"', 'faces = "hinge"', "no group of cells 'hinge' ('hinge' is a node set)"),
    ],
)
def test_a_job_that_does_not_fit_its_mesh_is_refused(job_file, old, new, words):
    with pytest.raises((JobError, FeModelsError)) as caught:
        job_body(read_job(job_file(TRAY.replace(old, new, 1))))
    assert words in str(caught.value)


def test_quads_warped_beyond_the_limit_are_refused_unless_they_are_accepted(job_file, tmp_path):
    path = job_file(TRAY)
    text = (tmp_path / "tray.msh").read_text()
    head, nodes = text.split("$Nodes\n")
    lines = nodes.split("\n")
    number, x, y, _ = lines[1].split()
    lines[1] = f"{number} {x} {y} 0.2"  # a corner of the floor lifted
    (tmp_path / "tray.msh").write_text(head + "$Nodes\n" + "\n".join(lines))
    with pytest.raises(FeModelsError, match=r"1 quad cells are warped beyond 20 degrees.*split them into triangles"):
        job_body(read_job(path))
    job_body(read_job(job_file(TRAY.replace("[materials.steel]", 'accept = "warped"\n\n[materials.steel]', 1))))


LAYUP = (
    TRAY.replace(
        'thickness = 0.01\ncells = "floor"\nmaterial = "steel"\n',
        """layers = [{thickness = 0.002, angle = 45, material = "ply"}, {thickness = 0.003, material = "steel"}]
symmetric = true
direction = [1, 1, 0]
cells = "floor"
""",
    )
    + """
[materials.ply]
young = [140e9, 10e9, 10e9]
shear = [5e9, 5e9, 3.5e9]
poisson = [0.3, 0.3, 0.4]
density = 1500
"""
)


def test_a_job_of_layers_makes_the_laminate(job_file):
    job = read_job(job_file(LAYUP))
    body = job_body(job)
    ply, steel = (material_of(name, job.materials[name]) for name in ("ply", "steel"))
    lower = (Layer(ply, 0.002, 45.0), Layer(steel, 0.003))
    made = shell_properties(job.shells, job.materials)["floor"]
    assert made == LaminateProperty((*lower, *lower[::-1]), (1, 1, 0), offset=0.005)
    assert body.provenance["layers 1"].endswith(
        "ply 0.002 at 45.0, steel 0.003 at 0.0, steel 0.003 at 0.0, ply 0.002 at 45.0"
    )
    rib, floor = 8000 * 0.01 * 0.04, 1500 * 0.004 + 8000 * 0.006
    assert_allclose(reduce_job(job).moments.m, floor + 2700 * 0.02 + 10 + rib + 2.0, rtol=1e-12)


MATRICES = "thickness = 0.02\nstiffness = [[1]]\nshear_stiffness = [[1]]"


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("direction = [1, 1, 0]\n", "", "shells.floor.direction: missing; expected [x, y, z], where angle 0"),
        ("symmetric = true", "thickness = 0.01", "shells.floor.thickness: each of the layers has its own"),
        ("symmetric = true", 'material = "ply"', "shells.floor.material: each of the layers has its own"),
        (', material = "ply"}', "}", "shells.floor.layers.0.material: missing; there are 3 materials"),
        ('material = "steel"}', 'material = "steal"}', 'shells.floor.layers.1.material = "steal": there is no such'),
        ("thickness = 0.02", "thickness = 0.02\nsymmetric = true", "shells.wall.symmetric: belongs to layers"),
        ("thickness = 0.02", "thickness = 0.02\ndirection = [1, 0, 0]", "shells.wall.direction: belongs to layers"),
        ("thickness = 0.02", "thickness = 0.02\nshear_stiffness = [[1]]", "shear_stiffness: belongs to stiffness"),
        ("thickness = 0.02", "thickness = 0.02\nstiffness = [[1]]", "shells.wall.shear_stiffness: missing; stiffness"),
        ("symmetric = true", MATRICES, "shells.floor.layers: the matrices of stiffness stand for it"),
        ("thickness = 0.02", f"{MATRICES}\ndirection = [1, 0, 0]", "shells.wall.material: the matrices of stiffness"),
        ("angle = 45", "angel = 45", "shells.floor.layers.0.angel: unknown key; did you mean"),
    ],
)
def test_a_bad_job_of_layers_is_refused(job_file, old, new, words):
    assert old in LAYUP
    with pytest.raises(JobError) as caught:
        read_job(job_file(LAYUP.replace(old, new, 1)))
    assert words in str(caught.value)


def test_an_orthotropic_material_belongs_to_layers(job_file):
    text = LAYUP.replace('material = "tin"', 'material = "ply"')
    with pytest.raises(MaterialError, match=r"ply: it is not isotropic; shells of one thickness \(not of layers\)"):
        job_body(read_job(job_file(text)))


def test_a_surface_mesh_without_thickness_is_refused(job_file):
    solid = TRAY[: TRAY.index("[materials.tin]")] + "[reduction]\nn_modes = 1\n"
    with pytest.raises(FeModelsError, match=r"expected solid cells .* a shell needs its thickness \(tables \[shells"):
        job_body(read_job(job_file(solid)))


def test_a_shell_in_parts_has_all_its_mass_and_load(job_file):
    path = job_file(TRAY + "\n[damping]\nratio = 0.02\n")
    parts = [read_job(file) for file in split_job(SplitRequest(path, at=(0.6,), axis=(1, 0, 0)))[:-1]]
    assert [set(part.shells) for part in parts] == [{"floor"}, {"floor", "wall"}]
    assert [set(part.materials) for part in parts] == [{"steel"}, {"steel", "tin"}]
    assert [set(part.interfaces) for part in parts] == [{"hinge", "cut_1"}, {"top", "cut_1"}]
    assert [set(part.masses) for part in parts] == [{"bob"}, set()]
    whole, *reduced = (reduce_job(job) for job in (read_job(path), *parts))
    assert_allclose(sum(part.moments.m for part in reduced), whole.moments.m, rtol=1e-12)
    forces = [part.frame.axes @ part.load_case("blow").force for part in (whole, *reduced)]
    assert_allclose(forces[1] + forces[2], forces[0], rtol=0, atol=1e-9 * np.abs(forces[0]).max())
    assert all(la.eigvalsh(part.D)[0] > 0 for part in reduced)  # each part damps all of its strain


def test_cells_without_a_thickness_are_refused_as_in_python_unless_they_are_left_out(job_file):
    """The wall would vanish, and its mass with it."""
    begin = TRAY.index("[shells.wall]")
    without = TRAY[:begin] + TRAY[TRAY.index("[sections.rib]") :]
    with pytest.raises(
        FeModelsError, match=r"cells without a thickness: .*they are in the groups wall: give these one"
    ):
        reduce_job(read_job(job_file(without)))
    accepted = without.replace("[body]", '[body]\naccept = ["left-out"]', 1)
    assert set(shell_mesh(read_job(job_file(accepted))).cell_sets) == {"floor"}
