"""Interfaces of a meshed body at selected nodes: rigid, distributing, or with the dofs of every node."""

from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike

from fe_models.body.couplings.couplings import require_spread
from fe_models.body.fe_body import Interface
from fe_models.errors import InterfaceError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.meshes.boundary import area_centroid, facet_weights
from fe_models.meshes.mesh import Mesh
from fe_models.meshes.objects.as_mesh import selectable
from fe_models.meshes.selections import Selection, selected_facets

__all__ = ["distributing_interface", "nodes_interface", "rigid_interface"]

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
    return _interface(mesh, name, "rigid", nodes, selection, reference, triad)


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
    return _interface(mesh, name, "distributing", nodes, selection, reference, triad, member_weights)


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
    return _interface(mesh, name, "nodes", _chosen(name, lambda: selection.members(mesh)), selection, reference, triad)


def _chosen(name: str, choose: Callable[[], Chosen]) -> Chosen:
    """Return the result of a selection; its error message names the interface."""
    try:
        return choose()
    except InterfaceError as error:
        raise InterfaceError(f"interface {name!r}: {error}") from None


def _interface(
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
