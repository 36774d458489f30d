import numpy as np
import pytest
from numpy.testing import assert_allclose

from cms.cli.split import SplitRequest, split_job
from cms.errors import BodyError, JobError, ModeSetError
from cms.jobs.body_of_job import job_body
from cms.jobs.job import read_job
from cms.pipeline import reduce_job
from fe_models.assembly.tables.beams import SHAPE_KEYS
from fe_models.elements.beams.sections import SECTIONS

ROD = """
[body]
nodes = "nodes.csv"
lines = "lines.csv"
units = "m-kg-s"

[materials.steel]
young = 210e9
poisson = 0.3
density = 7850

[sections.rod]
shape = "tube"
radius = 0.02
thickness = 0.003
lines = "rod"

[masses.bob]
node = "tip"
mass = 2.0
inertia = [0.01, 0.02, 0.03]
offset = [0, 0, 0.1]

[springs.bearing]
nodes = ["pivot", "housing"]
stiffness = [1e6, 1e6, 1e6, 1e3, 1e3, 1e3]
damping = [10, 10, 10, 1, 1, 1]

[links.block]
node = "housing"
followers = "block"

[masses.block]
node = "block"
mass = 1.0
inertia = 0.1

[interfaces.pivot]
kind = "rigid"
nodes = "housing"

[interfaces.tip]
kind = "nodes"
nodes = "tip"

[load_cases.weight]
kind = "gravity"
acceleration = [0, 0, -9.81]

[load_cases.push]
kind = "force"
nodes = "tip"
force = [0, 0, 1]

[reduction]
n_modes = 4
frame = "nodal"
at = "pivot"
"""
N = 6


@pytest.fixture
def job_file(tmp_path):
    names = {0: "pivot", N: "tip", N + 1: "housing", N + 2: "block"}
    rows = [(i, i / N, 0) for i in range(N + 1)] + [(N + 1, 0, 0), (N + 2, 0, 0.2)]
    nodes = "".join(f"{i},{x},0,{z},{names.get(i, '')}\n" for i, x, z in rows)
    (tmp_path / "nodes.csv").write_text("node,x,y,z,sets\n" + nodes)
    (tmp_path / "lines.csv").write_text("node1,node2,group\n" + "".join(f"{i},{i + 1},rod\n" for i in range(N)))

    def write(text):
        (tmp_path / "rod.toml").write_text(text)
        return tmp_path / "rod.toml"

    return write


def test_a_job_of_beams_makes_the_body_of_its_tables(job_file):
    reports = []
    reduced = reduce_job(read_job(job_file(ROD)), on_report=reports.append)
    m = 7850 * np.pi * (0.02**2 - 0.017**2)
    assert_allclose(reduced.moments.m, m + 3.0, rtol=1e-12)
    assert reduced.moments.is_exact
    assert_allclose(reduced.moments.S, [m / 2 + 2.0, 0, 2.0 * 0.1 + 1.0 * 0.2], rtol=0, atol=1e-12)
    assert np.abs(reduced.D).max() > 0
    assert dict(reports[0].rows())["connected parts"] == "1"
    assert [case.name for case in reduced.load_cases] == ["weight", "push"]
    assert len(reduced.surface) > 0


def test_a_mass_sits_at_the_node_of_its_number(job_file):
    """Numbers are those of the file, in any order and with gaps."""
    path = job_file(ROD)
    for table, n in (("nodes", 1), ("lines", 2)):
        head, *rows = path.with_name(f"{table}.csv").read_text().splitlines()
        parts = [row.split(",", n) for row in rows]
        rows = [",".join([*(str(100 - 7 * int(x)) for x in part[:n]), part[n]]) for part in parts]
        path.with_name(f"{table}.csv").write_text("\n".join([head, *rows]) + "\n")
    by_name = job_body(read_job(path)).M
    by_number = job_body(read_job(job_file(ROD.replace('node = "tip"', f"node = {100 - 7 * N}", 1)))).M
    assert abs(by_number - by_name).max() == 0
    with pytest.raises(BodyError, match=r"masses\.bob\.node = 6: in the mesh 0 nodes have this number"):
        job_body(read_job(job_file(ROD.replace('node = "tip"', "node = 6", 1))))


def test_a_job_keeps_the_stress_of_its_beams_each_by_itself(job_file):
    text = ROD.replace('units = "m-kg-s"', 'units = "m-kg-s"\nstress_points = ["rod"]')
    reduced = reduce_job(read_job(job_file(text)))
    points = reduced.point_stress
    assert len(points.names) == N * 2 * 32  # inner and outer side of the wall, 16 points each
    assert "warping" in reduced.provenance["stress points"]
    radius = np.linalg.norm((points.positions @ reduced.frame.axes.T + reduced.frame.origin)[:, 1:], axis=1)
    assert_allclose(np.unique(radius.round(9)), [0.017, 0.02], rtol=1e-9)
    refused = text.replace("n_modes = 4", "n_modes = 4\nstress = false")
    with pytest.raises(JobError, match="no stress is kept"):
        reduce_job(read_job(job_file(refused)))
    with pytest.raises(JobError, match='expected "all", or a list of numbers'):
        read_job(job_file(text.replace('["rod"]', "[[1, 2]]")))


def test_a_planar_job_has_three_dofs_a_node(job_file):
    body = job_body(read_job(job_file(ROD.replace('units = "m-kg-s"', 'units = "m-kg-s"\nplane = "zx"'))))
    assert set(body.dofs[body.dofs[:, 0] == 3, 1].tolist()) == {0, 2, 4}


MIXED = """
[body]
mesh = "mixed.vtk"
units = "m-kg-s"

[materials.steel]
young = 210e9
poisson = 0.3
density = 7850

[sections.bar]
shape = "rectangle"
width = 0.05
height = 0.07
lines = "all"

[ties.root]
kind = "rigid"
node = "root"
nodes = "right"

[interfaces.foot]
kind = "rigid"
on = "solid"
plane = {point = [0, 0, 0], normal = [1, 0, 0]}

[interfaces.tip]
kind = "rigid"
on = "lines"
nearest = {point = [1, 0.025, 0.035]}

[reduction]
n_modes = 4
frame = "nodal"
at = "foot"
"""

MSH = """$MeshFormat
2.2 0 8
$EndMeshFormat
$PhysicalNames
4
0 1 "root"
1 2 "arm"
2 3 "right"
3 4 "block"
$EndPhysicalNames
"""


def written_mixed_mesh(path):
    """A block of linear bricks from x = 0 to 0.2 and a line from there to x = 1, in one Gmsh file."""
    from tests.bodies import box_mesh

    mesh = box_mesh(12, 3, 2, 0.2, 0.05, 0.07)
    x = np.linspace(0.2, 1.0, 9)
    nodes = np.vstack([mesh.nodes, np.stack([x, np.full(9, 0.025), np.full(9, 0.035)], axis=1)])
    first = len(mesh.nodes) + 1
    cells = [f"5 2 4 1 {' '.join(str(n + 1) for n in row)}" for row in mesh.cells["hexahedron"]]
    cells += [f"1 2 2 1 {first + k} {first + k + 1}" for k in range(8)] + [f"15 2 1 1 {first}"]
    from fe_models.meshes.boundary import boundary_facets

    for row in boundary_facets(mesh)["quad"]:
        if (np.abs(mesh.nodes[row, 0] - 0.2) < 1e-9).all():
            cells.append(f"3 2 3 1 {' '.join(str(n + 1) for n in row)}")
    points = "".join(f"{k} {a!r} {b!r} {c!r}\n" for k, (a, b, c) in enumerate(nodes.tolist(), start=1))
    text = "".join(f"{k} {cell}\n" for k, cell in enumerate(cells, start=1))
    path.write_text(f"{MSH}$Nodes\n{len(nodes)}\n{points}$EndNodes\n$Elements\n{len(cells)}\n{text}$EndElements\n")


@pytest.mark.parametrize("kind", ["rigid", "distributing"])
def test_a_job_ties_beams_to_a_solid_of_the_same_file(tmp_path, kind):
    written_mixed_mesh(tmp_path / "mixed.msh")
    text = MIXED.replace("mixed.vtk", "mixed.msh").replace('nodes = "right"', 'faces = "right"')
    (tmp_path / "mixed.toml").write_text(text.replace('kind = "rigid"\nnode', f'kind = "{kind}"\nnode'))
    reduced = reduce_job(read_job(tmp_path / "mixed.toml"))
    m = 7850 * 0.05 * 0.07
    assert_allclose(reduced.moments.m, m, rtol=1e-9)
    assert_allclose(reduced.moments.S[0], m / 2, rtol=1e-9)
    inertia = 0.07 * 0.05**3 / 12
    first = (
        1.8751**2 / (2 * np.pi) * np.sqrt(210e9 * inertia / m)
    )  # a slender cantilever; the bricks are a little stiff
    assert_allclose(reduced.frequencies[0], first, rtol=0.05)
    assert [interface.name for interface in reduced.interfaces] == ["foot", "tip"]
    assert_allclose(reduced.interface("tip").position[0], 1.0, rtol=1e-12)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('shape = "tube"', 'shape = "tub"', "unknown shape; did you mean 'tube'"),
        ("thickness = 0.003", "web = 0.003", "shape 'tube' has no key web"),
        ("thickness = 0.003", "", "shape 'tube' needs radius, thickness; missing: thickness"),
        ("radius = 0.02", "radius = 0", "sections.rod.radius = 0: expected a number above 0"),
        ("thickness = 0.003", "thickness = 0.003\noffset = [1]", "sections.rod.offset = [1]: expected a list of 2"),
        (
            "thickness = 0.003",
            'thickness = 0.003\nmaterial = "steal"',
            "there is no such material; did you mean 'steel'",
        ),
        ("[sections.rod]", "[section.rod]", "unknown key"),
        ('lines = "lines.csv"', "", "lines: missing; tables of nodes and lines come together"),
        ("stiffness = [1e6, 1e6, 1e6, 1e3, 1e3, 1e3]", "stiffness = [1]", "expected a list of 6 numbers"),
        ("inertia = [0.01, 0.02, 0.03]", "inertia = [1, 2]", "expected one number, three principal values"),
        ('kind = "rigid"', 'kind = "rigid"\non = "lines"', "only where beams are tied to a solid"),
        ("[masses.block]", "[ties.t]\nnode = 'tip'\nkind='rigid'\nfaces='f'\n[masses.block]", "ties: belong to a mesh"),
        (
            "[masses.block]",
            "[ties.t]\nnode = 'tip'\nkind='rigid'\n[masses.block]",
            "either faces or nodes of the solid",
        ),
        ("[masses.block]", "[sections.b]\nshape='circle'\nradius=1\n[masses.block]", 'lines = "all", but there are 2'),
        ('at = "pivot"', 'at = "pivo"', "there is no such interface; did you mean 'pivot'"),
        ('units = "m-kg-s"', 'units = "m-kg-s"\nplane = "yx"', "unknown plane"),
    ],
)
def test_a_bad_job_of_beams_is_refused(job_file, old, new, words):
    assert old in ROD
    with pytest.raises(JobError) as caught:
        read_job(job_file(ROD.replace(old, new, 1)))
    assert words in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        (
            'node = "tip"',
            'node = "top"',
            'masses.bob.node = "top": the mesh has no such group of nodes; did you mean',
        ),
        ('node = "tip"', 'node = "rod"', "expected a group of one node, got 7"),
        ('nodes = ["pivot", "housing"]', 'nodes = ["pivot", "tip"]', "2 parts that no line, link or spring joins"),
        ("density = 7850", "density = 7.85e-9", "density of 'steel'"),
    ],
)
def test_a_job_that_does_not_fit_its_tables_is_refused(job_file, old, new, words):
    from fe_models.errors import FeModelsError

    with pytest.raises((JobError, FeModelsError)) as caught:
        reduce_job(read_job(job_file(ROD.replace(old, new, 1))))
    assert words in str(caught.value)


def test_beams_need_sections_and_attachments_need_beams(job_file, tmp_path):
    (tmp_path / "a.msh").touch()
    solid = ROD[ROD.index("[materials") : ROD.index("[sections")]
    head = '[body]\nmesh = "a.msh"\nunits = "m-kg-s"\n'
    tail = "[reduction]\nn_modes = 1\n"
    with pytest.raises(JobError, match="masses: belong to beams"):
        read_job(job_file(head + solid + "[masses.m]\nnode = 'a'\nmass = 1\n" + tail))
    with pytest.raises(JobError, match="sections: missing; lines need"):
        read_job(job_file(head.replace('mesh = "a.msh"', 'nodes = "nodes.csv"\nlines = "lines.csv"') + solid + tail))
    with pytest.raises(JobError, match=r"body\.plane: belongs to beams alone"):
        read_job(job_file(head + 'plane = "xy"\n' + solid + tail))


def test_shapes_of_the_job_are_those_of_the_library():
    assert set(SHAPE_KEYS) == set(SECTIONS)


def test_a_short_part_is_reduced_with_the_modes_it_can_have_and_says_so(tmp_path, caplog):
    """A rod of four elements in two parts: one node inside each, six modes where twelve are asked for."""
    (tmp_path / "nodes.csv").write_text("node,x,y,z,sets\n1,0,0,0,pivot\n2,1,0,0,tip\n")
    (tmp_path / "lines.csv").write_text("node1,node2,group,elements\n1,2,rod,4\n")
    text = (
        ROD[: ROD.index("[masses.bob]")]
        + """
[interfaces.pivot]
kind = "rigid"
nodes = "pivot"

[interfaces.tip]
kind = "rigid"
nodes = "tip"

[reduction]
n_modes = 12
"""
    )
    (tmp_path / "rod.toml").write_text(text)
    files = split_job(SplitRequest(tmp_path / "rod.toml", 2, None, None, "rigid", None))
    for number, path in enumerate(files[:2], start=1):
        caplog.clear()
        reduced = reduce_job(read_job(path))
        assert len(reduced.K) == 12 + 6 - 6
        assert f"part {number} of the body: n_modes = 12, but it has 6 interior dofs" in caplog.text
    (tmp_path / "rod.toml").write_text(text.replace("n_modes = 12", "n_modes = 99"))
    with pytest.raises(ModeSetError, match="n_modes = 99, but body 'rod' has 18 interior dofs"):  # no part: refused
        reduce_job(read_job(tmp_path / "rod.toml"))


def test_masses_on_a_solid_are_pointed_to_what_works(tmp_path):
    (tmp_path / "a.msh").write_text("")
    text = ROD.replace('nodes = "nodes.csv"\nlines = "lines.csv"', 'mesh = "a.msh"')
    text = text[: text.index("[sections.rod]")] + text[text.index("[masses.bob]") : text.index("[springs.bearing]")]
    (tmp_path / "a.toml").write_text(text + "[reduction]\nn_modes = 2\n")
    with pytest.raises(JobError, match=r"masses: .*sits at an interface: .*\[\[bodies\.NAME\.masses\]\] \(with_masses"):
        read_job(tmp_path / "a.toml")
