"""Tiny meshes as data: a box with face groups in every cell type, two bodies in one mesh, single cells."""

from dataclasses import replace

import numpy as np

from fe_models.boundary import boundary_facets
from fe_models.cell_shapes import CELL_SHAPES
from fe_models.mesh import SOLID_TYPES, Mesh
from tests.bodies import box_mesh

__all__ = ["SOLID_TYPES", "cell_mesh", "faced_box", "joined"]


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
