"""Division of a mesh into consecutive parts; the nodes of each cut form a node set in both parts.

A floating frame describes small deflections of its body relative to the frame. A slender body with large deflections
can be described by several parts, each with its own frame.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Generic, TypeVar, cast

import numpy as np
from numpy.typing import ArrayLike

from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.meshes.boundary import area_centroid, boundary_facets
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import Mesh, drop_unused_nodes
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["Cut", "Split", "cut_name", "split_mesh"]

AnyMesh = TypeVar("AnyMesh", Mesh, LineMesh, ShellMesh)
SomeMesh = Mesh | LineMesh | ShellMesh


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class Cut:
    """Common boundary of two parts.

    Parameters
    ----------
    name
        Name of the node set in both parts.
    point
        Area centroid of the common facets, or the mean of the nodes for lines, (3,) [m].
    n_nodes
        Number of nodes on the cut.
    """

    name: str
    point: Array
    n_nodes: int

    def __post_init__(self) -> None:
        object.__setattr__(self, "point", frozen(self.point))


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class Split(Generic[AnyMesh]):
    """Mesh in parts along an axis; cut k is between parts k and k + 1, counted from 1.

    Parameters
    ----------
    parts
        The meshes of the parts.
    cuts
        The cuts between the parts.
    axis
        Unit vector, (3,).
    """

    parts: tuple[AnyMesh, ...]
    cuts: tuple[Cut, ...]
    axis: Array

    def __post_init__(self) -> None:
        object.__setattr__(self, "axis", frozen(self.axis))


def cut_name(k: int) -> str:
    """Return the name of the node set of cut k."""
    return f"cut_{k}"


def split_mesh(
    mesh: AnyMesh, n: int | None = None, *, at: ArrayLike | None = None, axis: ArrayLike | None = None
) -> Split[AnyMesh]:
    """Divide a mesh along an axis, by the cell centres, into parts of equal length or at given positions.

    Parameters
    ----------
    mesh
        Solid cells, lines, or shell cells with stiffeners. Groups keep their members in each part; empty groups are
        dropped.
    n
        Number of parts of equal length, 2 or more.
    at
        Positions of the cuts along the axis, instead of n, from the origin of the mesh, ascending, (n - 1,) [m].
    axis
        Direction, (3,); None: the direction of the greatest extent of the nodes.

    Raises
    ------
    MeshError
        If a part has no cell, is not connected to its neighbours, or meets a part that is not its neighbour. The parts
        are then shorter than the cells, or the body turns back along the axis.
    """
    direction = longest_direction(mesh.nodes) if axis is None else unit("split: axis", axis)
    places_of_cuts = cut_places(mesh, direction, n, at)
    n = len(places_of_cuts) + 1
    part_of = {
        kind: np.searchsorted(places_of_cuts, X @ direction, side="right") for kind, X in cell_centers(mesh).items()
    }
    members = [nodes_of(mesh, {kind: rows == k for kind, rows in part_of.items()}) for k in range(n)]
    for k, nodes in enumerate(members):
        if not len(nodes):
            raise MeshError(
                f"split: part {k + 1} of {n} has no cell: the cells are longer than the part; take fewer parts"
            )
    shared = {(a, b): np.intersect1d(members[a], members[b]) for a, b in combinations(range(n), 2)}
    for (a, b), nodes in shared.items():
        if b == a + 1 and not len(nodes):
            raise MeshError(f"split: parts {a + 1} and {b + 1} share no node; the mesh is in pieces along the axis")
        if b > a + 1 and len(nodes):
            raise MeshError(
                f"split: parts {a + 1} and {b + 1} share {len(nodes)} nodes (first node {nodes[0]}); a part between "
                "them is shorter than the cells, or the body runs back along the axis: take fewer parts"
            )
    parts, cuts = [], []
    for k in range(n):
        sets = {cut_name(j + 1): shared[j, j + 1] for j in (k - 1, k) if 0 <= j < n - 1}
        clash = [name for name in sets if name in mesh.node_sets]
        if clash:
            raise MeshError(f"split: the mesh has a node set {clash[0]!r} already; rename it")
        whole: SomeMesh = replace(mesh, node_sets={**mesh.node_sets, **sets})
        behind = shared[k, k + 1] if k < n - 1 else np.zeros(0, np.int64)
        chosen = {kind: rows == k for kind, rows in part_of.items()}
        parts.append(restricted(whole, chosen, behind, f"part {k + 1} of {n}"))
    for k in range(n - 1):
        nodes = shared[k, k + 1]
        cuts.append(Cut(cut_name(k + 1), center_of_cut(parts[k], cut_name(k + 1)), len(nodes)))
    return Split(cast("tuple[AnyMesh, ...]", tuple(parts)), tuple(cuts), direction)


def cut_places(mesh: SomeMesh, axis: Array, n: int | None, at: ArrayLike | None) -> Array:
    """Return the positions of the cuts along an axis, ascending, (n - 1,)."""
    low, high = mesh_extent(mesh, axis)
    words = f"along ({', '.join(f'{x:.4g}' for x in axis)})"
    if not high - low > 1e-12 * np.abs(mesh.nodes).max():
        raise MeshError(f"split: the mesh has no extent {words}; choose another axis")
    if (n is None) == (at is None):
        raise MeshError("split: expected either a number of parts or the places of the cuts")
    if at is None:
        if isinstance(n, bool) or n is None or n < 2:
            raise MeshError(f"split: expected 2 parts or more, got {n}")
        return np.linspace(low, high, n + 1)[1:-1]
    cuts = np.atleast_1d(np.asarray(at, dtype=float))
    if cuts.ndim != 1 or not len(cuts) or not (np.diff(np.concatenate([[low], cuts, [high]])) > 0).all():
        raise MeshError(
            f"split: places of cuts: expected ascending numbers between {low:.6g} and {high:.6g}, where the mesh lies "
            f"{words}, got {cuts.tolist()}"
        )
    return cuts


def longest_direction(nodes: Array) -> Array:
    """Return the direction of the greatest extent, its largest component positive, (3,)."""
    _, _, Vt = np.linalg.svd(nodes - nodes.mean(axis=0), full_matrices=False)
    axis = Vt[0]
    return np.asarray(axis * np.sign(axis[np.abs(axis).argmax()]))


def unit(where: str, vector: ArrayLike) -> Array:
    """Return a direction as a unit vector, (3,)."""
    v = np.asarray(vector, dtype=float)
    if v.shape != (3,) or not np.isfinite(v).all() or not v.any():
        raise MeshError(f"{where}: expected a direction, three finite numbers that are not all zero, got {vector!r}")
    return np.asarray(v / np.linalg.norm(v))


def cells_of(mesh: SomeMesh) -> Mapping[str, IntArray]:
    """Return the nodes of the cells, (n_cells, nodes per cell), by cell type."""
    return {"line": mesh.lines} if isinstance(mesh, LineMesh) else mesh.cells


def cell_centers(mesh: SomeMesh) -> dict[str, Array]:
    """Return the mean of the nodes of each cell, (n_cells, 3), by cell type."""
    return {kind: mesh.nodes[cells].mean(axis=1) for kind, cells in cells_of(mesh).items()}


def mesh_extent(mesh: SomeMesh, axis: Array) -> tuple[float, float]:
    """Return the smallest and largest position of cell nodes along an axis."""
    used = np.unique(np.concatenate([cells.ravel() for cells in cells_of(mesh).values()]))
    s = mesh.nodes[used] @ axis
    return float(s.min()), float(s.max())


def nodes_of(mesh: SomeMesh, kept: Mapping[str, Array]) -> IntArray:
    """Return the nodes of the kept cells, ascending."""
    return np.unique(np.concatenate([cells[kept[kind]].ravel() for kind, cells in cells_of(mesh).items()]))


def restricted(mesh: SomeMesh, kept: Mapping[str, Array], behind: IntArray, what: str) -> SomeMesh:
    """Return the mesh of the kept cells, with everything renumbered.

    Parameters
    ----------
    kept
        Whether to keep each cell, (n_cells,) bool, by cell type.
    behind
        Nodes of the cut to the next part. Cells and lines within the cut go to the next part.
    what
        Description of the part, for the source of the mesh.
    """
    source = f"{mesh.source}, {what}" if mesh.source else what
    if isinstance(mesh, LineMesh):
        return lines_kept(mesh, kept, source)
    return shell_kept(mesh, kept, behind, source) if isinstance(mesh, ShellMesh) else cells_kept(mesh, kept, source)


def lines_kept(mesh: LineMesh, kept: Mapping[str, Array], source: str) -> LineMesh:
    """Return the mesh of the kept lines."""
    rows, nodes = kept["line"], nodes_of(mesh, kept)
    place, line_place = places(len(mesh.nodes), nodes), places(len(mesh.lines), np.flatnonzero(rows))
    return replace(
        mesh,
        nodes=mesh.nodes[nodes],
        lines=place[mesh.lines[rows]],
        line_sets=without_empty({group: moved(line_place, m) for group, m in mesh.line_sets.items()}),
        node_sets=without_empty({group: moved(place, m) for group, m in mesh.node_sets.items()}),
        orientations=None if mesh.orientations is None else mesh.orientations[rows],
        offsets=None if mesh.offsets is None else mesh.offsets[rows],
        line_numbers=mesh.line_numbers[rows] if mesh.line_numbers.size else mesh.line_numbers,
        node_numbers=mesh.node_numbers[nodes] if mesh.node_numbers.size else mesh.node_numbers,
        source=source,
    )


def shell_kept(mesh: ShellMesh, kept: Mapping[str, Array], behind: IntArray, source: str) -> ShellMesh:
    """Return the mesh of the kept shell cells, with their stiffeners except those in the cut to the next part."""
    nodes = nodes_of(mesh, kept)
    place = places(len(mesh.nodes), nodes)
    own = np.zeros(len(mesh.nodes), dtype=bool)
    own[nodes] = True
    rows = own[mesh.lines].all(axis=1)
    on_cut = np.zeros(len(mesh.nodes), dtype=bool)
    on_cut[behind] = True
    rows &= ~on_cut[mesh.lines].all(axis=1)
    line_place = places(len(mesh.lines), np.flatnonzero(rows))
    cells = {kind: place[mesh.cells[kind][chosen]] for kind, chosen in kept.items() if chosen.any()}
    return replace(
        mesh,
        nodes=mesh.nodes[nodes],
        cells=cells,
        cell_sets=cell_sets_kept(mesh, kept),
        cell_numbers={kind: numbers[kept[kind]] for kind, numbers in mesh.cell_numbers.items() if kind in cells},
        lines=place[mesh.lines[rows]],
        line_numbers=mesh.line_numbers[rows] if mesh.line_numbers.size else mesh.line_numbers,
        line_sets=without_empty({group: moved(line_place, m) for group, m in mesh.line_sets.items()}),
        node_sets=without_empty({group: moved(place, m) for group, m in mesh.node_sets.items()}),
        node_numbers=mesh.node_numbers[nodes] if mesh.node_numbers.size else mesh.node_numbers,
        source=source,
    )


def cells_kept(mesh: Mesh, kept: Mapping[str, Array], source: str) -> Mesh:
    """Return the mesh of the kept solid cells."""
    cells = {kind: mesh.cells[kind][rows] for kind, rows in kept.items() if rows.any()}
    part = drop_unused_nodes(
        replace(
            mesh,
            cells=cells,
            cell_sets=cell_sets_kept(mesh, kept),
            cell_numbers={kind: numbers[kept[kind]] for kind, numbers in mesh.cell_numbers.items() if kind in cells},
        )
    )
    return replace(
        part,
        face_sets={group: by_type for group, by_type in part.face_sets.items() if by_type},
        node_sets=without_empty(part.node_sets),
        notes=mesh.notes,  # no note about dropped nodes: they are in other parts
        source=source,
    )


def cell_sets_kept(mesh: Mesh | ShellMesh, kept: Mapping[str, Array]) -> dict[str, dict[str, IntArray]]:
    """Return the groups of cells that still have members, with the new indices."""
    place = {kind: places(len(mesh.cells[kind]), np.flatnonzero(rows)) for kind, rows in kept.items()}
    sets = {
        group: without_empty({kind: moved(place[kind], m) for kind, m in by_type.items()})
        for group, by_type in mesh.cell_sets.items()
    }
    return {group: by_type for group, by_type in sets.items() if by_type}


def places(n: int, kept: IntArray) -> IntArray:
    """Return the new index of each of n items, (n,); -1 for items that are dropped."""
    place = np.full(n, -1, np.int64)
    place[kept] = np.arange(len(kept))
    return place


def moved(place: IntArray, members: IntArray) -> IntArray:
    """Return the new indices of the members that are kept."""
    new = place[members]
    return new[new >= 0]


def without_empty(groups: Mapping[str, IntArray]) -> dict[str, IntArray]:
    """Return the groups that are not empty."""
    return {name: members for name, members in groups.items() if members.size}


def center_of_cut(part: SomeMesh, name: str) -> Array:
    """Return the area centroid of the facets of a cut, or the mean of its nodes if it has no facets, (3,)."""
    nodes = part.node_sets[name]
    if isinstance(part, Mesh):
        on_cut = np.zeros(len(part.nodes), dtype=bool)
        on_cut[nodes] = True
        facets = {kind: rows[on_cut[rows].all(axis=1)] for kind, rows in boundary_facets(part).items()}
        facets = {kind: rows for kind, rows in facets.items() if len(rows)}
        if facets:
            return np.asarray(area_centroid(part.nodes, facets)[1])
    return np.asarray(part.nodes[nodes].mean(axis=0))
