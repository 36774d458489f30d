"""Nodes that a reduced body keeps at the user's request, in addition to its surface and interfaces."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import IntArray
from fe_models.foundation.errors import BodyError
from fe_models.meshes.numbering import NONE, node_place

__all__ = ["ALL", "TOLERANCE", "keep_nodes"]

ALL = "all"  #: a request for every node

TOLERANCE = 1e-3  #: largest distance between a node and the position that selects it, over the size of the body


def keep_nodes(body: FEBody, keep: Sequence[Any]) -> FEBody:
    """Return the body with a request to keep these nodes, with translations and rotations.

    Parameters
    ----------
    body
        Coupled or not.
    keep
        Each entry is a node number (12, or "INSTANCE.12"), the name of a set, or a position [x, y, z] in mesh axes. A
        position selects the node within 1e-3 of the size of the body. "all" selects every node.

    Raises
    ------
    BodyError
        If there is no such node or set, a set is empty, or no node is at a position. The message names the nearest
        ones.
    """
    if not len(keep):
        return body
    where = f"body {body.name!r}: keep"
    rows = [named_rows(body, where, each) for each in ([keep] if isinstance(keep, str) else keep)]
    return replace(body, kept=np.concatenate([body.kept, *rows]))


def named_rows(body: FEBody, where: str, asked: Any) -> IntArray:
    """Return the nodes of one request: a node number, a set or a position."""
    numbering = body.numbering
    if isinstance(asked, str) and asked == ALL:
        return own_nodes(body, np.unique(mesh_nodes(body)))
    if isinstance(asked, str):
        prefix = asked.rpartition(".")[0]
        if asked not in numbering.set_names and prefix in numbering.instances:
            return numbering.rows_of_node(where, asked)[:1]
        named = numbering.named_set(where, asked)
        rows = named.members if named.kind == "nodes" else np.unique(body.surface[named.members])
        return own_nodes(body, rows)
    if isinstance(asked, int | np.integer) and not isinstance(asked, bool):
        rows = own_nodes(body, numbering.rows_of_node(where, int(asked)))
        return rows[:1]
    try:
        position = np.asarray(asked, dtype=float)
    except (TypeError, ValueError):
        position = np.zeros(0)
    if position.shape != (3,) or not np.isfinite(position).all():
        raise BodyError(f"{where}: expected the number of a node, the name of a set, or [x, y, z], got {asked!r}")
    nodes = own_nodes(body, np.unique(mesh_nodes(body)))
    away = np.linalg.norm(body.nodes[nodes] - position, axis=1)
    order = np.argsort(away, kind="stable")[:3]
    if away[order[0]] > TOLERANCE * body.length:
        near = "; ".join(f"{node_place(numbering, body.nodes, int(nodes[k]))}, {away[k]:.3g} away" for k in order)
        raise BodyError(
            f"{where}: no node at {position.tolist()} within {TOLERANCE:g} of the size of the body, "
            f"{body.length:.4g}; nearest: {near}"
        )
    return nodes[order[:1]]


def own_nodes(body: FEBody, rows: IntArray) -> IntArray:
    """Return the rows of real nodes, without skin points and duplicates."""
    numbering = body.numbering
    if numbering.on_skin.size:
        rows = rows[numbering.on_skin[rows] == 0]
    if not numbering.nodes.size:
        return rows
    instance = numbering.node_instance[rows] if numbering.node_instance.size else np.zeros(len(rows), np.int64)
    key = np.stack([instance, numbering.nodes[rows]], axis=1)
    _, first = np.unique(key, axis=0, return_index=True)
    loose = np.flatnonzero(numbering.nodes[rows] == NONE)
    return np.asarray(rows[np.unique(np.concatenate([first, loose]))])


def mesh_nodes(body: FEBody) -> IntArray:
    """Return the nodes that have dofs, in the mesh or after coupling."""
    parts = [body.dofs] if body.recovery is None else [body.dofs, body.recovery.dofs]
    return np.concatenate([dofs[dofs[:, 1] >= 0, 0] for dofs in parts])
