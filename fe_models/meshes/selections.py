"""Selections of mesh nodes, by group or by geometry."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from fe_models.errors import InterfaceError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, number_list
from fe_models.meshes.boundary import CORNERS, boundary_facets, boundary_nodes, first_of_equal_rows
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.mesh import Mesh, used_nodes
from fe_models.meshes.node_cloud import NodeCloud
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = [
    "Box", "Cylinder", "FaceGroup", "NearestNode", "NodeNumbers", "NodeSet", "Plane", "Selection",
    "selected_facets",
]  # fmt: skip

_WHY_EMPTY = "nodes that belong to no solid cell, such as reference nodes, are dropped: select nodes of the solid"

Vector = tuple[float, float, float]
AnyMesh = Mesh | LineMesh | ShellMesh | NodeCloud


class Selection(Protocol):
    """A rule that selects nodes of a mesh."""

    def members(self, mesh: AnyMesh) -> IntArray:
        """Return the selected nodes, ascending; raise `InterfaceError` if none is selected."""


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class FaceGroup:
    """The nodes of one or more named groups of faces, or of groups of shell cells.

    If the faces are facets of the solid, the nodes are those of the complete facets. Linear triangles over quadratic
    tetrahedra therefore select the middle nodes too.

    Parameters
    ----------
    name
        Name of the group of faces.
    also
        Names of further groups.
    """

    name: str
    also: tuple[str, ...] = ()

    def members(self, mesh: AnyMesh) -> IntArray:
        """Return the nodes of the groups, ascending."""
        return np.unique(np.concatenate([rows.ravel() for rows in self.facets(mesh).values()]))

    def facets(self, mesh: AnyMesh) -> dict[str, IntArray]:
        """Return the faces of the groups by type; faces that are facets of the solid become complete facets."""
        if isinstance(mesh, LineMesh):
            raise InterfaceError(f"face group {self.name!r}: a mesh of lines has no faces; select nodes")
        found: dict[str, list[IntArray]] = {}
        for name in (self.name, *self.also):
            for kind, rows in _faces_of_group(mesh, name).items():
                found.setdefault(kind, []).append(rows)
        if isinstance(mesh, NodeCloud):  # groups of a node cloud hold the nodes of their faces
            return {kind: np.unique(np.concatenate(parts), axis=0) for kind, parts in found.items()}
        faces = mesh.cells if isinstance(mesh, ShellMesh) else mesh.faces
        kept = {kind: faces[kind][np.unique(np.concatenate(parts))] for kind, parts in found.items()}
        if isinstance(mesh, ShellMesh):
            return kept
        what = " and ".join(repr(name) for name in (self.name, *self.also))
        _require_on_solid(mesh, f"face group {what}", np.concatenate([f.ravel() for f in kept.values()]))
        return _complete(mesh, kept)


def _faces_of_group(mesh: Mesh | ShellMesh | NodeCloud, name: str) -> dict[str, IntArray]:
    """Return the faces of one group, by type."""
    is_shell = isinstance(mesh, ShellMesh)
    groups = mesh.cell_sets if isinstance(mesh, ShellMesh) else mesh.face_sets
    what = "group of cells" if is_shell else "face group"
    if name not in groups:
        other = _other_kind(mesh, name, "cell group" if is_shell else "face group")
        raise InterfaceError(f"no {what} {name!r}{other}{nearest(name, groups)}")
    rows = {kind: members for kind, members in groups[name].items() if members.size}
    if not rows:
        raise InterfaceError(f"{what} {name!r} is empty" + ("" if is_shell else f"; {_WHY_EMPTY}"))
    return rows


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class NodeSet:
    """The nodes of a named node set.

    Parameters
    ----------
    name
        Name of the set of nodes.
    """

    name: str

    def members(self, mesh: AnyMesh) -> IntArray:
        """Return the nodes of the set, ascending."""
        if self.name not in mesh.node_sets:
            raise InterfaceError(
                f"no node set {self.name!r}{_other_kind(mesh, self.name, 'node set')}"
                f"{nearest(self.name, mesh.node_sets)}"
            )
        nodes = np.unique(mesh.node_sets[self.name])
        if nodes.size == 0:
            raise InterfaceError(f"node set {self.name!r} is empty; {_WHY_EMPTY}")
        _require_on_solid(mesh, f"node set {self.name!r}", nodes)
        return nodes


@presented
@dataclass(frozen=True)
@checked_fields(ArgumentError)
class NodeNumbers:
    """Nodes selected by their numbers in the file.

    Parameters
    ----------
    numbers
        The user's numbers of the nodes.
    """

    numbers: tuple[int, ...]

    def members(self, mesh: AnyMesh) -> IntArray:
        """Return the nodes with these numbers, ascending."""
        wanted = np.unique(np.asarray(self.numbers, dtype=np.int64))
        known = mesh.node_numbers
        if wanted.size == 0:
            raise InterfaceError("node numbers: expected at least one, got none")
        if known.size == 0:
            raise InterfaceError(f"node numbers {_some(wanted)}: the mesh has no numbers; select by geometry")
        missing = wanted[~np.isin(wanted, known)]
        if missing.size:
            raise InterfaceError(
                f"node numbers {_some(missing)}: {missing.size} of {wanted.size} are not in the mesh, which has "
                f"{known.size} nodes from {known.min()} to {known.max()}"
            )
        nodes = np.flatnonzero(np.isin(known, wanted))
        _require_on_solid(mesh, f"node numbers {_some(wanted)}", nodes)
        return nodes


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Plane:
    """The surface nodes on a plane.

    Parameters
    ----------
    point
        Point of the plane, (3,) [m].
    normal
        Normal vector of any length.
    tolerance
        Largest distance from the plane [m]; None: 1e-6 of the diagonal of the bounding box.
    """

    point: Vector
    normal: Vector
    tolerance: float | None = None

    def members(self, mesh: AnyMesh) -> IntArray:
        """Return the surface nodes within the tolerance, ascending."""
        surface = candidates(mesh)
        normal = _unit("plane", "normal", self.normal)
        tolerance = _tolerance("plane", self.tolerance, 1e-6 * _diagonal(mesh))
        signed = (mesh.nodes[surface] - _point("plane", self.point)) @ normal
        found = surface[np.abs(signed) <= tolerance]
        if found.size == 0:
            raise InterfaceError(
                f"plane through {_text(self.point)} with normal {_text(self.normal)} has no surface "
                f"node within {tolerance:.3g}; the body lies between {signed.min():.6g} and "
                f"{signed.max():.6g} along the normal, the nearest node is "
                f"{np.abs(signed).min():.3g} away"
            )
        return found


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Cylinder:
    """The surface nodes on the curved surface of a cylinder.

    Parameters
    ----------
    point
        Point on the axis [m].
    axis
        Axis vector of any length.
    radius
        Radius [m].
    span
        Range along the axis from `point` [m]; None: no limit.
    tolerance
        Largest difference from the radius [m]; None: 1e-3 of the radius.
    """

    point: Vector
    axis: Vector
    radius: float
    span: tuple[float, float] | None = None
    tolerance: float | None = None

    def members(self, mesh: AnyMesh) -> IntArray:
        """Return the surface nodes within the tolerance, ascending.

        Middle nodes on straight edges of a coarse hole lie inside the cylinder by the sagitta; a larger tolerance
        selects them.
        """
        if not self.radius > 0:
            raise InterfaceError(f"cylinder: radius: expected a length above zero, got {self.radius}")
        surface = candidates(mesh)
        axis = _unit("cylinder", "axis", self.axis)
        tolerance = _tolerance("cylinder", self.tolerance, 1e-3 * self.radius)
        arm = mesh.nodes[surface] - _point("cylinder", self.point)
        along = arm @ axis
        off = np.abs(np.linalg.norm(arm - along[:, None] * axis, axis=1) - self.radius)
        low, high = self.span if self.span is not None else (-np.inf, np.inf)
        inside = (along >= low - tolerance) & (along <= high + tolerance)
        found = surface[(off <= tolerance) & inside]
        if found.size == 0:
            where = f"cylinder about {_text(self.point)} along {_text(self.axis)} with radius {self.radius:g}"
            if not inside.any():
                raise InterfaceError(
                    f"{where}: no surface node between {low:g} and {high:g} along the axis; the body "
                    f"lies between {along.min():.6g} and {along.max():.6g}"
                )
            raise InterfaceError(
                f"{where} has no surface node within {tolerance:.3g} of it; the nearest differs by "
                f"{off[inside].min():.3g}"
            )
        return found


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Box:
    """The surface nodes inside a box whose edges are parallel to the mesh axes.

    Parameters
    ----------
    lo
        Corner with the smallest coordinates, (3,) [m].
    hi
        Corner with the largest coordinates, (3,) [m].
    """

    lo: Vector
    hi: Vector

    def members(self, mesh: AnyMesh) -> IntArray:
        """Return the surface nodes inside the box, ascending; the box is enlarged by 1e-9 of the body size."""
        lo, hi = _point("box", self.lo), _point("box", self.hi)
        if (lo > hi).any():
            raise InterfaceError(f"box: expected lo <= hi, got {_text(self.lo)} and {_text(self.hi)}")
        surface = candidates(mesh)
        X = mesh.nodes[surface]
        slack = 1e-9 * _diagonal(mesh)
        found = surface[((lo - slack <= X) & (hi + slack >= X)).all(axis=1)]
        if found.size == 0:
            away = np.linalg.norm(np.maximum(np.maximum(lo - X, X - hi), 0), axis=1)
            raise InterfaceError(
                f"box from {_text(self.lo)} to {_text(self.hi)} contains no surface node; the body "
                f"lies from {_text(X.min(axis=0))} to {_text(X.max(axis=0))}, the nearest node is "
                f"{away.min():.3g} away"
            )
        return found


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class NearestNode:
    """The surface node nearest to a point.

    Parameters
    ----------
    point
        Point to which the node is nearest, (3,) [m].
    """

    point: Vector

    def members(self, mesh: AnyMesh) -> IntArray:
        """Return the selected node, (1,)."""
        surface = candidates(mesh)
        point = _point("nearest node", self.point)
        return surface[[int(np.linalg.norm(mesh.nodes[surface] - point, axis=1).argmin())]]


def candidates(mesh: AnyMesh) -> IntArray:
    """Return the nodes that geometric selections consider, ascending: surface nodes of a solid, else all nodes."""
    return boundary_nodes(mesh) if isinstance(mesh, Mesh) else np.arange(len(mesh.nodes))


def selected_facets(mesh: AnyMesh, selection: Selection) -> dict[str, IntArray]:
    """Return the facets of a selection by type: of a face group, or boundary facets with all nodes selected.

    The facets of a shell are its cells.
    """
    if isinstance(selection, FaceGroup):
        return selection.facets(mesh)
    if isinstance(mesh, (LineMesh, NodeCloud)):
        return {}
    chosen = np.zeros(len(mesh.nodes), dtype=bool)
    chosen[selection.members(mesh)] = True
    surface = boundary_facets(mesh) if isinstance(mesh, Mesh) else mesh.cells
    whole = {kind: facets[chosen[facets].all(axis=1)] for kind, facets in surface.items()}
    return {kind: facets for kind, facets in whole.items() if len(facets)}


def _complete(mesh: Mesh, faces: Mapping[str, IntArray]) -> dict[str, IntArray]:
    """Return the boundary facets with the same corners; the faces themselves unless all facets are found."""
    result: dict[str, list[IntArray]] = {}
    for kind, rows in faces.items():
        n_corners = CORNERS[kind]
        open_rows = np.sort(rows[:, :n_corners], axis=1)
        is_found = np.zeros(len(rows), dtype=bool)
        for facet_kind, facets in boundary_facets(mesh).items():
            if CORNERS[facet_kind] != n_corners:
                continue
            classes, _ = first_of_equal_rows(np.concatenate([open_rows, np.sort(facets[:, :n_corners], axis=1)]))
            mine, theirs = classes[: len(rows)], classes[len(rows) :]
            is_found |= np.isin(mine, theirs)
            result.setdefault(facet_kind, []).append(facets[np.isin(theirs, mine)])
        if not is_found.all():
            return dict(faces)
    joined = {kind: np.concatenate(parts) for kind, parts in result.items()}
    return {kind: rows for kind, rows in joined.items() if len(rows)}


def _require_on_solid(mesh: AnyMesh, what: str, nodes: IntArray) -> None:
    if not isinstance(mesh, Mesh):
        return
    loose = np.unique(nodes[~used_nodes(mesh)[nodes]])
    if loose.size:
        raise InterfaceError(
            f"{what}: {loose.size} of its nodes belong to no solid cell, first node {loose[0]}; "
            f"select nodes of the solid, or merge the coincident nodes of skin and solid"
        )


def _other_kind(mesh: AnyMesh, name: str, wanted: str) -> str:
    """Return a text if the name belongs to another kind of group."""
    if isinstance(mesh, LineMesh):
        return f" ({name!r} is a group of lines)" if name in mesh.line_sets else ""
    kinds = {"node set": mesh.node_sets} | ({} if isinstance(mesh, NodeCloud) else {"cell group": mesh.cell_sets})
    kinds |= {"line group": mesh.line_sets} if isinstance(mesh, ShellMesh) else {"face group": mesh.face_sets}
    others = [kind for kind, sets in kinds.items() if kind != wanted and name in sets]
    return f" ({name!r} is a {others[0]})" if others else ""


def _point(where: str, point: Vector) -> Array:
    array = np.asarray(point, dtype=float)
    if array.shape != (3,) or not np.isfinite(array).all():
        raise InterfaceError(f"{where}: expected three finite coordinates, got {point}")
    return array


def _unit(where: str, name: str, vector: Vector) -> Array:
    array = _point(f"{where}: {name}", vector)
    length = np.linalg.norm(array)
    if length == 0:
        raise InterfaceError(f"{where}: {name}: expected a direction, got the zero vector")
    return array / length


def _tolerance(where: str, tolerance: float | None, default: float) -> float:
    if tolerance is None:
        return default
    if not 0 <= tolerance < np.inf:
        raise InterfaceError(f"{where}: tolerance: expected a length of zero or more, got {tolerance}")
    return tolerance


def _diagonal(mesh: AnyMesh) -> float:
    return float(np.linalg.norm(np.ptp(mesh.nodes, axis=0)))


def _text(vector: Vector | Array) -> str:
    return f"({number_list(vector)})"


def _some(numbers: IntArray) -> str:
    return ", ".join(str(n) for n in numbers[:5]) + (", ..." if len(numbers) > 5 else "")
