"""What the readers say of good files; oracles: meshio where it is right, Gmsh as another program, decks by hand."""

import warnings
from hashlib import sha256

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models import read_mesh
from fe_models.checks.mesh_report import report_mesh
from fe_models.errors import MeshError
from fe_models.files.cad.gmsh_model import kept_sigpipe
from fe_models.meshes.cells.raw_mesh import mirrored_order
from tests.fe_models.small_meshes import SOLID_TYPES, cell_mesh, faced_box, nastran_deck

#: formats whose quadratic wedges and pyramids are not read
OF_MESHIO = [kind for kind in SOLID_TYPES if kind not in ("wedge15", "pyramid13")]
WITHOUT_HEX27 = tuple(kind for kind in SOLID_TYPES if kind != "hexahedron27")


def meshio_mesh(mesh, **data):
    return meshio.Mesh(mesh.nodes, [(kind, cells) for kind, cells in mesh.cells.items()], **data)


def write(path, mesh, **options):
    """Write by meshio without its chatter."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        meshio.write(path, mesh, **options)
    return path


@pytest.mark.parametrize("kind", OF_MESHIO)
@pytest.mark.parametrize(
    ("suffix", "options"),
    [
        (".vtk", {}),
        (".vtk", {"file_format": "vtk42"}),
        (".vtk", {"binary": False}),
        (".vtu", {}),
        (".vtu", {"binary": False}),
        (".msh", {"file_format": "gmsh"}),
        (".msh", {"file_format": "gmsh", "binary": False}),
        (".msh", {"file_format": "gmsh22"}),
        (".msh", {"file_format": "gmsh22", "binary": False}),
    ],
)
def test_reading_returns_what_meshio_wrote(kind, suffix, options, tmp_path):
    mesh = faced_box(kind)
    path = write(tmp_path / f"box{suffix}", meshio_mesh(mesh), **options)
    read = read_mesh(path)
    assert_array_equal(read.cells[kind], mesh.cells[kind])
    assert_allclose(read.nodes, mesh.nodes, rtol=1e-9, atol=0)


@pytest.mark.parametrize("kind", [kind for kind in WITHOUT_HEX27 if kind in OF_MESHIO and kind != "pyramid"])
def test_reading_returns_the_abaqus_deck_meshio_wrote(kind, tmp_path):
    mesh = faced_box(kind)
    sets = {"left": mesh.node_sets["left"]}
    path = write(tmp_path / "box.inp", meshio_mesh(mesh, point_sets=sets))
    read = read_mesh(path)
    assert_array_equal(read.cells[kind], mesh.cells[kind])
    assert_array_equal(read.nodes, mesh.nodes)
    assert_array_equal(read.node_sets["left"], mesh.node_sets["left"])


@pytest.mark.parametrize("kind", WITHOUT_HEX27)
@pytest.mark.parametrize("style", ["small", "large", "free"])
def test_reading_returns_the_nastran_deck(kind, style, tmp_path):
    mesh = faced_box(kind)
    path = tmp_path / "box.bdf"
    path.write_text(nastran_deck(mesh, style))
    read = read_mesh(path)
    assert_array_equal(read.cells[kind], mesh.cells[kind])
    assert_allclose(read.nodes, mesh.nodes, rtol=1e-6, atol=0)
    assert_array_equal(read.cell_sets["pid_7"][kind], np.arange(len(mesh.cells[kind])))
    assert_array_equal(read.cell_numbers[kind], np.arange(len(mesh.cells[kind])) + 1)


@pytest.mark.parametrize("kind", ["tetra", "hexahedron", "wedge"])
def test_reading_returns_the_nastran_deck_meshio_wrote(kind, tmp_path):
    mesh = faced_box(kind)  # meshio writes cards that Nastran does not know for quadratic cells
    read = read_mesh(write(tmp_path / "box.bdf", meshio_mesh(mesh), file_format="nastran"))
    assert_array_equal(read.cells[kind], mesh.cells[kind])
    assert_array_equal(read.nodes, mesh.nodes)


def test_numbers_behind_the_nodes_of_an_element_are_dropped_and_counted(tmp_path):
    """CalculiX reads the nodes of an element and drops what follows on the line; two of three elements have more."""
    points = np.vstack([np.zeros(3), np.eye(3), -np.eye(3)[2], [1.0, 1.0, 1.0]])
    text = "*NODE\n" + "".join(f"{k}, {x}, {y}, {z}\n" for k, (x, y, z) in enumerate(points, start=1))
    path = tmp_path / "more.inp"
    path.write_text(text + "*ELEMENT, TYPE=C3D4\n1, 1, 2, 3, 4, 7, 8\n2, 2, 1, 3, 5\n3, 2, 3, 4, 6, 9\n")
    mesh = read_mesh(path)
    assert_array_equal(mesh.cells["tetra"], [[0, 1, 2, 3], [1, 0, 2, 4], [1, 2, 3, 5]])
    assert any(note.startswith("2 tetra elements have more numbers on their line") for note in mesh.notes)


def test_digest_is_the_sha256_of_the_file(tmp_path):
    path = write(tmp_path / "box.vtu", meshio_mesh(faced_box("tetra")))
    assert read_mesh(path).digest == sha256(path.read_bytes()).hexdigest()
    assert read_mesh(path).source == str(path)


def test_whole_number_cell_data_become_groups_and_flags_of_points_node_sets(tmp_path):
    mesh = faced_box("hexahedron", (4, 1, 1))
    flags = np.zeros(len(mesh.nodes), np.int64)
    flags[mesh.node_sets["left"]] = 1
    data = {"material": [np.array([3, 3, 7, 7])], "weight": [np.array([0.5, 1, 1, 1])]}
    path = write(tmp_path / "box.vtu", meshio_mesh(mesh, cell_data=data, point_data={"held": flags}))
    read = read_mesh(path)
    assert set(read.cell_sets) == {"material_3", "material_7"}
    assert_array_equal(read.cell_sets["material_7"]["hexahedron"], [2, 3])
    assert_array_equal(read.node_sets["held"], mesh.node_sets["left"])


def test_linear_wedges_of_vtk_are_right_way_round_in_both_conventions(tmp_path):
    mesh = faced_box("wedge")
    path = write(tmp_path / "box.vtu", meshio_mesh(mesh))
    flipped = meshio.Mesh(mesh.nodes, [("wedge", mesh.cells["wedge"][:, mirrored_order("wedge")])])
    other = write(tmp_path / "other.vtu", flipped)
    for file in (path, other):
        assert_array_equal(read_mesh(file).cells["wedge"], mesh.cells["wedge"])


@pytest.mark.parametrize("kind", [kind for kind in WITHOUT_HEX27 if kind in OF_MESHIO])
def test_med_in_its_own_orientation_and_in_that_of_meshio(kind, tmp_path):
    mesh = faced_box(kind)
    path = write(tmp_path / "box.med", meshio_mesh(mesh))
    mirrored = meshio.Mesh(mesh.nodes, [(kind, mesh.cells[kind][:, mirrored_order(kind)])])
    other = write(tmp_path / "other.med", mirrored)
    for file in (path, other):
        assert_array_equal(read_mesh(file).cells[kind], mesh.cells[kind])


def test_med_families_become_groups(tmp_path):
    mesh = meshio_mesh(
        faced_box("hexahedron"),
        cell_data={"cell_tags": [np.array([-1, -2])]},
        point_data={"point_tags": np.array([3, 0, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0])},
    )
    mesh.cell_tags = {-1: ["steel", "all"], -2: ["all"]}
    mesh.point_tags = {3: ["pin"], 4: ["pin", "hole"]}
    read = read_mesh(write(tmp_path / "box.med", mesh))
    assert_array_equal(read.cell_sets["steel"]["hexahedron"], [0])
    assert_array_equal(read.cell_sets["all"]["hexahedron"], [0, 1])
    assert_array_equal(read.node_sets["pin"], [0, 8])
    assert_array_equal(read.node_sets["hole"], [8])


@pytest.mark.parametrize("kind", SOLID_TYPES)
def test_mirrored_order_turns_a_cell_inside_out_and_back(kind):
    order = mirrored_order(kind)
    assert_array_equal(order[order], np.arange(len(order)))
    nodes = cell_mesh(kind).nodes
    assert report_mesh(cell_mesh(kind, nodes[order])).volume < 0


REFUSED_FOR_HEX27 = {
    "inp": "unsupported cells: 8 of type C3D27",
    "med": "unsupported cells: 8 of type H27",
    "bdf": "the middle nodes of hexahedron20 cells are in another order",  # Gmsh writes CHEXA in its own order then
}


# --- meshes of Gmsh itself ---------------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["tetra", "tetra10", "hexahedron", "hexahedron20", "hexahedron27", "wedge"])
def gmsh_files(request, tmp_path_factory):
    """One box, 2 x 1 x 1.5, by Gmsh in all its formats; two groups of the volume, groups of one and two faces."""
    gmsh = pytest.importorskip("gmsh")
    kind = request.param
    folder = tmp_path_factory.mktemp(kind)
    with kept_sigpipe():
        gmsh.initialize(interruptible=False)
    try:
        gmsh.option.setNumber("General.Terminal", 0)
        gmsh.option.setNumber("Mesh.SecondOrderIncomplete", int(kind == "hexahedron20"))
        gmsh.option.setNumber("Mesh.MeshSizeMin", 1.0)
        occ, model = gmsh.model.occ, gmsh.model
        if kind == "wedge":
            base = occ.addRectangle(0, 0, 0, 2, 1)
            occ.extrude([(2, base)], 0, 0, 1.5, [2], recombine=True)
        else:
            occ.addBox(0, 0, 0, 2, 1, 1.5)
        occ.synchronize()
        if kind.startswith("hexahedron"):
            for _, curve in model.getEntities(1):
                model.mesh.setTransfiniteCurve(curve, 3)
            for _, surface in model.getEntities(2):
                model.mesh.setTransfiniteSurface(surface)
                model.mesh.setRecombine(2, surface)
            model.mesh.setTransfiniteVolume(1)
        model.addPhysicalGroup(3, [1], 7, name="solid")
        model.addPhysicalGroup(3, [1], 8, name="steel")
        model.addPhysicalGroup(2, [1], 3, name="one face")
        model.addPhysicalGroup(2, [1, 2], 4)
        model.addPhysicalGroup(0, [1], 5, name="corner")
        model.mesh.generate(3)
        model.mesh.setOrder(2 if kind in ("tetra10", "hexahedron20", "hexahedron27") else 1)
        for name, version, binary in (("41a", 4.1, 0), ("41b", 4.1, 1), ("22a", 2.2, 0), ("22b", 2.2, 1)):
            gmsh.option.setNumber("Mesh.MshFileVersion", version)
            gmsh.option.setNumber("Mesh.Binary", binary)
            gmsh.write(str(folder / f"{name}.msh"))
        gmsh.option.setNumber("Mesh.Binary", 0)
        for suffix in ("inp", "bdf", "vtk", "med"):
            gmsh.write(str(folder / f"box.{suffix}"))
    finally:
        gmsh.finalize()
    return kind, folder


@pytest.mark.parametrize(
    "name", ["41a.msh", "41b.msh", "22a.msh", "22b.msh", "box.inp", "box.bdf", "box.vtk", "box.med"]
)
def test_box_of_gmsh_has_its_volume_and_orientation_in_every_format(name, gmsh_files):
    kind, folder = gmsh_files
    if kind == "hexahedron27" and name.rpartition(".")[2] in REFUSED_FOR_HEX27:
        with pytest.raises(MeshError, match=REFUSED_FOR_HEX27[name.rpartition(".")[2]]):
            read_mesh(folder / name)
        return
    mesh = read_mesh(folder / name)
    report = report_mesh(mesh)
    assert list(mesh.cells) == [kind]
    assert_allclose(report.volume, 3, rtol=1e-9, atol=0)
    assert report.errors == ()
    assert_allclose([report.lo, report.hi], [[0, 0, 0], [2, 1, 1.5]], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", ["41a.msh", "41b.msh", "22a.msh", "22b.msh"])
def test_groups_of_gmsh_keep_names_dimensions_and_double_memberships(name, gmsh_files):
    kind, folder = gmsh_files
    mesh = read_mesh(folder / name)
    everything = np.arange(len(mesh.cells[kind]))
    assert set(mesh.cell_sets) == {"solid", "steel"}
    for group in ("solid", "steel"):
        assert_array_equal(mesh.cell_sets[group][kind], everything)
    assert set(mesh.face_sets) == {"one face", "group_4"}
    assert mesh.node_sets["corner"].size == 1


@pytest.mark.parametrize("gmsh_files", ["tetra10"], indirect=True)
def test_groups_of_med_keep_names_and_double_memberships(gmsh_files):
    mesh = read_mesh(gmsh_files[1] / "box.med")
    everything = np.arange(len(mesh.cells["tetra10"]))
    for group in ("solid", "steel"):
        assert_array_equal(mesh.cell_sets[group]["tetra10"], everything)
    assert "one face" in mesh.face_sets
    assert mesh.node_sets["corner"].size == 1
