"""Local axes of straight lines, and the map from nodal dofs to the dofs at the ends of the beam axis."""

from collections.abc import Sequence

import numpy as np

from fe_models.errors import BeamError
from fe_models.foundation.arrays import Array, tilde
from fe_models.meshes.line_mesh import LineMesh

__all__ = ["LineGeometry", "line_geometry", "stress_directions"]

PARALLEL = 1e-6  #: sine of the angle between a line and its orientation vector, below which the y axis is undefined


class LineGeometry:
    """Ends, lengths and local axes of the beam axes of a mesh.

    Attributes
    ----------
    ends : (n_lines, 2, 3) ends of the axis: node + offset [m]
    length : (n_lines,) [m]
    R : (n_lines, 3, 3) local axes x, y, z as columns, in mesh axes
    T : (n_lines, 12, 12) maps the dofs of the nodes to the local dofs of the axis ends
    levers : (n_lines, 2, 3) vectors from the nodes to the ends [m]
    """

    def __init__(self, ends: Array, levers: Array, R: Array) -> None:
        self.ends = ends
        self.length = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1)
        self.R = R
        self.levers = levers
        T = np.zeros((len(R), 12, 12))
        for end in range(2):
            rows = 6 * end
            T[:, rows : rows + 3, rows : rows + 3] = R.transpose(0, 2, 1)
            T[:, rows + 3 : rows + 6, rows + 3 : rows + 6] = R.transpose(0, 2, 1)
            # u_end = u_node + theta × lever
            T[:, rows : rows + 3, rows + 3 : rows + 6] = -R.transpose(0, 2, 1) @ tilde(levers[:, end])
        self.T = T


def line_geometry(mesh: LineMesh, orientations: Array, section_offsets: Array) -> LineGeometry:
    """Return the ends and local axes of the lines.

    (1) x points from the first to the second end of the line, including the offsets of the ends
    (2) y is the component of the orientation vector v normal to x; default: v = e_z × x (z points up), or e_y if
        vertical
    (3) z = x × y
    (4) section offsets move both ends along the local y and z

    Parameters
    ----------
    mesh
        Nodes, lines and their offsets.
    orientations
        Vector v of each line, (n_lines, 3); NaN rows: default.
    section_offsets
        Offset of the centroid from the line, local (y, z), (n_lines, 2) [m].

    Raises
    ------
    BeamError
        If a line has no length, or its orientation vector is parallel to it.
    """
    n = len(mesh.lines)
    levers = np.zeros((n, 2, 3)) if mesh.offsets is None else np.array(mesh.offsets)
    ends = mesh.nodes[mesh.lines] + levers
    d = ends[:, 1] - ends[:, 0]
    L = np.linalg.norm(d, axis=1)
    size = float(np.linalg.norm(np.ptp(mesh.nodes, axis=0))) or 1.0
    short = np.flatnonzero(L <= 1e-12 * size)
    if short.size:
        raise BeamError(
            f"{short.size} lines have no length, first line {short[0]} at node {_node(mesh, short[0])}; merge its "
            "nodes and remove the line, or join them by a spring"
        )
    x = d / L[:, None]  # (1)
    v = np.array(orientations, dtype=float)  # (2)
    is_default = np.isnan(v).any(axis=1)
    up = np.cross([0.0, 0.0, 1.0], x)
    is_vertical = np.linalg.norm(up, axis=1) < PARALLEL
    v[is_default] = np.where(is_vertical[:, None], [0.0, 1.0, 0.0], up)[is_default]
    length_v = np.linalg.norm(v, axis=1)
    y = v - np.einsum("na,na->n", v, x)[:, None] * x
    across = np.linalg.norm(y, axis=1)
    bad = np.flatnonzero(across <= PARALLEL * length_v)
    if bad.size:
        raise BeamError(
            f"{bad.size} lines have an orientation vector of zero length or along the line, first line {bad[0]} at "
            f"node {_node(mesh, bad[0])}: the vector shall point across it, towards the local y axis"
        )
    y /= across[:, None]
    R = np.stack([x, y, np.cross(x, y)], axis=2)  # (3)
    shift = np.einsum("nab,nb->na", R[:, :, 1:], section_offsets)  # (4)
    return LineGeometry(ends + shift[:, None], levers + shift[:, None], R)


def _node(mesh: LineMesh, line: int) -> int:
    node = int(mesh.lines[line, 0])
    return int(mesh.node_numbers[node]) if mesh.node_numbers.size else node


def stress_directions(R: Array, pairs: Sequence[tuple[int, int]]) -> Array:
    """Return the stress xx yy zz yz xz xy in mesh axes for unit stresses ij in local axes R, (n, 6, n_pairs)."""
    columns = []
    for i, j in pairs:
        tensor = np.einsum("na,nb->nab", R[:, :, i], R[:, :, j])
        if i != j:
            tensor = tensor + tensor.transpose(0, 2, 1)
        columns.append(np.stack([tensor[:, a, b] for a, b in ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))], axis=1))
    return np.stack(columns, axis=2)
