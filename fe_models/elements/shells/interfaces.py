"""Interfaces of a shell: rigid, distributing, or with the dofs of every node."""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from fe_models.body.fe_body import Interface
from fe_models.elements.beams.interfaces import node_interface
from fe_models.elements.shells.skin import cell_edges
from fe_models.foundation.arrays import Array
from fe_models.meshes.boundary import facet_weights
from fe_models.meshes.objects.as_mesh import as_shell_mesh
from fe_models.meshes.selections import Selection, selected_facets
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["shell_interface"]


def shell_interface(
    mesh: Any,
    name: str,
    selection: Selection,
    *,
    kind: str = "rigid",
    reference: ArrayLike | None = None,
    triad: ArrayLike | None = None,
) -> Interface:
    """Make an interface at nodes of a shell, which have rotations.

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
    weights = _weights(mesh, selection) if kind == "distributing" else np.ones(len(mesh.nodes))
    return node_interface(mesh, name, selection, kind, reference, triad, weights)


def _weights(mesh: ShellMesh, selection: Selection) -> Array:
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
