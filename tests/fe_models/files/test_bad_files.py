"""Every bad or ambiguous mesh file ends in one clear message, and nothing is printed."""

import warnings
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO

import h5py
import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from fe_models import read_mesh
from fe_models.errors import MeshError
from fe_models.files.read_deck import parse_deck
from fe_models.files.read_mesh import MESH_FORMATS, read_line_mesh
from tests.fe_models.small_meshes import faced_box, nastran_deck

TETRA = """*NODE
1, 0, 0, 0
2, 1, 0, 0
3, 0, 1, 0
4, 0, 0, 1
*ELEMENT, TYPE=C3D4
1, 1, 2, 3, 4
"""
BULK = """BEGIN BULK
GRID,1,,0.,0.,0.
GRID,2,,1.,0.,0.
GRID,3,,0.,1.,0.
GRID,4,,0.,0.,1.
CTETRA,1,1,1,2,3,4
ENDDATA
"""
MSH22 = """$MeshFormat
2.2 0 8
$EndMeshFormat
$Nodes
4
1 0 0 0
2 1 0 0
3 0 1 0
4 0 0 1
$EndNodes
$Elements
1
1 4 2 1 1 1 2 3 4
$EndElements
"""


def read_text(tmp_path, name, text):
    path = tmp_path / name
    path.write_text(text)
    return read_mesh(path)


def refusal(tmp_path, name, content, capsys=None):
    path = tmp_path / name
    if isinstance(content, bytes):
        path.write_bytes(content)
    else:
        path.write_text(content)
    with pytest.raises(MeshError) as caught:
        read_mesh(path)
    text = str(caught.value)
    assert text.startswith(f"mesh {path}")
    assert "\n" not in text
    if capsys is not None:
        printed = capsys.readouterr()
        assert printed.out + printed.err == ""
    return text


def written(path, mesh, **options):
    if path.suffix == ".msh":
        options = {"file_format": "gmsh", **options}
    with warnings.catch_warnings(), redirect_stdout(StringIO()), redirect_stderr(StringIO()):
        warnings.simplefilter("ignore")
        meshio.write(path, mesh, **options)
    return path.read_bytes()


def good_files(tmp_path):
    """Content of a good file by suffix."""
    mesh = faced_box("tetra10", (2, 2, 2))
    out = meshio.Mesh(mesh.nodes, list(mesh.cells.items()))
    files = {suffix: written(tmp_path / f"good{suffix}", out) for suffix in (".vtk", ".vtu", ".inp", ".med")}
    files[".msh"] = written(tmp_path / "good.msh", out, file_format="gmsh")
    files[".bdf"] = nastran_deck(mesh).encode()
    return files


# --- files as such -------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["rod.msh", "rod.step", "rod.odb"])
def test_a_missing_file_is_called_missing_whatever_its_suffix(tmp_path, name):
    with pytest.raises(MeshError, match="there is no such file"):
        read_mesh(tmp_path / name)


def test_missing_file_names_its_neighbours(tmp_path):
    (tmp_path / "rod.msh").write_text("")
    with pytest.raises(MeshError, match=r"there is no such file; did you mean 'rod.msh'\?"):
        read_mesh(tmp_path / "rud.msh")
    with pytest.raises(MeshError, match=r"the folder .*nowhere does not exist"):
        read_mesh(tmp_path / "nowhere" / "rod.msh")


def test_directory_is_refused(tmp_path):
    (tmp_path / "rod.msh").mkdir()
    with pytest.raises(MeshError, match="expected a file, got a folder"):
        read_mesh(tmp_path / "rod.msh")


def test_unknown_suffix_names_the_choices(tmp_path):
    assert "unknown suffix '.sldprt'; choices: .bdf," in refusal(tmp_path, "rod.sldprt", "anything")


def test_cad_files_are_refused_with_the_way_to_mesh_them(tmp_path):
    assert "this is a CAD geometry, which must be meshed" in refusal(tmp_path, "rod.stp", "ISO-10303-21;")


def test_unreadable_file_is_refused(tmp_path, monkeypatch):
    path = tmp_path / "rod.msh"
    path.write_text(MSH22)

    def deny(self, *_):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr("pathlib.Path.open", deny)
    with pytest.raises(MeshError, match="cannot be read: Permission denied"):
        read_mesh(path)


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_empty_file_is_refused(suffix, tmp_path, capsys):
    assert "the file is empty" in refusal(tmp_path, f"rod{suffix}", b" \n", capsys)


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_binary_garbage_is_refused(suffix, tmp_path, capsys):
    rng = np.random.default_rng(3)
    refusal(tmp_path, f"rod{suffix}", rng.integers(0, 256, 20_000, dtype=np.uint8).tobytes(), capsys)


@pytest.mark.parametrize("suffix", MESH_FORMATS)
def test_text_of_another_kind_is_refused(suffix, tmp_path, capsys):
    refusal(tmp_path, f"rod{suffix}", "The quick brown fox\njumps over 3 lazy dogs.\n", capsys)


@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".inp", ".msh", ".bdf", ".med"])
@pytest.mark.parametrize("part", [0.1, 0.4, 0.6, 0.9])
def test_truncated_file_is_refused(suffix, part, tmp_path, capsys):
    content = good_files(tmp_path)[suffix]
    end = int(part * len(content))
    if suffix == ".inp":  # cut inside a line of numbers, else a shorter deck is a good deck
        end = content.rindex(b",", 0, end)
    refusal(tmp_path, f"rod{suffix}", content[:end], capsys)


@pytest.mark.parametrize("version", ["gmsh22", "gmsh"])
@pytest.mark.parametrize("binary", [True, False])
def test_gmsh_file_truncated_anywhere_is_refused(version, binary, tmp_path, capsys):
    mesh = faced_box("tetra")
    content = written(
        tmp_path / "good.msh", meshio.Mesh(mesh.nodes, list(mesh.cells.items())), file_format=version, binary=binary
    )
    for end in np.linspace(1, content.rindex(b"$EndElements"), 40).astype(int):
        refusal(tmp_path, "rod.msh", content[:end], capsys)


@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".inp", ".msh", ".bdf", ".med"])
def test_damaged_file_is_read_or_refused_but_never_breaks(suffix, tmp_path, capsys):
    content = good_files(tmp_path)[suffix]
    capsys.readouterr()
    rng = np.random.default_rng(11)
    path = tmp_path / f"rod{suffix}"
    n_refused = 0
    for _ in range(60):
        damaged = bytearray(content)
        at = rng.integers(len(damaged))
        damaged[at : at + 8] = rng.integers(0, 256, 8, dtype=np.uint8).tobytes()
        path.write_bytes(bytes(damaged))
        try:
            read_mesh(path)
        except MeshError:
            n_refused += 1
    assert n_refused > 0
    printed = capsys.readouterr()
    assert printed.out + printed.err == ""


# --- content -------------------------------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", [np.nan, np.inf])
@pytest.mark.parametrize("suffix", [".vtk", ".vtu", ".msh", ".inp", ".med"])
def test_coordinate_that_is_no_number_is_refused(bad, suffix, tmp_path, capsys):
    mesh = faced_box("tetra")
    nodes = mesh.nodes.copy()
    nodes[5, 1] = bad
    content = written(tmp_path / f"good{suffix}", meshio.Mesh(nodes, list(mesh.cells.items())))
    text = refusal(tmp_path, f"rod{suffix}", content, capsys)
    assert "NaN or infinity at 1 of 12 nodes, first node" in text


def test_surface_mesh_is_refused(tmp_path, capsys):
    mesh = faced_box("tetra")
    content = written(tmp_path / "good.vtu", meshio.Mesh(mesh.nodes, [("triangle", mesh.faces["triangle"])]))
    assert "expected solid cells" in refusal(tmp_path, "skin.vtu", content, capsys)
    assert "20 triangle" in refusal(tmp_path, "skin.vtu", content, capsys)


def test_plane_mesh_is_refused(tmp_path):
    content = written(tmp_path / "good.med", meshio.Mesh(np.eye(3)[:, :2], [("triangle", [[0, 1, 2]])]))
    assert "got 2 coordinates per node" in refusal(tmp_path, "plane.med", content)


UNSUPPORTED = [
    ("pyramid14", 14, ".msh"),
    ("wedge15", 15, ".med"),
    ("wedge15", 15, ".vtk"),
    ("pyramid13", 13, ".inp"),
    ("pyramid13", 13, ".med"),
    ("pyramid13", 13, ".vtk"),
]


@pytest.mark.parametrize(("kind", "n_nodes", "suffix"), UNSUPPORTED)
def test_unsupported_cells_are_named_and_counted(kind, n_nodes, suffix, tmp_path, capsys):
    codes = {
        "pyramid14": (14, "", "", "", 0),
        "wedge15": (18, "C3D15", "CPENTA", "P15", 26),
        "pyramid13": (19, "C3D13", "CPYRAM", "P13", 27),
    }[kind]
    numbers = np.arange(1, n_nodes + 1)
    points = np.random.default_rng(0).random((n_nodes, 3))
    lines = [f"{k} {' '.join(map(str, p))}" for k, p in zip(numbers, points, strict=True)]
    row = " ".join(map(str, numbers))
    if suffix == ".msh":
        content = (
            f"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n{n_nodes}\n"
            + "\n".join(lines)
            + f"\n$EndNodes\n$Elements\n1\n1 {codes[0]} 2 1 1 {row}\n$EndElements\n"
        )
    elif suffix == ".inp":
        content = "*NODE\n" + "\n".join(line.replace(" ", ", ") for line in lines)
        content += f"\n*ELEMENT, TYPE={codes[1]}\n1, {row.replace(' ', ', ')}\n"
    elif suffix == ".bdf":
        cards = [f"GRID,{line.split()[0]},,{','.join(line.split()[1:])}" for line in lines]
        parts = ["CARD,1,1," + ",".join(map(str, numbers[:6]))]
        parts += ["+," + ",".join(map(str, numbers[k : k + 8])) for k in range(6, n_nodes, 8)]
        content = "\n".join(["BEGIN BULK", *cards, *parts, "ENDDATA", ""]).replace("CARD", codes[2])
    elif suffix == ".med":
        with h5py.File(tmp_path / "good.med", "w") as file:
            mesh = file.create_group("ENS_MAA/mesh")
            mesh.attrs["ESP"] = 3
            mesh["NOE/COO"] = points.ravel(order="F")
            mesh["NOE/COO"].attrs["NBR"] = n_nodes
            mesh[f"MAI/{codes[3]}/NOD"] = numbers
            mesh[f"MAI/{codes[3]}/NOD"].attrs["NBR"] = 1
        content = (tmp_path / "good.med").read_bytes()
    else:
        content = (
            f"# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS {n_nodes} double\n"
            + "\n".join(" ".join(map(str, p)) for p in points)
            + f"\nCELLS 1 {n_nodes + 1}\n{n_nodes} "
            + " ".join(map(str, numbers - 1))
            + f"\nCELL_TYPES 1\n{codes[4]}\n"
        )
    text = refusal(tmp_path, f"rod{suffix}", content, capsys)
    name = {".inp": codes[1], ".med": codes[3]}.get(suffix, kind)
    assert "unsupported cells" in text
    assert f"of type {name}" in text
    if suffix != ".vtk":  # meshio stops before it can count
        assert f"1 of type {name}" in text


def test_cell_on_a_node_that_is_not_there_is_refused(tmp_path):
    assert "tetra cell 1 names a node that is not in the file" in refusal(
        tmp_path, "rod.msh", MSH22.replace("1 2 3 4\n$End", "1 2 3 9\n$End")
    )
    assert "names a node" in refusal(tmp_path, "rod.inp", TETRA.replace("1, 1, 2, 3, 4", "1, 1, 2, 3, 9"))
    assert "CTETRA 1 names grid point 9, which is not defined" in refusal(
        tmp_path, "rod.bdf", BULK.replace("1,2,3,4\n", "1,2,3,9\n")
    )


def test_cell_listed_twice_is_refused(tmp_path):
    text = refusal(tmp_path, "rod.inp", TETRA + "2, 3, 1, 2, 4\n")
    assert "1 tetra cells are listed twice, first 1 and 2 on the same nodes" in text
    assert "would count double" in text


def test_numbers_defined_twice_are_refused(tmp_path):
    assert "1 node numbers are defined twice, first 4" in refusal(
        tmp_path, "rod.inp", TETRA.replace("*ELEMENT", "4, 0, 0, 2\n*ELEMENT")
    )
    assert "1 element numbers are defined twice, first 1" in refusal(tmp_path, "rod.inp", TETRA + "1, 2, 3, 4, 1\n")
    assert "GRID 1: is defined otherwise at" in refusal(
        tmp_path, "rod.bdf", BULK.replace("CTETRA", "GRID,1,,5.,0.,0.\nCTETRA")
    )
    assert "a node number is listed twice" in refusal(tmp_path, "rod.msh", MSH22.replace("4 0 0 1", "3 0 0 1"))


@pytest.mark.parametrize("kind", ["tetra10", "hexahedron20", "hexahedron27"])
def test_wrong_order_of_middle_nodes_is_refused(kind, tmp_path):
    mesh = faced_box(kind)
    cells = mesh.cells[kind].copy()
    cells[:, [-1, -2]] = cells[:, [-2, -1]]
    content = written(tmp_path / "good.vtu", meshio.Mesh(mesh.nodes, [(kind, cells)]))
    assert f"the middle nodes of {kind} cells are in another order" in refusal(tmp_path, "rod.vtu", content)


def test_curved_edges_are_no_wrong_order(tmp_path):
    mesh = faced_box("tetra10", (2, 2, 2))
    nodes = mesh.nodes + 0.05 * np.random.default_rng(5).standard_normal(mesh.nodes.shape)
    content = written(tmp_path / "rod.vtu", meshio.Mesh(nodes, list(mesh.cells.items())))
    assert content
    assert read_mesh(tmp_path / "rod.vtu").n_cells == 48


# --- Gmsh ----------------------------------------------------------------------------------------------------------


def test_cell_of_two_groups_in_gmsh_22_is_kept_once_in_both(tmp_path):
    text = MSH22.replace("$Nodes", '$PhysicalNames\n2\n3 1 "steel"\n3 2 "rod"\n$EndPhysicalNames\n$Nodes', 1)
    text = text.replace("1\n1 4 2 1 1 1 2 3 4", "2\n1 4 2 1 1 1 2 3 4\n2 4 2 2 1 1 2 3 4")
    mesh = read_text(tmp_path, "rod.msh", text)
    assert mesh.n_cells == 1
    assert_array_equal(mesh.cell_sets["steel"]["tetra"], [0])
    assert_array_equal(mesh.cell_sets["rod"]["tetra"], [0])
    assert "1 tetra cells were listed more than once" in mesh.notes[0]


def test_two_cells_on_the_same_nodes_in_another_order_are_refused_in_gmsh_22(tmp_path):
    text = MSH22.replace("1\n1 4 2 1 1 1 2 3 4", "2\n1 4 2 1 1 1 2 3 4\n2 4 2 2 1 1 3 2 4")
    assert "listed twice, first 1 and 2" in refusal(tmp_path, "rod.msh", text)


def test_groups_of_one_name_and_two_dimensions_and_cells_without_a_group(tmp_path):
    text = MSH22.replace("$Nodes", '$PhysicalNames\n2\n2 1 "end"\n3 1 "end"\n$EndPhysicalNames\n$Nodes', 1)
    text = text.replace("4\n1 0 0 0", "5\n9 0 0 -1\n1 0 0 0")
    text = text.replace(
        "1\n1 4 2 1 1 1 2 3 4", "4\n1 4 2 1 1 1 2 3 4\n2 4 2 0 1 1 3 2 9\n3 2 2 1 1 1 2 3\n4 15 2 6 1 9"
    )
    mesh = read_text(tmp_path, "rod.msh", text)
    assert_array_equal(mesh.cell_sets["end"]["tetra"], [0])
    assert mesh.n_cells == 2
    assert_array_equal(mesh.face_sets["end"]["triangle"], [0])
    assert_array_equal(mesh.node_sets["group_6"], [0])
    assert_array_equal(mesh.node_numbers, [9, 1, 2, 3, 4])


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("2.2 0 8", "1.0 0 8", "Gmsh format 1.0 is not supported"),
        ("2.2 0 8", "4.0 0 8", "gmsh -save -format msh41"),
        ("$EndElements\n", "$EndElements\n$PartitionedEntities\n$EndPartitionedEntities\n", "partitioned"),
        ("1 4 2 1 1 1 2 3 4", "1 44 2 1 1 1 2 3 4", "Gmsh type 44"),
        ("$Elements\n1\n", "$Elements\n7\n", "7 cells announced, 1 lines found"),
        ("3 0 1 0", "3 0 one 0", "expected numbers only"),
        (
            "$Nodes\n4",
            "$Nodes\nfour",
            "could not be read as MSH 2.2, 4.1 (Gmsh): it is damaged or of another kind (ValueError",
        ),
        ("$Elements\n1\n1 4 2 1 1 1 2 3 4\n$EndElements\n", "", "expected a section $Elements"),
        ("$EndNodes", "$EndNodes\n$Nodes\n0\n$EndNodes", "section $Nodes is there twice"),
    ],
)
def test_gmsh_files_that_cannot_be_read_truthfully(old, new, words, tmp_path, capsys):
    assert old in MSH22
    assert words in refusal(tmp_path, "rod.msh", MSH22.replace(old, new, 1), capsys)


# --- Abaqus --------------------------------------------------------------------------------------------------------


def test_abaqus_sets_are_joined_generated_nested_and_compared_without_case(tmp_path):
    mesh = read_text(
        tmp_path,
        "rod.inp",
        """*HEADING
** a comment
*NODE, NSET=Everything
1, 0, 0, 0
2, 1, 0, 0
** comment inside a block
3, 0, 1,
4, 0, 0, 1
*NODE
5, 0, 0, -1
*NSET, NSET=Tip
4
*NSET, NSET=TIP
5,
*NSET, NSET=odd, GENERATE
1, 5, 2
*NSET, NSET=both
tip, odd
*ELEMENT, TYPE=c3d4, ELSET=upper
1, 1, 2, 3, 4
** comment
*ELEMENT, TYPE=C3D4
2, 1, 3, 2, 5
*ELSET, ELSET=lower
2
*ELSET, ELSET=all
upper, LOWER
*NSET, NSET=of lower, ELSET=lower
*SURFACE, NAME=s
upper, S1
""",
    )
    assert mesh.n_cells == 2
    assert_array_equal(mesh.nodes[2], [0, 1, 0])
    sets = {name: list(nodes) for name, nodes in mesh.node_sets.items()}
    assert sets == {
        "Everything": [0, 1, 2, 3],
        "Tip": [3, 4],
        "odd": [0, 2, 4],
        "both": [0, 2, 3, 4],
        "of lower": [0, 1, 2, 4],
    }
    groups = {name: list(rows["tetra"]) for name, rows in mesh.cell_sets.items()}
    assert groups == {"upper": [0], "lower": [1], "all": [0, 1]}
    assert mesh.notes == ("1 blocks *SURFACE were left out",)


def test_abaqus_element_over_several_lines(tmp_path):
    mesh = faced_box("hexahedron20", (1, 1, 1))
    nodes = "\n".join(f"{k + 1}, {', '.join(repr(float(x)) for x in p)}" for k, p in enumerate(mesh.nodes))
    row = [str(n + 1) for n in mesh.cells["hexahedron20"][0]]
    element = "1, " + ", ".join(row[:15]) + ",\n" + ", ".join(row[15:])
    read = read_text(tmp_path, "rod.inp", f"*NODE\n{nodes}\n*ELEMENT,\nTYPE=C3D20R\n{element}\n")
    assert_array_equal(read.cells["hexahedron20"], mesh.cells["hexahedron20"])


def part_deck(instances):
    body = TETRA + "*NSET, NSET=inside\n1,\n"
    return f"*PART, NAME=p\n{body}*END PART\n*ASSEMBLY, NAME=a\n{instances}*END ASSEMBLY\n"


def test_abaqus_part_with_one_instance_reads_like_a_flat_deck(tmp_path):
    mesh = read_text(
        tmp_path,
        "rod.inp",
        part_deck(
            "*INSTANCE, NAME=p-1, PART=p\n*END INSTANCE\n*NODE\n1, 9, 9, 9\n*NSET, NSET=ref\n1,\n"
            "*NSET, NSET=tip, INSTANCE=P-1\n4,\n"
        ),
    )
    assert len(mesh.nodes) == 4
    assert {name: list(nodes) for name, nodes in mesh.node_sets.items()} == {"inside": [0], "tip": [3]}
    assert mesh.notes[0].startswith("2 blocks of nodes, elements or sets outside the part")


def test_a_set_outside_the_part_is_read_only_if_it_names_the_instance(tmp_path):
    deck = part_deck("*INSTANCE, NAME=p-1, PART=p\n*END INSTANCE\n")
    outside = "*NSET, NSET={}\n2,\n"
    text = outside.format("before") + deck + outside.format("tip, INSTANCE=p-1") + outside.format("other, INSTANCE=q")
    mesh = read_text(tmp_path, "rod.inp", text)
    assert {name: list(nodes) for name, nodes in mesh.node_sets.items()} == {"inside": [0], "tip": [1]}
    assert mesh.notes[0].startswith("2 blocks of nodes, elements or sets outside the part")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (part_deck("*INSTANCE, NAME=p-1, PART=p\n5., 0., 0.\n*END INSTANCE\n"), "the instance is moved"),
        (
            part_deck("*INSTANCE, NAME=a, PART=p\n*END INSTANCE\n*INSTANCE, NAME=b, PART=p\n*END INSTANCE\n"),
            "1 parts and 2 instances",
        ),
        (f"*PART, NAME=p\n{TETRA}*END PART\n*PART, NAME=P\n*END PART\n", "a second part has the name 'P'"),
        (TETRA + "*INCLUDE, INPUT=more.inp\n", "more.inp cannot be read: No such file"),
        (TETRA + "*ELEMENT, TYPE=C3D4, INPUT=more.inp\n", "*ELEMENT, INPUT=more.inp"),
        (TETRA + "*INCLUDE, INPUT=rod.inp\n", "includes itself"),
        (TETRA + "*INCLUDE\n", "*INCLUDE: expected INPUT=file"),
        ("*SYSTEM\n1,0,0\n" + TETRA, "*SYSTEM is not read"),
        (TETRA.replace("*NODE", "*NODE, SYSTEM=C"), "cylindrical or spherical"),
        (TETRA + "*NGEN\n1, 4, 1\n", "*NGEN is not read"),
        (TETRA + "*NCOPY\n1\n", "*NCOPY is not read"),
        (TETRA + "*ELGEN\n1\n", "*ELGEN is not read"),
        (TETRA.replace("TYPE=C3D4", "TYPE=C3D10"), "expected a multiple of 11 numbers below, got 5"),
        (TETRA.replace(", TYPE=C3D4", ""), "expected TYPE="),
        (TETRA.replace("2, 1, 0, 0", "2, one, 0, 0"), "expected number, x, y, z"),
        (TETRA + "*NSET, NSET=a\nb\n", "names an unknown set 'B'"),
        (TETRA + "*NSET, NSET=a\nb\n*NSET, NSET=b\na\n", "contains itself"),
        (TETRA + "*NSET, NSET=a, GENERATE\n1, 4, 0\n", "expected first, last, increment"),
        ("1, 0, 0, 0\n" + TETRA, "expected a keyword line"),
        ("*HEADING\nrod\n", "expected nodes (*NODE), got none"),
    ],
)
def test_abaqus_decks_that_cannot_be_read_truthfully(text, words, tmp_path, capsys):
    assert words in refusal(tmp_path, "rod.inp", text, capsys)


def test_abaqus_includes_are_put_in_and_sets_may_name_missing_nodes(tmp_path):
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "sets.inp").write_text("*NSET, NSET=a\n1, 99\n")
    (tmp_path / "more.inp").write_text("*INCLUDE, INPUT=parts/sets.inp\n*NSET, NSET=b\n2\n")
    (tmp_path / "nodes.txt").write_text("4, 0, 0, 1\n")
    text = TETRA.replace("4, 0, 0, 1\n", "*NODE, INPUT=nodes.txt\n") + "*INCLUDE, INPUT=more.inp\n*NSET, NSET=c\n3\n"
    mesh = read_text(tmp_path, "rod.inp", text)
    assert {name: list(nodes) for name, nodes in mesh.node_sets.items()} == {"a": [0], "b": [1], "c": [2]}
    assert mesh.notes == ("NSET 'a' names 1 nodes that are not in the deck, first 99: left out of it",)


def test_abaqus_middle_nodes_of_lines_stand_between_their_ends(tmp_path):
    path = tmp_path / "rod.inp"
    path.write_text("*NODE\n1, 0, 0, 0\n2, 1, 0, 0\n3, 2, 0, 0\n*ELEMENT, TYPE=B32R\n1, 1, 2, 3\n")
    assert_array_equal(read_line_mesh(path).lines, [[0, 1], [1, 2]])


# --- Nastran -------------------------------------------------------------------------------------------------------


def test_nastran_forms_of_numbers_cards_and_comments(tmp_path):
    mesh = read_text(
        tmp_path,
        "rod.nas",
        """$ no executive control: bulk data only
grid,1,0,0.,0.,0.   $ comment
GRID    2               1.+0    0.      0.
GRID*                  3                              0.             1.0
*                     0.
GRID,4,,,,1.-1
ctetra  10      2       1       2       3       4
CONM2,77,4,,3.5
""",
    )
    assert_array_equal(mesh.nodes, [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 0.1]])
    assert_array_equal(mesh.cell_sets["pid_2"]["tetra"], [0])
    assert_array_equal(mesh.cell_numbers["tetra"], [10])
    assert mesh.notes == ("1 CONM2 cards were left out",)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("GRID,2,,", "GRID,2,5,", "GRID: needs coordinate system 5, which is not defined"),
        ("GRID,1", "GRDSET,,5\nGRID,1", "GRID: needs coordinate system 5, which is not defined"),
        ("GRID,1,", "INCLUDE 'more.bdf'\nGRID,1,", "more.bdf cannot be read: No such file"),
        ("CTETRA,1,1,1,2,3,4", "CTETRA,1,1,1,2,3,4,5", "expected 4 or 10 nodes, got 5"),
        ("CTETRA,1,1,1,2,3,4", "CTETRA,1,1,1,2,3", "expected 4 or 10 nodes, got 3"),
        ("CTETRA,1", "CTETRX,1", "unknown solid element"),
        ("GRID,2,,1.,0.,0.", "GRID,2,,1.,x,0.", "field 5: expected a real number, got 'x'"),
        ("GRID,2", "GRID,two", "field 2: expected an integer, got 'two'"),
        ("GRID,1", "=,*1\nGRID,1", "expected a card before what is replicated"),
        ("BEGIN BULK\n", "BEGIN BULK\n+,1,2\n", "continuation without a card"),
        ("ENDDATA", "BEGIN SUPER=2\nENDDATA", "a deck of several superelements"),
        ("CTETRA,1,1,1,2,3,4", "CTETRA,1,1,1,2,3,4,,,+A\n+B,", "asks for the continuation 'A', but line 7 has 'B'"),
        ("GRID", "XRID", "expected grid points (GRID), got none"),
    ],
)
def test_nastran_decks_that_cannot_be_read_truthfully(old, new, words, tmp_path, capsys):
    assert old in BULK
    text = BULK.replace(old, new) if old == "GRID" else BULK.replace(old, new, 1)
    assert words in refusal(tmp_path, "rod.bdf", text, capsys)


def test_a_mesh_of_nastran_is_that_of_the_whole_deck_with_includes_and_coordinate_systems(tmp_path):
    """Positions by hand in a turned cylindrical system, and cells as the reader of whole decks has them."""
    (tmp_path / "parts").mkdir()
    (tmp_path / "parts" / "grids.blk").write_text(
        "BEGIN BULK\nGRID,4,,0.,0.,1.,77\nGRID,1,5,2.,90.,3.\nGRID,2,,1.\nGRID,3,,0.,1.\nENDDATA\n"
    )
    text = "BEGIN BULK\nCORD2C,5,,10.,0.,0.,10.,0.,1.\n,11.,0.,0.\nINCLUDE 'parts/grids.blk'\nCTETRA,8,6,1,2,3,4\n"
    path = tmp_path / "rod.bulk"
    path.write_text(text)
    mesh = read_mesh(path)
    assert list(mesh.node_numbers) == [4, 1, 2, 3]
    assert_allclose(mesh.nodes, [[0, 0, 1], [10, 2, 3], [1, 0, 0], [0, 1, 0]], rtol=0, atol=1e-15 * 10)
    assert mesh.notes == ("BEGIN BULK without ENDDATA at the end: is the file complete?",)
    path.write_text((text + "CORD2R,77\n,1.\nENDDATA\n").replace("CORD2R,77\n,1.", "CORD2R,77,,,,,,,1.\n,1.,,"))
    deck = parse_deck(path).mesh
    assert_array_equal(deck.nodes, read_mesh(path).nodes)
    assert_array_equal(deck.blocks[0].nodes, mesh.cells["tetra"])
    assert list(mesh.cell_sets["pid_6"]["tetra"]) == [0]


# --- VTK and MED ---------------------------------------------------------------------------------------------------


def test_vtu_of_two_pieces_is_refused(tmp_path, capsys):
    mesh = faced_box("tetra")
    content = written(tmp_path / "good.vtu", meshio.Mesh(mesh.nodes, list(mesh.cells.items())))
    piece = content[content.index(b"<Piece") : content.index(b"</UnstructuredGrid>")]
    doubled = content.replace(b"</UnstructuredGrid>", piece + b"</UnstructuredGrid>")
    assert "the file has 2 pieces; expected one" in refusal(tmp_path, "rod.vtu", doubled, capsys)


def test_vtk_cells_that_meshio_would_drop_are_refused(tmp_path, capsys):
    text = "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 8 double\n"
    text += "0 0 0 1 0 0 0 1 0 1 1 0 0 0 1 1 0 1 0 1 1 1 1 1\nCELLS 2 14\n8 0 1 2 3 4 5 6 7\n4 0 1 2 4\n"
    text += "CELL_TYPES 2\n11\n10\n"
    assert "unsupported cells;" in refusal(tmp_path, "rod.vtk", text, capsys)  # meshio does not say which
    mesh = faced_box("tetra")
    content = written(tmp_path / "good.vtu", meshio.Mesh(mesh.nodes, list(mesh.cells.items())), binary=False)
    at = content.index(b"types")
    other = content[:at] + content[at:].replace(b"10\n", b"11\n", 2)
    assert "unsupported cells of VTK type 11" in refusal(tmp_path, "rod.vtu", other, capsys)


def test_med_without_or_with_several_meshes_is_refused(tmp_path):
    with h5py.File(tmp_path / "a.med", "w") as file:
        file.create_group("ENS_MAA")
    assert "expected one mesh, got 0: none" in refusal(tmp_path, "b.med", (tmp_path / "a.med").read_bytes())
    with h5py.File(tmp_path / "a.med", "w") as file:
        file.create_group("ENS_MAA/rod")
        file.create_group("ENS_MAA/pin")
    assert "expected one mesh, got 2: pin, rod" in refusal(tmp_path, "b.med", (tmp_path / "a.med").read_bytes())
