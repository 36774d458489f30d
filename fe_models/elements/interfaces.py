"""Interfaces on meshes of solids, shells and lines: rigid, distributing, or with the dofs of every node."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from fe_models.body.couplings.couplings import require_spread
from fe_models.body.fe_body import Interface
from fe_models.elements.shells.skin import cell_edges
from fe_models.errors import InterfaceError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.meshes.boundary import area_centroid, facet_weights
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.objects.as_mesh import as_shell_mesh, selectable
from fe_models.meshes.selections import AnyMesh, Selection, selected_facets
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = [
    "NodeIndices",
    "distributing_interface",
    "line_interface",
    "node_interface",
    "nodes_interface",
    "rigid_interface",
    "shell_interface",
]

# solids ---------------------------------------------------------------------------------------------------------------


Chosen = TypeVar("Chosen")


def rigid_interface(
    mesh: Any,
    name: str,
    selection: Selection,
    *,
    reference: ArrayLike | None = None,
    triad: ArrayLike | None = None,
) -> Interface:
    """Make a rigid interface (RBE2): the selected nodes move rigidly with the reference node.

    Parameters
    ----------
    mesh
        Mesh of the body, from this package or another library, or a basis of scikit-fem (`fe_models.meshes.as_mesh`).
    name
        Name of the interface.
    selection
        Selected nodes.
    reference
        Reference point, (3,) [m]; None: the area centroid of the selected facets, or the mean of the nodes if they form
        no facet.
    triad
        Axes of the interface as columns in mesh axes, (3, 3); None: the mesh axes.

    Raises
    ------
    InterfaceError
        If fewer than three nodes are selected, or all lie on one line, which would leave a rotation free.
    """
    mesh = selectable(mesh)
    nodes = _chosen(name, lambda: selection.members(mesh))
    require_spread(name, "rigid", mesh.nodes[nodes], np.ones(len(nodes)))
    return _solid_interface(mesh, name, "rigid", nodes, selection, reference, triad)


def distributing_interface(
    mesh: Any,
    name: str,
    selection: Selection,
    *,
    reference: ArrayLike | None = None,
    triad: ArrayLike | None = None,
) -> Interface:
    """Make a distributing interface (RBE3): the reference node follows the area-weighted mean motion of the nodes.

    Members are the nodes of the selected facets: the facets of a face group, or else the boundary facets whose nodes
    are all selected. The weight of a node is its area (`fe_models.meshes.boundary.facet_weights`). The corners of flat
    quadratic triangles have zero weight and stay members.

    Parameters
    ----------
    mesh, name, selection, reference, triad
        As for `rigid_interface`; the default reference is the area centroid.

    Raises
    ------
    InterfaceError
        If no facet is selected, or the weighted nodes lie on one line.
    """
    mesh = selectable(mesh)
    facets = _chosen(name, lambda: selected_facets(mesh, selection))
    if not facets:
        count = len(_chosen(name, lambda: selection.members(mesh)))
        raise InterfaceError(
            f"interface {name!r}: the {count} selected nodes make up no complete facet of the surface "
            f"and so have no area; select a surface, or widen the tolerance so that middle nodes "
            f"are selected too"
        )
    weights = facet_weights(mesh.nodes, facets)
    nodes = np.unique(np.concatenate([rows.ravel() for rows in facets.values()]))
    area = weights[nodes].sum()
    if (weights[nodes] < -1e-3 * area).any():
        raise InterfaceError(
            f"interface {name!r}: the facets are so curved that nodes have negative weights; refine the mesh"
        )
    member_weights = np.maximum(weights[nodes], 0.0)
    require_spread(name, "distributing", mesh.nodes[nodes], member_weights)
    return _solid_interface(mesh, name, "distributing", nodes, selection, reference, triad, member_weights)


def nodes_interface(
    mesh: Any,
    name: str,
    selection: Selection,
    *,
    reference: ArrayLike | None = None,
    triad: ArrayLike | None = None,
) -> Interface:
    """Make an interface in which every dof of every selected node is a boundary dof.

    Parameters
    ----------
    mesh, name, selection, reference, triad
        As for `rigid_interface`; joints act at the reference point.

    Raises
    ------
    InterfaceError
        If no node is selected.
    """
    mesh = selectable(mesh)
    return _solid_interface(
        mesh, name, "nodes", _chosen(name, lambda: selection.members(mesh)), selection, reference, triad
    )


def _chosen(name: str, choose: Callable[[], Chosen]) -> Chosen:
    """Return the result of a selection; its error message names the interface."""
    try:
        return choose()
    except InterfaceError as error:
        raise InterfaceError(f"interface {name!r}: {error}") from None


def _solid_interface(
    mesh: Mesh,
    name: str,
    kind: str,
    nodes: IntArray,
    selection: Selection,
    reference: ArrayLike | None,
    triad: ArrayLike | None,
    weights: Array | None = None,
) -> Interface:
    if reference is None:
        facets = _chosen(name, lambda: selected_facets(mesh, selection))
        point = area_centroid(mesh.nodes, facets)[1] if facets else mesh.nodes[nodes].mean(axis=0)
    else:
        point = np.asarray(reference, dtype=float)
    return Interface(name, kind, nodes, point, triad=np.eye(3) if triad is None else np.asarray(triad), weights=weights)


# nodes with rotations: lines, shells, elements of other programs ------------------------------------------------------


@presented
@dataclass(frozen=True)
@checked_fields(ArgumentError)
class NodeIndices:
    """Selection of nodes by their indices in the mesh.

    Parameters
    ----------
    nodes
        Indices of the nodes, from 0.
    """

    nodes: tuple[int, ...]

    def members(self, mesh: AnyMesh) -> IntArray:
        """Return these nodes in ascending order."""
        nodes = np.unique(np.asarray(self.nodes, dtype=np.int64))
        if nodes.size == 0 or nodes.min() < 0 or nodes.max() >= len(mesh.nodes):
            raise InterfaceError(f"nodes {list(self.nodes)[:5]}: expected some of 0..{len(mesh.nodes) - 1}")
        return nodes


def line_interface(
    mesh: LineMesh,
    name: str,
    selection: Selection,
    *,
    kind: str = "rigid",
    reference: ArrayLike | None = None,
    triad: ArrayLike | None = None,
) -> Interface:
    """Return an interface at nodes of a frame.

    Parameters
    ----------
    mesh
        Mesh of the frame.
    name
        Name of the interface.
    selection
        Selected nodes, such as `NodeSet("end")`, `NodeIndices((0,))` or `NearestNode(point)`.
    kind
        "rigid": the nodes move rigidly with the reference node; one node is enough. "distributing": the reference node
        follows the mean motion of the nodes, weighted with the length of their lines; this needs three nodes that are
        not collinear. "nodes": every dof of every node is a boundary dof.
    reference
        Reference point, (3,) [m]; None: the mean of the nodes.
    triad
        Axes of the interface as columns in mesh axes, (3, 3); None: the mesh axes.

    Raises
    ------
    InterfaceError
        If no node is selected, or `reference` or `triad` is invalid.
    """
    return node_interface(mesh, name, selection, kind, reference, triad, line_weights(mesh))


def node_interface(
    mesh: AnyMesh,
    name: str,
    selection: Selection,
    kind: str,
    reference: ArrayLike | None,
    triad: ArrayLike | None,
    weights: Array,
) -> Interface:
    """Return an interface at nodes with rotations; kind "distributing" uses `weights`, (n_nodes,)."""
    try:
        nodes = selection.members(mesh)
    except InterfaceError as error:
        raise InterfaceError(f"interface {name!r}: {error}") from None
    point = mesh.nodes[nodes].mean(axis=0) if reference is None else np.asarray(reference, dtype=float)
    axes = np.eye(3) if triad is None else np.asarray(triad, dtype=float)
    return Interface(name, kind, nodes, point, triad=axes, weights=weights[nodes] if kind == "distributing" else None)


def line_weights(mesh: LineMesh) -> Array:
    """Assign half of the length of each line to each of its nodes, (n_nodes,) [m]."""
    ends = mesh.nodes[mesh.lines]
    weights = np.zeros(len(mesh.nodes))
    np.add.at(weights, mesh.lines.ravel(), np.repeat(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) / 2, 2))
    return weights


def shell_interface(
    mesh: Any,
    name: str,
    selection: Selection,
    *,
    kind: str = "rigid",
    reference: ArrayLike | None = None,
    triad: ArrayLike | None = None,
) -> Interface:
    """Return an interface at nodes of a shell, which have rotations.

    Parameters
    ----------
    mesh
        Mesh of the shell.
    name
        Name of the interface.
    selection
        Selected nodes: `NodeSet("v0")` for the nodes of an edge, `FaceGroup("lug")` for those of a group of cells, or a
        selection by geometry.
    kind
        "rigid": the nodes move rigidly with the reference node; one node is enough. "distributing": the reference node
        follows the mean motion of the nodes, weighted with the area of the cells whose nodes are all selected, or else
        with the length of the edges; this needs three nodes that are not collinear. "nodes": every dof of every node is
        a boundary dof.
    reference
        Reference point, (3,) [m]; None: the mean of the nodes.
    triad
        Axes of the interface as columns in mesh axes, (3, 3); None: the mesh axes.

    Raises
    ------
    InterfaceError
        If no node is selected, or `reference` or `triad` is invalid.
    """
    mesh = as_shell_mesh(mesh)
    weights = _shell_weights(mesh, selection) if kind == "distributing" else np.ones(len(mesh.nodes))
    return node_interface(mesh, name, selection, kind, reference, triad, weights)


def _shell_weights(mesh: ShellMesh, selection: Selection) -> Array:
    """Return weights of the nodes, (n_nodes,): area of the selected cells, or length of the selected edges, or one."""
    facets = selected_facets(mesh, selection)
    if facets:
        return facet_weights(mesh.nodes, facets)
    chosen = np.zeros(len(mesh.nodes), dtype=bool)
    chosen[selection.members(mesh)] = True
    edges = np.unique(np.sort(cell_edges(tuple(mesh.cells.values())).nodes, axis=1), axis=0)
    edges = edges[chosen[edges].all(axis=1)]
    weights = np.zeros(len(mesh.nodes))
    np.add.at(weights, edges, np.linalg.norm(mesh.nodes[edges[:, 1]] - mesh.nodes[edges[:, 0]], axis=1)[:, None] / 2)
    return weights if weights[chosen].all() else np.ones(len(mesh.nodes))
