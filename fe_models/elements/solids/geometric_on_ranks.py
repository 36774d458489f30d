"""Geometric stiffness of a distributed mesh: each rank computes its cells, and rank 0 sums small matrices."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from fe_models.body.material import AnyMaterial
from fe_models.elements.solids.assembly_on_ranks import MeshPart, SpreadMesh
from fe_models.elements.solids.geometric import projected_geometric_stiffness
from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import BodyError
from fe_models.foundation.ranks.product import Halo
from fe_models.foundation.ranks.ranks import Ranks
from fe_models.foundation.ranks.rows import Rows
from fe_models.foundation.ranks.spread_columns import Part, SpreadColumns, own_part, spread_columns

__all__ = ["spread_geometric_stiffness"]


def spread_geometric_stiffness(
    parts: SpreadMesh, materials: tuple[AnyMaterial, ...], u: Array, Phi: SpreadColumns, rules: Mapping[str, Any]
) -> Array:
    """Return Phiᵀ K_geo(sigma_j) Phi, (k, n, n), as `elements.solids.geometric.projected_geometric_stiffness` does.

    Parameters
    ----------
    u
        Displacements of the states, on rank 0, (3 n_nodes, k).
    Phi
        Distributed columns, three rows per node in the order of the nodes, (3 n_nodes, n).
    rules
        Keyword arguments of that function.
    """
    rows = parts.layout.rows
    if Phi.layout.rows.starts != tuple(3 * start for start in rows.starts):
        raise BodyError(f"geometric_stiffness: columns, {Phi.shape}: their rows are not distributed as the mesh is")
    states = spread_columns(Phi.layout, u)
    found = parts.layout.ask(stiffness_here, parts.key, rows, materials, states.part, Phi.part, dict(rules))
    return np.asarray(np.sum(found, axis=0))


def stiffness_here(
    ranks: Ranks,
    key: str,
    rows: Rows,
    materials: tuple[AnyMaterial, ...],
    u: Part,
    Phi: Part,
    rules: dict[str, Any],
) -> Array:
    """Return the contribution of the cells of this rank."""
    whole: MeshPart = ranks.store[key]
    own = rows.of(ranks.rank)
    part = whole.cells_of(own)
    others = np.sort(part.position[(part.position < own.start) | (part.position >= own.stop)])
    halo = Halo(ranks, rows, others)
    place = np.searchsorted(others, part.position)  # position of each node of the part in [own; others]
    is_own = (part.position >= own.start) & (part.position < own.stop)
    at = np.where(is_own, part.position - own.start, own.stop - own.start + place)
    states, columns = (fields(halo, own_part(ranks, each), at) for each in (u, Phi))
    if not part.mesh.cells:
        return np.zeros((states.shape[1], columns.shape[1], columns.shape[1]))
    return projected_geometric_stiffness(part.mesh, materials, part.of_cell, states, columns, **rules)


def fields(halo: Halo, x: Array, at: np.ndarray) -> Array:
    """Return columns over the nodes of a part, (3 n_part_nodes, k), from own rows, (3 n_own, k), and the halo."""
    n, k = x.shape
    by_node = np.ascontiguousarray(x).reshape(n // 3, 3 * k)
    return np.concatenate([by_node, halo.rows(by_node)])[at].reshape(3 * len(at), k)
