"""Pyramids beside bricks, and whole polynomials in them; what every solid cell has to do is tested with the others."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from fe_models import solid_body, unit_system
from fe_models.checks.mesh_report import report_mesh
from fe_models.files.read_deck import parse_deck
from fe_models.files.read_mesh import read_mesh
from fe_models.meshes.boundary import boundary_nodes
from fe_models.meshes.mesh import Mesh
from tests.bodies import STEEL, box_mesh

BRICKS = {"pyramid": "hexahedron", "pyramid13": "hexahedron20"}


def body_of(mesh):
    return solid_body(mesh, STEEL, name="b", units=unit_system("m-kg-s"))


def mixed(kind):
    """A box of 3 x 2 x 2 bricks, those of the right half cut into pyramids; its nodes moved a little."""
    size = (3, 2, 2, 1.5, 1.1, 0.9)
    parts = [box_mesh(*size, BRICKS[kind]), box_mesh(*size, kind)]
    cells = [
        {each: rows[part.cell_sets[half][each]] for each, rows in part.cells.items()}
        for part, half in zip(parts, ("left half", "right half"), strict=True)
    ]
    points = np.concatenate([part.nodes for part in parts])
    nodes, place = np.unique(np.round(points, 9), axis=0, return_inverse=True)
    place = place.ravel()
    joined = {BRICKS[kind]: place[cells[0][BRICKS[kind]]], kind: place[cells[1][kind] + len(parts[0].nodes)]}
    used, rows = np.unique(np.concatenate([each.ravel() for each in joined.values()]), return_inverse=True)
    ends = np.cumsum([each.size for each in joined.values()])[:-1]
    cells = {k: part.reshape(joined[k].shape) for k, part in zip(joined, np.split(rows.ravel(), ends), strict=True)}
    x = nodes[used]
    bend = 0.03 * np.column_stack([np.sin(3 * x[:, 1]), np.cos(4 * x[:, 2]), x[:, 0] ** 2])
    return Mesh(x + bend, cells)


@pytest.mark.parametrize("kind", BRICKS)
def test_a_constant_strain_passes_from_bricks_to_pyramids(kind):
    mesh = mixed(kind)
    body = body_of(mesh)
    F = np.random.default_rng(2).normal(size=(3, 3))
    f = (body.K @ (mesh.nodes @ F.T).ravel()).reshape(-1, 3)
    inner = np.setdiff1d(np.arange(len(mesh.nodes)), boundary_nodes(mesh))
    assert len(inner) > 4
    assert_allclose(f[inner], 0, rtol=0, atol=1e-11 * np.abs(f).max())
    assert_allclose(f.sum(axis=0), 0, rtol=0, atol=1e-11 * np.abs(f).max())
    lam = np.linalg.eigvalsh(body.K.toarray())
    assert (lam[:6] < 1e-10 * lam[-1]).all()
    assert lam[6] > 1e-7 * lam[-1]


def test_quadratic_pyramids_bend_without_error():
    """u = (x y, -x²/2, 0) - nu-free: strain xx = y alone; energy of lam, 2 mu: (lam + 2 mu)/2 ∫ y²."""
    mesh = box_mesh(2, 1, 1, 2.0, 0.4, 0.3, "pyramid13")
    x, y, _ = mesh.nodes.T
    u = np.column_stack([x * y, -(x**2) / 2, 0 * x]).ravel()
    exact = (STEEL.lam + 2 * STEEL.mu) * 2.0 * 0.3 * 0.4**3 / 3
    assert_allclose(u @ body_of(mesh).K @ u, exact, rtol=1e-12)
    linear = box_mesh(2, 1, 1, 2.0, 0.4, 0.3, "pyramid")
    x, y, _ = linear.nodes.T
    u = np.column_stack([x * y, -(x**2) / 2, 0 * x]).ravel()
    assert u @ body_of(linear).K @ u > 1.5 * exact


def test_pyramids_are_judged_as_cells_of_first_order():
    report = report_mesh(box_mesh(8, 1, 1, 1.0, 0.1, 0.1, "pyramid"), STEEL)
    assert any("pyramid13" in finding.text for finding in report.findings)


DECKS = {
    "box.bdf": "GRID,1,,0.,0.,0.\nGRID,2,,2.,0.,0.\nGRID,3,,2.,1.,0.\nGRID,4,,0.,1.,0.\nGRID,5,,1.,.5,3.\n"
    "PSOLID,1,1\nMAT1,1,200.,,.3,1.\nCPYRAM,7,1,1,2,3,4,5\n",
    "box.inp": "*NODE\n1,0,0,0\n2,2,0,0\n3,2,1,0\n4,0,1,0\n5,1,.5,3\n*ELEMENT, TYPE=C3D5, ELSET=a\n7,1,2,3,4,5\n"
    "*MATERIAL, NAME=M\n*ELASTIC\n200,.3\n*SOLID SECTION, ELSET=a, MATERIAL=M\n",
    "box.cdb": "ET,1,185\nNBLOCK,6,SOLID,5,5\n(3i9,6e21.13e3)\n"
    + "".join(
        f"{k:9d}{0:9d}{0:9d}" + "".join(f"{v:21.13E}" for v in x) + "\n"
        for k, x in enumerate([(0, 0, 0), (2, 0, 0), (2, 1, 0), (0, 1, 0), (1, 0.5, 3)], start=1)
    )
    + "N,R5.3,LOC,-1\nEBLOCK,19,SOLID,1,1\n(19i9)\n"
    + "".join(f"{v:9d}" for v in (1, 1, 1, 1, 0, 0, 0, 0, 8, 0, 7, 1, 2, 3, 4, 5, 5, 5, 5))
    + "\n       -1\nMPDATA,R5.0,1,EX,1,1,200.\nMPDATA,R5.0,1,NUXY,1,1,.3\nMPDATA,R5.0,1,DENS,1,1,1.\n",
}


@pytest.mark.parametrize("name", DECKS)
def test_pyramids_of_meshes_and_whole_decks(tmp_path, name):
    path = tmp_path / name
    path.write_text(DECKS[name])
    if not name.endswith(".cdb"):  # whole decks only
        mesh = read_mesh(path)
        assert list(mesh.cells) == ["pyramid"]
        assert_allclose(report_mesh(mesh).volume, 2.0, rtol=1e-12)
    deck = parse_deck(path, program="abaqus") if name.endswith(".inp") else parse_deck(path)
    deck.ledger.require_whole()
    (block,) = deck.mesh.blocks
    assert_allclose(report_mesh(Mesh(deck.mesh.nodes, {block.kind: block.nodes})).volume, 2.0, rtol=1e-12)
    assert len(deck.solids) == 1
    if name.endswith(".inp"):  # CalculiX has no pyramids
        assert ("C3D5", "1", "this element is not known here") in parse_deck(path).ledger.rows()
