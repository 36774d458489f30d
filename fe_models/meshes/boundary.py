"""Facets of the cells of a solid mesh; facets of only one cell form its boundary."""

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple
from weakref import WeakKeyDictionary

import numpy as np

from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.meshes.cell_shapes import facet_tables, quadrature, shape_values
from fe_models.meshes.mesh import Mesh

__all__ = [
    "all_facets",
    "area_centroid",
    "boundary_facets",
    "boundary_nodes",
    "boundary_triangles",
    "facet_weights",
    "facets_of",
    "first_of_equal_rows",
]

_TRIANGLES = {
    "triangle": ((0, 1, 2),),
    "triangle6": ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
    "quad": ((0, 1, 2), (0, 2, 3)),
    "quad8": ((0, 4, 7), (4, 1, 5), (5, 2, 6), (6, 3, 7), (4, 5, 6), (4, 6, 7)),
    "quad9": ((0, 4, 8), (4, 1, 8), (1, 5, 8), (5, 2, 8), (2, 6, 8), (6, 3, 8), (3, 7, 8), (7, 0, 8)),
}  # flat triangles over the nodes of a face, with the orientation of the face

#: number of corner nodes of each face type
CORNERS = {"triangle": 3, "triangle6": 3, "quad": 4, "quad8": 4, "quad9": 4}


class Facets(NamedTuple):
    """Facets of the cells of a solid mesh, compared by their corner nodes; cells are numbered over all types."""

    boundary: Mapping[str, IntArray]  #: facets of only one cell, as `boundary_facets` returns them
    triangles: IntArray  #: flat triangles over all nodes of the boundary, oriented outward, (n_tri, 3)
    cells: IntArray  #: cell of each triangle, (n_tri,)
    pairs: IntArray  #: cells with a common facet, (n_pairs, 2)
    n_overlapping: int  #: number of facets that belong to more than two cells
    n_mismatched: int  #: number of cell pairs whose common facets have different middle nodes


# facets of meshes that are still in use
_known: WeakKeyDictionary[Mesh, Facets] = WeakKeyDictionary()


def all_facets(mesh: Mesh) -> dict[str, tuple[IntArray, IntArray]]:
    """Return all facets of the solid cells by face type, (n, nodes per facet), outward, and the cell of each, (n,).

    A facet between two cells appears twice. Cells are numbered through all types.
    """
    facets: dict[str, list[IntArray]] = {}
    owners: dict[str, list[IntArray]] = {}
    first = 0
    for kind, cells in mesh.cells.items():
        for face_kind, local in facet_tables(kind).items():
            facets.setdefault(face_kind, []).append(cells[:, local].reshape(-1, local.shape[1]))
            owners.setdefault(face_kind, []).append(np.repeat(first + np.arange(len(cells)), len(local)))
        first += len(cells)
    return {kind: (np.concatenate(facets[kind]), np.concatenate(owners[kind])) for kind in facets}


def boundary_facets(mesh: Mesh) -> Mapping[str, IntArray]:
    """Return the facets that belong to only one cell, by face type, (n_facets, nodes per facet), oriented outward.

    Facets are compared by their corner nodes. Rows are complete faces in meshio order (corners, middles, centre). The
    result is cached as long as the mesh exists.

    Parameters
    ----------
    mesh
        A solid mesh.
    """
    return facets_of(mesh).boundary


def facets_of(mesh: Mesh) -> Facets:
    """Return the facets of a solid mesh; the arrays are cached as long as the mesh exists, and read-only."""
    if mesh in _known:
        return _known[mesh]
    every = all_facets(mesh)
    facets: dict[str, IntArray] = {}
    triangles, cells, pairs = [np.zeros((0, 3), np.int64)], [np.zeros(0, np.int64)], [np.zeros((0, 2), np.int64)]
    n_overlapping = n_mismatched = 0
    for n_corners in (3, 4):
        kinds = [kind for kind in every if CORNERS[kind] == n_corners]
        if not kinds:
            continue
        corners = np.concatenate([every[kind][0][:, :n_corners] for kind in kinds])
        middles = np.concatenate([every[kind][0][:, n_corners:].sum(axis=1) for kind in kinds])
        cell = np.concatenate([every[kind][1] for kind in kinds])
        classes, count = first_of_equal_rows(np.sort(corners, axis=1))
        order = np.argsort(classes, kind="stable")
        same = classes[order][1:] == classes[order][:-1]
        pairs.append(np.column_stack([cell[order][1:][same], cell[order][:-1][same]]))
        n_overlapping += int((count > 2).sum())
        n_mismatched += int((middles[order][1:][same] != middles[order][:-1][same]).sum())
        is_single = (count == 1)[classes]
        ends = np.cumsum([len(every[kind][0]) for kind in kinds])
        for kind, own in zip(kinds, np.split(is_single, ends[:-1]), strict=True):
            if own.any():
                facets[kind], owners = (frozen(array[own], np.int64) for array in every[kind])
                flat = np.array(_TRIANGLES[kind])
                triangles.append(facets[kind][:, flat].reshape(-1, 3))
                cells.append(np.repeat(owners, len(flat)))
    _known[mesh] = Facets(
        MappingProxyType(facets),
        frozen(np.concatenate(triangles), np.int64),
        frozen(np.concatenate(cells), np.int64),
        frozen(np.concatenate(pairs), np.int64),
        n_overlapping,
        n_mismatched,
    )
    return _known[mesh]


def first_of_equal_rows(rows: IntArray) -> tuple[IntArray, IntArray]:
    """Return for each row the index of its class of equal rows, (n,), and the size of each class, (n_classes,)."""
    if len(rows) == 0:
        return np.zeros(0, np.int64), np.zeros(0, np.int64)
    order = np.lexsort(rows.T[::-1])
    ordered = rows[order]
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    number = np.cumsum(new) - 1
    classes = np.empty(len(rows), dtype=np.int64)
    classes[order] = number
    return classes, np.bincount(number)


def boundary_nodes(mesh: Mesh) -> IntArray:
    """Return the nodes on the surface of the body, ascending, (n,)."""
    facets = boundary_facets(mesh)
    return np.unique(np.concatenate([f.ravel() for f in facets.values()])) if facets else np.zeros(0, np.int64)


def boundary_triangles(mesh: Mesh) -> IntArray:
    """Return flat triangles over all nodes of the surface, for drawing, (n_tri, 3), oriented outward.

    Parameters
    ----------
    mesh
        A solid mesh.
    """
    return facets_of(mesh).triangles


def facet_weights(nodes: Array, faces: Mapping[str, IntArray]) -> Array:
    """Return the area of each node, (n_nodes,) [m²]: the integral of its shape function over the faces.

    The sum is the area of the faces. Corners of flat quadratic triangles have exactly zero. Corners of eight-node quads
    would have a negative share (-1/12 of the face). For these faces the shares are the diagonal of the mass matrix
    instead (∫N_i² scaled to the area), which is positive and keeps the area of each face.

    Parameters
    ----------
    nodes
        Node coordinates, (n_nodes, 3) [m].
    faces
        Nodes of the faces, (n_faces, nodes per face), by face type.
    """
    weights = np.zeros(len(nodes))
    for kind, rows in faces.items():
        N, dA = _area_elements(nodes, kind, rows)
        if kind == "quad8":
            share = dA @ N**2
            share *= (dA.sum(axis=1) / share.sum(axis=1))[:, None]
        else:
            share = dA @ N
        share[np.abs(share) < 1e-12 * np.abs(share).max(initial=0.0)] = 0.0
        np.add.at(weights, rows, share)
    return weights


def area_centroid(nodes: Array, faces: Mapping[str, IntArray]) -> tuple[float, Array]:
    """Return the area of faces [m²] and its centroid ∫x dA / A, (3,) [m]."""
    area, moment = 0.0, np.zeros(3)
    for kind, rows in faces.items():
        N, dA = _area_elements(nodes, kind, rows)
        area += float(dA.sum())
        moment += np.einsum("fn,fnd->d", dA @ N, nodes[rows])
    return area, moment / area if area else moment


def _area_elements(nodes: Array, kind: str, rows: IntArray) -> tuple[Array, Array]:
    """Return shape functions, (n_points, n_local), and weighted area elements, (n_faces, n_points)."""
    points, weights = quadrature(kind)
    N, dN = shape_values(kind, points)
    tangents = np.einsum("fnd,pna->fpad", nodes[rows], dN)
    return N, np.linalg.norm(np.cross(tangents[:, :, 0], tangents[:, :, 1]), axis=2) * weights
