"""Tiny meshes as data: a box with face groups in every cell type, two bodies in one mesh, single cells."""

from dataclasses import replace

import numpy as np

from fe_models.meshes.boundary import boundary_facets
from fe_models.meshes.cell_shapes import CELL_SHAPES
from fe_models.meshes.mesh import SOLID_TYPES, Mesh
from tests.bodies import box_mesh

__all__ = ["SOLID_TYPES", "cell_mesh", "faced_box", "joined", "nastran_deck"]


def faced_box(kind, counts=(2, 1, 1), size=(2.0, 1.0, 1.5)):
    """A box from the origin with all boundary facets as faces; face groups `left face` and `right face` by x."""
    mesh = box_mesh(*counts, *size, kind)
    faces, sets = {}, {"left face": {}, "right face": {}}
    for face_kind, rows in boundary_facets(mesh).items():
        faces[face_kind] = rows
        for name, x in (("left face", 0.0), ("right face", size[0])):
            at = np.flatnonzero(np.abs(mesh.nodes[rows][:, :, 0] - x).max(axis=1) < 1e-12)
            if at.size:
                sets[name][face_kind] = at
    return replace(mesh, faces=faces, face_sets=sets)


def cell_mesh(kind, nodes=None):
    """One cell, the reference cell unless nodes are given."""
    nodes = CELL_SHAPES[kind].nodes if nodes is None else nodes
    return Mesh(nodes, {kind: np.arange(len(nodes))[None]}, source=f"one {kind}")


def joined(first, second):
    """Two meshes in one, without a common node."""
    shift = len(first.nodes)
    cells = dict(first.cells)
    for kind, rows in second.cells.items():
        cells[kind] = np.concatenate([cells[kind], rows + shift]) if kind in cells else rows + shift
    return Mesh(np.concatenate([first.nodes, second.nodes]), cells, source="two meshes")


def nastran_deck(mesh, style="small"):
    """A bulk data deck; style "small" or "large" fields of fixed width, or "free" ones."""
    cards = [("GRID", [k + 1, "", *(f"{x:.5f}" for x in node)]) for k, node in enumerate(mesh.nodes)]
    penta15 = [*range(9), *range(12, 15), *range(9, 12)]
    hexa20 = [*range(12), *range(16, 20), *range(12, 16)]  # Nastran numbers upright edges before those of the top
    for kind, cells in mesh.cells.items():
        name = {"tet": "CTETRA", "hex": "CHEXA", "wed": "CPENTA", "pyr": "CPYRAM"}[kind[:3]]
        for k, cell in enumerate(cells[:, {"hexahedron20": hexa20, "wedge15": penta15}.get(kind, slice(None))]):
            cards.append((name, [k + 1, 7, *(cell + 1)]))
    per_line, width = (4, 16) if style == "large" else (8, 8)
    lines = ["SOL 101", "CEND", "BEGIN BULK"]
    for name, fields in cards:
        for start in range(0, len(fields), per_line):
            row = fields[start : start + per_line]
            if style == "free":
                lines.append(",".join([name if start == 0 else "+", *map(str, row)]))
            else:
                head = (name if start == 0 else "") + ("*" if style == "large" else "" if start == 0 else "+")
                lines.append((f"{head:<8}" + "".join(f"{field!s:<{width}}" for field in row)).rstrip())
    return "\n".join([*lines, "ENDDATA", ""])
