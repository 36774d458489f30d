"""The user's numbers of nodes and elements: out of meshes and decks, and into files of other programs."""

from dataclasses import replace

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

import cms
import fe_models as fm
from cms.errors import BodyError
from cms.exchange.export import export_body
from cms.exchange.exporters.nodes import all_nodes
from cms.exchange.programs.nastran import read_nastran
from cms.jobs.body_of_job import job_body
from cms.jobs.decks.job_text import job_text
from cms.jobs.job import read_job
from fe_models.body.fe_body import Interface
from fe_models.elements.solids.body import solid_body
from fe_models.files.model_of_deck import DeckOptions
from fe_models.files.read_deck import parse_deck
from fe_models.files.read_mesh import read_mesh
from fe_models.foundation.units import unit_system
from tests.bodies import STEEL, box_mesh
from tests.cms.command import run_cms

PLAIN = box_mesh(3, 1, 1, 1.0, 0.1, 0.1)
CELLS = PLAIN.cells["hexahedron"]
NODE = np.random.default_rng(5).permutation(6 * len(PLAIN.nodes))[: len(PLAIN.nodes)] + 400
CELL = np.array([77, 31, 52])


def abaqus_text():
    nodes = [f"{n}, {x:.6f}, {y:.6f}, {z:.6f}" for n, (x, y, z) in zip(NODE, PLAIN.nodes, strict=True)]
    cells = [f"{e}, {', '.join(str(n) for n in NODE[row])}" for e, row in zip(CELL, CELLS, strict=True)]
    tip = ", ".join(str(n) for n in NODE[PLAIN.node_sets["right"]])
    return "\n".join(["*NODE", *nodes, "*ELEMENT, TYPE=C3D8, ELSET=all", *cells, "*NSET, NSET=HOTSPOT", tip, ""])


def nastran_text():
    lines = ["BEGIN BULK"]
    lines += [f"GRID,{n},,{x:.6f},{y:.6f},{z:.6f}" for n, (x, y, z) in zip(NODE, PLAIN.nodes, strict=True)]
    for e, row in zip(CELL, NODE[CELLS], strict=True):
        lines += [f"CHEXA,{e},1,{','.join(str(n) for n in row[:6])},+", f"+,{row[6]},{row[7]}"]
    return "\n".join([*lines, "ENDDATA", ""])


def gmsh_text():
    nodes = [f"{n} {x:.6f} {y:.6f} {z:.6f}" for n, (x, y, z) in zip(NODE, PLAIN.nodes, strict=True)]
    cells = [f"{e} 5 2 1 1 {' '.join(str(n) for n in NODE[row])}" for e, row in zip(CELL, CELLS, strict=True)]
    return "\n".join(["$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$Nodes", str(len(nodes)), *nodes, "$EndNodes",
                      "$Elements", str(len(cells)), *cells, "$EndElements", ""])  # fmt: skip


def file_of(folder, suffix):
    path = folder / f"bar{suffix}"
    if suffix == ".vtu":
        mesh = meshio.Mesh(PLAIN.nodes, [("hexahedron", CELLS)], {"node": NODE}, {"element": [CELL]})
        mesh.write(path)
    else:
        path.write_text({".inp": abaqus_text, ".bdf": nastran_text, ".msh": gmsh_text}[suffix]())
    return path


@pytest.mark.parametrize("suffix", [".inp", ".bdf", ".msh", ".vtu"])
def test_numbers_of_a_file_are_those_of_the_body_at_the_same_places(tmp_path, suffix):
    body = solid_body(read_mesh(file_of(tmp_path, suffix)), STEEL, name="bar", units=unit_system("m-kg-s"))
    for place, number in zip(PLAIN.nodes, NODE, strict=True):
        row = int(body.numbering.rows_of_node("test", int(number))[0])
        assert_allclose(body.nodes[row], place, atol=1e-6)
    for number, cell in zip(CELL, CELLS, strict=True):
        triangles = body.surface[body.numbering.triangles_of_element("test", int(number))]
        assert set(body.numbering.nodes[triangles].ravel()) <= set(NODE[cell].tolist())
    assert "element_77" not in body.numbering.set_names


def deck_job(folder, text):
    path = folder / "bar.inp"
    path.write_text(text)
    path.with_suffix(".toml").write_text(job_text(parse_deck(path), DeckOptions("m-kg-s", {}), path.name))
    return path.with_suffix(".toml")


MATERIAL = "*SOLID SECTION, ELSET=all, MATERIAL=STEEL\n*MATERIAL, NAME=STEEL\n*ELASTIC\n2.1e11, .3\n*DENSITY\n7850.\n"


def test_a_deck_keeps_numbers_and_sets_and_its_job_takes_them(tmp_path):
    job = deck_job(tmp_path, abaqus_text().replace("*NSET", "*NSET, NSET=one\n" + str(NODE[0]) + "\n*NSET")
                   + MATERIAL + "*BOUNDARY\none, 1, 3\n")  # fmt: skip
    text = job.read_text().replace("[body]", f'[body]\nkeep = ["HOTSPOT", {NODE[3]}]')
    job.write_text(text)
    body = job_body(read_job(job))
    places = sorted(body.nodes[body.kept].tolist())
    rows = [*PLAIN.node_sets["right"], 3]
    assert_allclose(places, sorted(PLAIN.nodes[sorted(set(rows))].tolist()), atol=1e-6)


TWO = """*PART, NAME=bar
{part}*SOLID SECTION, ELSET=all, MATERIAL=STEEL
*END PART
*ASSEMBLY, NAME=A
*INSTANCE, NAME=Bar-1, PART=bar
*END INSTANCE
*INSTANCE, NAME=Bar-2, PART=bar
0., 0., 5.
*END INSTANCE
*NODE
1, 0.5, 0.05, 2.5
*NSET, NSET=middle
1
*RIGID BODY, NSET=Bar-1.HOTSPOT, REF NODE=middle
*RIGID BODY, NSET=Bar-2.HOTSPOT, REF NODE=middle
*END ASSEMBLY
*MATERIAL, NAME=STEEL
*ELASTIC
2.1e11, .3
*DENSITY
7850.
"""


def test_nodes_of_instances_are_named_by_instance_and_number(tmp_path):
    body = job_body(read_job(deck_job(tmp_path, TWO.format(part=abaqus_text()))))
    number, place = int(NODE[4]), PLAIN.nodes[4]
    for k, instance in enumerate(("Bar-1", "Bar-2")):
        row = int(body.numbering.rows_of_node("test", f"{instance}.{number}")[0])
        assert_allclose(body.nodes[row], place + np.array([0, 0, 5 * k]), atol=1e-6)
        assert body.numbering.node_name(row) == f"{instance}.{number}"
        triangles = body.surface[body.numbering.triangles_of_element("test", f"{instance}.31")]
        assert_allclose(body.nodes[triangles][..., 2].min(), 5 * k, atol=1e-6)
    with pytest.raises(BodyError, match=rf"node {number} is there 2 times; name the instance: node = 'Bar-1"):
        body.numbering.rows_of_node("test", number)
    assert "Bar-2.HOTSPOT" in body.numbering.set_names


@pytest.fixture(scope="module")
def reduced():
    mesh = replace(PLAIN, node_numbers=NODE, cell_numbers={"hexahedron": CELL})
    ends = [Interface(name, "distributing", mesh.node_sets[name], np.array([x, 0.05, 0.05]))
            for name, x in (("left", 0.0), ("right", 1.0))]  # fmt: skip
    body = cms.couple(solid_body(mesh, STEEL, name="bar", units=unit_system("m-kg-s"), interfaces=ends))
    return cms.reduce(body, cms.craig_bampton(body, n_modes=2), keep=["top"])


def by_place(body):
    places = body.frame.origin + body.nodes @ body.frame.axes.T
    named = {int(n): x for n, x in zip(body.numbering.nodes, places, strict=True) if n >= 0}
    return {n: named[n] for n in sorted(set(named) & set(NODE.tolist()))}


@pytest.mark.parametrize(("form", "suffix"), [("mbdyn", ".fem"), ("sid_fem", ".SID_FEM"), ("mbsim", ".h5")])
def test_numbers_go_out_and_come_back(reduced, tmp_path, form, suffix):
    written = export_body(reduced, tmp_path / f"bar{suffix}", to=form, units="m-kg-s", nodes="all")
    assert any("numbers of nodes are those of the mesh" in note for note in written.notes)
    found = by_place(cms.exchange.import_body(written.files[0], units="m-kg-s", form=form))
    ours = by_place(reduced)
    assert list(found) == list(ours) == sorted(NODE.tolist())
    shift = found[int(NODE[0])] - ours[int(NODE[0])]  # files say nothing of the place of B in the mesh
    for number, place in ours.items():
        assert_allclose(found[number], place + shift, rtol=0, atol=1e-6)


def test_grids_of_a_superelement_are_nodes_of_the_mesh_and_kept_ones_turn(reduced, tmp_path):
    written = export_body(reduced, tmp_path / "bar.op4", to="nastran-op4", units="m-kg-s")
    found = read_nastran(written.files, "bar")
    places = dict(zip(found.node_numbers.tolist(), found.nodes, strict=True))
    for number, place in zip(NODE, PLAIN.nodes, strict=True):
        assert_allclose(places[int(number)], place, atol=1e-6)
    top = int(NODE[PLAIN.node_sets["top"][0]])
    rows = found.recovery.dofs
    assert found.recovery.matrix[(rows[:, 0] == top) & (rows[:, 1] >= 3)].any()


def test_paraview_sees_the_numbers(reduced, tmp_path):
    written = export_body(reduced, tmp_path / "bar.pvd", to="vtk", units="m-kg-s")
    grid = meshio.read(written.files[1])
    assert_array_equal(grid.point_data["node"], reduced.numbering.nodes)
    assert_array_equal(grid.cell_data["element"][0], reduced.numbering.elements)


def test_numbers_that_are_not_unique_are_not_used_and_said(reduced):
    twice = replace(
        reduced.numbering, nodes=np.where(reduced.numbering.nodes == NODE[0], NODE[1], reduced.numbering.nodes)
    )
    nodes = all_nodes(replace(reduced, numbering=twice))
    assert_array_equal(nodes.numbers, np.arange(1, len(nodes.numbers) + 1))
    assert "nodes are numbered 1, 2, ..." in nodes.notes()[0]


def test_info_tells_numbers_sets_and_nodes_that_turn(reduced, tmp_path):
    cms.write(reduced, tmp_path / "bar.h5")
    shown = run_cms("info", tmp_path / "bar.h5").output
    assert f"{len(NODE)}, from {NODE.min()} to {NODE.max()}" in shown
    assert "3, from 31 to 77" in shown
    assert "8 by elements" in shown
    assert "Sets of the mesh" in shown


def test_abaqus_and_exudyn_files_name_the_nodes_of_the_mesh(tmp_path):
    """Boundary nodes that are nodes of the mesh in the deck, all kept nodes in the archive; a script finds them."""
    mesh = replace(fm.beams.straight_line((0, 0, 0), (1, 0, 0), 3), node_numbers=1000 + 10 * np.arange(4))
    ends = [fm.beams.line_interface(mesh, name, fm.beams.NodeIndices((k,))) for name, k in (("root", 0), ("tip", 3))]
    body = fm.beam_body(
        mesh,
        fm.beams.BeamProperty(fm.beams.Circle(0.02), STEEL),
        name="rod",
        units=unit_system("m-kg-s"),
        interfaces=ends,
    )
    body = cms.couple(body)
    reduced = cms.reduce(body, cms.craig_bampton(body, n_modes=2))
    deck = tmp_path / "rod.inp"
    exported = export_body(reduced, deck, to="abaqus", units="m-kg-s")
    text = deck.read_text()
    assert "** interface root: node 1, 1000 of the mesh" in text
    assert "** interface tip: node 2, 1030 of the mesh" in text
    assert any("1030 of the mesh" in note for note in exported.notes)
    export_body(reduced, tmp_path / "rod.npz", to="exudyn", units="m-kg-s")
    with np.load(tmp_path / "rod.npz", allow_pickle=True) as archive:
        numbers, places = archive["floatframe_node_numbers"], archive["xRef"].reshape(-1, 3)
    assert_array_equal(numbers, reduced.numbering.nodes)
    (row,) = np.flatnonzero(numbers == 1020)[:1]
    x = reduced.frame.origin + reduced.frame.axes @ places[row]
    assert_allclose(x[0], 2 / 3, rtol=1e-9)
    script = (tmp_path / "rod.py").read_text()
    found: dict = {"np": np, "ARCHIVE": str(tmp_path / "rod.npz")}
    exec(script[script.index("def mesh_node") : script.index("def main")], found)
    assert found["mesh_node"](1020) == row
    with pytest.raises(ValueError, match="no node 7"):
        found["mesh_node"](7)
