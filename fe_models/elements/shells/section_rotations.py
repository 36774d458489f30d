r"""Section rotations of a stiffener that differ from the rotations of its wall.

A wall supports a beam along a line. The displacement of the line and the rotation about it are common to both. The
other rotations of a section follow the axis of the beam. If the wall twists by theta_x', the shear centre of a section
with lever r from the line moves by theta_x × r, so its axis rotates relative to the wall's line by theta_x' e_x × (e_x
× r) = -theta_x' r. About the normal n, the rotation of the wall tends to the mean ½ (v,x - u,y) of two slopes as the
mesh is refined, while the axis of the beam rotates by v,x alone. A section that had to rotate with the node would shear
by this difference, with a torsional stiffness of GA r² instead of GJ. The effect is small in a coarse mesh, where the
drilling rotation of large cells is compliant, but not in a fine mesh.

A section therefore rotates independently about the normal, and about its lever where the lever is not along the normal.
Its other rotations are those of the node:

    theta_b = theta_s + A (A_C)⁻¹ (phi - theta_s,C)

The columns of A, (3, k), are orthonormal axes normal to all lines at the node. C are k components in which these axes
are independent. phi is the section's own rotation about the mesh axes C, so rigid motion has phi = theta_C.
"""

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray

from fe_models.elements.beams.model import BeamModel
from fe_models.elements.shells.model import ShellModel
from fe_models.elements.shells.skin import cell_edges
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["SectionRotations", "own_axes", "rotations_of_sections"]

#: cosine of the angle between normals at a node, below which the wall counts as folded
SMOOTH = np.cos(np.deg2rad(40.0))
ALONG = 0.1  #: component of the lines at a node along an axis, above which no section rotates independently about it
APART = 0.1  #: sine of the angle between two axes, below which they count as the same axis
ON_LINE = 1e-6  #: lever divided by the length of the line, below which a section lies on the line


@dataclass(frozen=True, eq=False)
class SectionRotations:
    """Map from shell nodes to the frame nodes on them, and the independent rotations of sections."""

    #: map from dofs of the shell, then independent rotations, to dofs of the frame, (6 n_frame, 6 n_shell + n_own)
    place: sp.csr_array
    own: IntArray  #: (frame node, component 3-5) of the independent rotations, (n_own, 2)


def section_rotations(axes: list[Array], nodes: IntArray, n_shell: int) -> SectionRotations:
    """Return the map from the dofs of the shell to the dofs of a frame on it.

    Parameters
    ----------
    axes
        Axes of independent rotation at each node of the frame, (3, k) with k from 0 to 2; see `own_axes`.
    nodes
        Node of the shell for each node of the frame, (n_frame,).
    n_shell
        Number of nodes of the shell.
    """
    n_frame = len(nodes)
    own: list[tuple[int, int]] = []
    rows, columns, values = (
        [np.arange(6 * n_frame)],
        [(6 * nodes[:, None] + np.arange(6)).ravel()],
        [np.ones(6 * n_frame)],
    )
    for node, A in enumerate(axes):
        k = A.shape[1]
        if not k:
            continue
        C = np.sort(la.qr(A.T, mode="r", pivoting=True)[1][:k])
        tie = np.linalg.solve(A[C].T, A.T).T  # A (A_C)⁻¹, (3, k)
        about = np.repeat(6 * node + 3 + np.arange(3), k)
        rows += [about, about]
        columns += [np.tile(6 * nodes[node] + 3 + C, 3), np.tile(6 * n_shell + len(own) + np.arange(k), 3)]
        values += [-tie.ravel(), tie.ravel()]
        own += [(node, 3 + int(c)) for c in C]
    place = sp.csr_array(
        (np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))),
        shape=(6 * n_frame, 6 * n_shell + len(own)),
    )
    place.sum_duplicates()
    place.eliminate_zeros()
    return SectionRotations(place, np.array(own, dtype=np.int64).reshape(-1, 2))


def own_axes(
    lines: IntArray, directions: Array, levers: Array, normals: Array, is_held: NDArray[np.bool_]
) -> list[Array]:
    """Return the axes about which sections at a node rotate independently, (3, k), orthonormal, k = 0..2.

    (1) possible axes: normal to the lines at the node, because the wall transmits its twist to the lines
    (2) desired axes: the normal of a smooth wall, and the levers of lines that continue beyond the node (not of lines
        that end there, because their moments must be transmitted to the wall)
    (3) result: the projection of the desired axes onto the span of the possible axes

    Parameters
    ----------
    lines
        Nodes of the frame at the ends of each line, (n_lines, 2).
    directions
        Unit vectors along the lines, (n_lines, 3).
    levers
        Vectors from the line to the shear centre at both ends, divided by the length of the line, (n_lines, 2, 3).
    normals
        Normal of the wall at each node, (n_frame, 3); NaN where the wall is folded.
    is_held
        Whether the sections at each node rotate with the node about all axes, (n_frame,).
    """
    n = len(normals)
    at_node: list[list[tuple[int, int]]] = [[] for _ in range(n)]
    for line, ends in enumerate(lines.tolist()):
        for end, node in enumerate(ends):
            at_node[node].append((line, end))
    none, axes = np.zeros((3, 0)), []
    for node, found in enumerate(at_node):
        if is_held[node] or not found:
            axes.append(none)
            continue
        t = directions[[line for line, _ in found]]
        share, vectors = np.linalg.eigh(t.T @ t / len(found))
        free = vectors[:, share < ALONG]  # (1)
        wished = [] if np.isnan(normals[node]).any() else [normals[node]]  # (2)
        if len(found) > 1:
            r = np.array([levers[line, end] for line, end in found])
            away = np.sqrt((r**2).sum(axis=1))
            wished += list(r[away > ON_LINE] / away[away > ON_LINE, None])
        if not wished or not free.shape[1]:
            axes.append(none)
            continue
        U, size, _ = np.linalg.svd(free.T @ np.stack(wished, axis=1), full_matrices=False)  # (3)
        axes.append(free @ U[:, size > APART])
    return axes


def rotations_of_sections(model: ShellModel, beams: BeamModel, nodes: IntArray, held: IntArray) -> SectionRotations:
    """Return the independent section rotations; none at nodes in `held`, or where a line leaves the shell.

    Parameters
    ----------
    model, beams
        The shell and the frame on it.
    nodes
        Shell node of each node of the frame, (n_frame_nodes,).
    held
        Nodes of the shell that have other attachments, (n_held,).
    """
    lines = beams.dofs[:, ::6] // 6
    is_held = np.isin(nodes, held)
    is_held[lines[~_along_cells(model, nodes[lines])]] = True
    vectors = beams.nodes[lines[:, 1]] - beams.nodes[lines[:, 0]]
    length = np.linalg.norm(vectors, axis=1)[:, None]
    center = np.array([section.shear_center for section in beams.sections]).reshape(-1, 2)[beams.of_line]
    levers = beams.geometry.levers + np.einsum("nab,nb->na", beams.geometry.R[:, :, 1:], center)[:, None]
    across = levers - np.einsum("nea,na->ne", levers, vectors / length)[..., None] * (vectors / length)[:, None]
    axes = own_axes(lines, vectors / length, across / length[:, None], _normals(model, nodes), is_held)
    return section_rotations(axes, nodes, model.n_nodes)


def _along_cells(model: ShellModel, lines: IntArray) -> NDArray[np.bool_]:
    """Return whether the nodes of each line form an edge of a cell, (n_lines,) bool."""
    ends = np.sort(np.concatenate([cell_edges(tuple(group.cells for group in model.groups)).nodes, lines]), axis=1)
    number = ends @ [model.n_nodes, 1]
    return np.isin(number[len(number) - len(lines) :], number[: len(number) - len(lines)])


def _normals(model: ShellModel, nodes: IntArray) -> Array:
    """Return the normal of the wall at some nodes, up to its sign, (n, 3); NaN where walls meet at a fold."""
    spread = np.zeros((model.n_nodes, 3, 3))
    for group in model.groups:
        n = group.planes.R[:, :, 2]
        each = group.areas()[:, None, None] * n[:, :, None] * n[:, None, :]
        np.add.at(spread, group.cells, each[:, None])
    mean = np.linalg.eigh(spread)[1][:, :, 2]
    least = np.ones(model.n_nodes)
    for group in model.groups:
        along = np.abs(np.einsum("nca,na->nc", mean[group.cells], group.planes.R[:, :, 2]))
        np.minimum.at(least, group.cells, along)
    mean[least < SMOOTH] = np.nan
    return np.asarray(mean[nodes])
