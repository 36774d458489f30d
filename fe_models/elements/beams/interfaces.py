"""Interfaces of a frame: rigid, distributing, or with the dofs of every node."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from fe_models.body.fe_body import Interface
from fe_models.errors import InterfaceError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.selections import AnyMesh, Selection

__all__ = ["NodeIndices", "line_interface", "node_interface"]


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
