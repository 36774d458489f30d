"""The surface of a body and its free modes, thinned out to what a screen shows."""

import numpy as np

from cms.assessment.compare.comparison import Drawing
from cms.assessment.rendering.shape import surface_edges
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.ranks.spread_matrix import whole_matrix

__all__ = ["draw_modes", "thinned_surface"]

MOST_TRIANGLES = 16_000  #: of a surface on the screen
MOST_LINES = 20_000  #: of a body without a surface


def draw_modes(body: FEBody, Phi: Array) -> Drawing:
    """Return the surface of the body, or the lines of a body without one, with its modes.

    Parameters
    ----------
    Phi
        Modes over the dofs of the body, (n_dof, n_modes).
    """
    moved = np.moveaxis(body.translations(Phi), 2, 0)
    triangles = thinned_surface(body.nodes, body.surface)
    lines = sharp_edges(body.nodes, triangles) if len(triangles) else stiffness_lines(body)
    used, inverse = np.unique(np.concatenate([triangles.ravel(), lines.ravel()]), return_inverse=True)
    shapes = moved[:, used]
    largest = np.linalg.norm(shapes, axis=2).max(axis=1, initial=0.0)
    shapes = shapes / np.where(largest > 0, largest, 1.0)[:, None, None]
    return Drawing(
        nodes=body.nodes[used],
        triangles=inverse[: triangles.size].reshape(-1, 3).astype(np.int64),
        lines=inverse[triangles.size :].reshape(-1, 2).astype(np.int64),
        shapes=shapes,
        n_triangles_full=len(body.surface),
    )


def sharp_edges(nodes: Array, triangles: IntArray) -> IntArray:
    """Return the sharp edges of a surface, (n_lines, 2)."""
    ends, _, is_sharp = surface_edges(nodes, triangles)
    return ends[is_sharp]


def thinned_surface(nodes: Array, triangles: IntArray, most: int = MOST_TRIANGLES) -> IntArray:
    """Return at most about `most` triangles between nodes of the given ones, (n_tri, 3)."""
    if len(triangles) <= most:
        return triangles
    import pyvista as pv

    faces = np.hstack([np.full((len(triangles), 1), 3), triangles])
    mesh = pv.PolyData(nodes, faces.ravel())
    mesh.point_data["node"] = np.arange(len(nodes))
    thin = mesh.clean().decimate_pro(1 - most / len(triangles), preserve_topology=False)
    of_point = np.asarray(thin.point_data["node"]).round().astype(np.int64)
    return np.asarray(of_point[thin.faces.reshape(-1, 4)[:, 1:]])


def stiffness_lines(body: FEBody) -> IntArray:
    """Return pairs of nodes that a stiffness joins, (n_lines, 2): the elements of a body of beams or springs."""
    rows = whole_matrix(body.K).tocoo()
    node = body.dofs[:, 0]
    a, b = node[rows.row], node[rows.col]
    pairs = np.unique(np.stack([a, b], axis=1)[a < b], axis=0)
    has_length = np.linalg.norm(body.nodes[pairs[:, 0]] - body.nodes[pairs[:, 1]], axis=1) > 0 if len(pairs) else []
    pairs = pairs[has_length] if len(pairs) else pairs
    return pairs[:MOST_LINES].astype(np.int64)
