"""Report of a mesh: numbers and faults, before any solution."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache, partial
from math import nan
from types import MappingProxyType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from fe_models.body.material import AnyMaterial, assign_materials
from fe_models.body.unit_check import BodyNumbers, implausible_numbers
from fe_models.checks.first_order import FirstOrderError, first_order_error
from fe_models.checks.report import Finding, Report
from fe_models.errors import MeshError
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.units import Units, unit_system
from fe_models.meshes.cell_shapes import CELL_SHAPES, cell_jacobians, quadrature, shape_values
from fe_models.meshes.connectivity import Connectivity, coincident_nodes, connectivity
from fe_models.meshes.mesh import Mesh, used_nodes
from fe_models.meshes.objects.as_mesh import as_mesh
from fe_models.meshes.quadratic_mesh import FIRST_ORDER

__all__ = ["CellGeometry", "MeshReport", "face_angles", "report_mesh"]


# angles between neighbouring faces of solid cells; small or nearly straight angles make poor elements -----------------


_CHUNK = 20_000  #: number of cells processed at a time


def face_angles(mesh: Mesh) -> tuple[float, float]:
    """Return the smallest and the largest angle between two faces of a cell with a common edge [degrees].

    The angle is measured at both ends of every edge, between the straight edges to other corners. It is 70.5 for a
    regular tetrahedron and 90 for a cube. Both are NaN for a mesh without solid cells. Coincident corners count as
    angle 0.
    """
    smallest, largest = np.inf, -np.inf
    for kind, cells in mesh.cells.items():
        i, j, k, m = _corners(kind).T
        for begin in range(0, len(cells), _CHUNK):
            X = mesh.nodes[cells[begin : begin + _CHUNK]]
            edge = X[:, j] - X[:, i]
            first, second = np.cross(edge, X[:, k] - X[:, i]), np.cross(edge, X[:, m] - X[:, i])
            sine = np.linalg.norm(np.cross(first, second), axis=-1)
            cosine = (first * second).sum(axis=-1)
            angles = np.arctan2(sine, cosine)
            smallest, largest = min(smallest, float(angles.min())), max(largest, float(angles.max()))
    return (float(np.degrees(smallest)), float(np.degrees(largest))) if np.isfinite(smallest) else (np.nan, np.nan)


@cache
def _corners(kind: str) -> IntArray:
    """Return rows i, j, k, m, (n, 4): edge i-j, and the other neighbours of i on the two faces at this edge."""
    beside: dict[tuple[int, int], list[int]] = {}
    for facet in CELL_SHAPES[kind].facets:
        n = len(facet)
        for a in range(n):
            before, here, after = facet[a - 1], facet[a], facet[(a + 1) % n]
            beside.setdefault((here, after), []).append(before)
            beside.setdefault((here, before), []).append(after)
    return np.array([[i, j, *neighbours] for (i, j), neighbours in beside.items()])


# mesh report ----------------------------------------------------------------------------------------------------------


COINCIDENCE = 1e-6  #: distance of coincident nodes over the diagonal of the bounding box
FLAT = 1e-9  #: volume over the cube of the cell size, below which a cell is degenerate
ROUNDING = 1e-12  #: Jacobian over its mean, below which it counts as zero
FIRST_ORDER_NOTED = 0.02  #: error of the lowest frequencies due to first-order cells above which a warning is given
UNMEASURABLE = {"inverted", "degenerate", "overlap", "transition"}  #: errors that prevent the computation of modes


@dataclass(frozen=True, eq=False)
class CellGeometry:
    """Volumes and Jacobians of the cells of one type."""

    volume: Array  #: volume of each cell, (n_cells,) [m³]
    moment: Array  #: first moment ∫ x dV of each cell, (n_cells, 3) [m⁴]
    lowest_inside: Array  #: smallest Jacobian at the integration points over the mean magnitude, (n_cells,)
    lowest_at_nodes: Array  #: smallest Jacobian at the nodes over the mean magnitude, (n_cells,)
    flatness: Array  #: volume over the cube of the largest extent, (n_cells,)


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class MeshReport(Report):
    """Numbers of a mesh, and findings.

    Parameters
    ----------
    source
        The file, or how the mesh was made.
    units
        Unit system of the numbers.
    n_nodes
        Number of nodes of solid cells.
    n_unused_nodes
        Number of nodes that belong to no solid cell.
    n_cells
        Number of cells by type.
    lo
        Lower corner of the bounding box of the used nodes, (3,) [m].
    hi
        Upper corner of the bounding box, (3,) [m].
    volume
        Volume of the cells [m³].
    mass
        Mass of the cells [kg]; None: no material was given.
    mass_centre
        Centre of mass, (3,) [m].
    n_parts
        Number of parts without a common node.
    part_cells
        Number of cells of each part, largest first.
    n_coincident
        Number of nodes that coincide with another node.
    inverted
        Rows of cells with a Jacobian <= 0 at an integration point, by type.
    degenerate
        Rows of cells without volume, by type.
    distorted
        Rows of cells with a Jacobian <= 0 at a node only, by type.
    findings
        Faults of the mesh, and doubts about it.
    first_order
        Error of the lowest frequencies due to first-order cells; None: there are none, or it was not measured.
    origin
        Origin of the mesh by label, such as the size of a geometry; see `Mesh.origin`.
    angles
        Smallest and largest angle between neighbouring faces of a cell [degrees].
    lowest_jacobian
        Smallest Jacobian of a cell divided by its mean, at integration points and nodes; 1 is best.
    """

    source: str
    units: Units
    n_nodes: int
    n_unused_nodes: int
    n_cells: Mapping[str, int]
    lo: Array
    hi: Array
    volume: float
    mass: float | None
    mass_centre: Array | None
    n_parts: int
    part_cells: tuple[int, ...]
    n_coincident: int
    inverted: Mapping[str, IntArray]
    degenerate: Mapping[str, IntArray]
    distorted: Mapping[str, IntArray]
    findings: tuple[Finding, ...]
    first_order: FirstOrderError | None = None
    origin: Mapping[str, str] = field(default_factory=dict)
    angles: tuple[float, float] = (nan, nan)
    lowest_jacobian: float = nan

    def numbers(self) -> list[tuple[str, str]]:
        """Return label and value of each number, as text."""
        length, mass = self.units.length_symbol, self.units.mass_symbol
        cells = ", ".join(f"{count} {kind}" for kind, count in self.n_cells.items())
        rows = [
            ("file", self.source),
            *self.origin.items(),
            ("nodes", f"{self.n_nodes}" + (f" ({self.n_unused_nodes} unused)" if self.n_unused_nodes else "")),
            ("cells", cells),
            ("bounding box", f"{_vector(self.lo)} to {_vector(self.hi)} {length}"),
            ("size", f"{_vector(self.hi - self.lo)} {length}"),
            ("volume", f"{self.volume:.6g} {length}³"),
        ]
        if self.mass is not None and self.mass_centre is not None:
            rows.append(("mass", f"{self.mass:.6g} {mass}"))
            rows.append(("centre of mass", f"{_vector(self.mass_centre)} {length}"))
        rows.append(("angles of the cells", f"{self.angles[0]:.3g} to {self.angles[1]:.3g} degrees"))
        rows.append(("least Jacobian over mean", f"{self.lowest_jacobian:.3g}"))
        rows.append(("connected parts", str(self.n_parts)))
        if self.n_coincident:
            rows.append(("coincident nodes", str(self.n_coincident)))
        return rows


def report_mesh(
    mesh: Any,
    materials: AnyMaterial | Mapping[str, AnyMaterial] | None = None,
    *,
    units: Units | str = "m-kg-s",
    incompatible_modes: bool = False,
) -> MeshReport:
    """Measure a mesh, and check whether it is usable as a finite element model.

    Parameters
    ----------
    mesh
        The mesh, of this package or of another library (`fe_models.meshes.as_mesh`).
    materials
        One material, or one for each group of cells; None: no mass is computed, and density and modulus are not
        checked.
    units
        Unit system of the numbers.
    incompatible_modes
        Whether eight-node bricks will have incompatible modes, as in `solid_body`.

    Raises
    ------
    MaterialError
        If a material names an unknown group, or cells have no material or two materials.
    """
    mesh = as_mesh(mesh)
    units = unit_system(units) if isinstance(units, str) else units
    used = used_nodes(mesh)
    if not used.any():
        raise MeshError(f"mesh {mesh.source}: expected solid cells, got none")
    X = mesh.nodes[used]
    lo, hi = X.min(axis=0), X.max(axis=0)
    size = float(np.linalg.norm(hi - lo))
    geometry = {}
    for kind, cells in mesh.cells.items():
        measure = _measure_tetra10 if kind == "tetra10" else partial(_measure, kind)
        parts = [measure(mesh.nodes[cells[start : start + _CHUNK]]) for start in range(0, len(cells), _CHUNK)]
        geometry[kind] = CellGeometry(*(frozen(np.concatenate(part)) for part in zip(*parts, strict=True)))
    findings = []
    degenerate = _select(geometry, lambda g: g.flatness <= FLAT)
    inverted = _select(geometry, lambda g: (g.lowest_inside <= ROUNDING) & (g.flatness > FLAT))
    distorted = _select(geometry, lambda g: (g.lowest_inside > ROUNDING) & (g.lowest_at_nodes <= ROUNDING))
    findings += _cell_findings(mesh, inverted, degenerate, distorted)
    links = connectivity(mesh)
    coincident = coincident_nodes(mesh, COINCIDENCE * size)
    findings += _link_findings(links, coincident, mesh)
    n_unused = int((~used).sum())
    if n_unused:
        findings.append(Finding("unused", False, f"{n_unused} nodes belong to no solid cell and will be dropped"))
    findings += [Finding("reader", False, note) for note in mesh.notes]
    mass = centre = None
    given: tuple[AnyMaterial, ...] = ()
    if materials is not None:
        given, number = assign_materials(mesh, materials)
        rho = np.array([material.rho for material in given])
        mass = sum(float(rho[number[kind]] @ g.volume) for kind, g in geometry.items())
        moment = sum((rho[number[kind]] @ g.moment for kind, g in geometry.items()), np.zeros(3))
        centre = moment / mass if mass else moment
    first_order = _first_order(mesh, materials, incompatible_modes, findings)
    if first_order is not None and first_order.error > FIRST_ORDER_NOTED:
        findings.append(Finding("first-order", False, first_order.description()))
    numbers = BodyNumbers(size=size, materials=tuple(given))
    findings += [Finding("units", is_error, text) for is_error, text in implausible_numbers(units, numbers)]
    return MeshReport(
        source=mesh.source,
        units=units,
        n_nodes=int(used.sum()),
        n_unused_nodes=n_unused,
        n_cells=MappingProxyType({kind: len(cells) for kind, cells in mesh.cells.items()}),
        lo=frozen(lo),
        hi=frozen(hi),
        volume=float(sum(g.volume.sum() for g in geometry.values())),
        mass=mass,
        mass_centre=None if centre is None else frozen(centre),
        n_parts=len(links.part_cells),
        part_cells=links.part_cells,
        n_coincident=coincident.size,
        inverted=inverted,
        degenerate=degenerate,
        distorted=distorted,
        findings=tuple(findings),
        first_order=first_order,
        origin=mesh.origin,
        angles=face_angles(mesh),
        lowest_jacobian=min(float(min(g.lowest_inside.min(), g.lowest_at_nodes.min())) for g in geometry.values()),
    )


def _first_order(
    mesh: Mesh,
    materials: AnyMaterial | Mapping[str, AnyMaterial] | None,
    incompatible_modes: bool,
    findings: list[Finding],
) -> FirstOrderError | None:
    """Return the error due to first-order cells.

    None if some cells are of second order, if all are bricks with incompatible modes, or if cells are too bad to be
    raised to second order.
    """
    kinds = {kind for kind, cells in mesh.cells.items() if len(cells)}
    if not kinds <= set(FIRST_ORDER) or (incompatible_modes and kinds == {"hexahedron"}):
        return None
    if UNMEASURABLE & {finding.kind for finding in findings if finding.is_error}:
        return None
    try:
        return first_order_error(mesh, materials, incompatible_modes=incompatible_modes)
    except MeshError:
        return None


def _measure(kind: str, X: Array) -> tuple[Array, ...]:
    """Compute the fields of `CellGeometry` for cells with node positions X, (n_cells, n_nodes, 3)."""
    points, weights = quadrature(kind)
    N, _ = shape_values(kind, points)
    jacobians = cell_jacobians(kind, X, np.vstack([points, CELL_SHAPES[kind].nodes]))
    inside = jacobians[:, : len(points)]
    size = np.abs(inside) @ weights  # volume with the absolute value of the Jacobian
    mean = np.where(size > 0, size, 1.0) / weights.sum()
    extent = (X.max(axis=1) - X.min(axis=1)).max(axis=1)
    return (
        inside @ weights,
        np.einsum("en,end->ed", (inside * weights) @ N, X),
        inside.min(axis=1) / mean,
        jacobians[:, len(points) :].min(axis=1) / mean,
        size / np.where(extent > 0, extent, 1.0) ** 3,
    )


def _measure_tetra10(X: Array) -> tuple[Array, ...]:
    """Measure ten-node tetrahedra; those with straight edges (usually most) only by their corners."""
    middles = np.array(CELL_SHAPES["tetra10"].middles)
    extent = (X.max(axis=1) - X.min(axis=1)).max(axis=1)
    bend = np.abs(2 * X[:, 4:] - X[:, middles[:, 0]] - X[:, middles[:, 1]]).max(axis=(1, 2))
    curved = bend > ROUNDING * extent
    fields = _measure("tetra", X[:, :4])
    if curved.any():
        for straight, exact in zip(fields, _measure("tetra10", X[curved]), strict=True):
            straight[curved] = exact
    return fields


def _select(
    geometry: Mapping[str, CellGeometry], test: Callable[[CellGeometry], NDArray[np.bool_]]
) -> Mapping[str, IntArray]:
    chosen = {kind: frozen(np.flatnonzero(test(g)), np.int64) for kind, g in geometry.items()}
    return MappingProxyType({kind: rows for kind, rows in chosen.items() if rows.size})


def _cell_findings(
    mesh: Mesh,
    inverted: Mapping[str, IntArray],
    degenerate: Mapping[str, IntArray],
    distorted: Mapping[str, IntArray],
) -> list[Finding]:
    findings = []
    if inverted:
        everything = sum(len(rows) for rows in inverted.values()) == mesh.n_cells
        hint = (
            "all cells are inside out: the mesh is mirrored, reverse their node order"
            if everything
            else "mesh again there, or move their middle nodes"
        )
        findings.append(
            Finding(
                "inverted", True, f"{_listed(mesh, inverted)} inverted (Jacobian <= 0 at an integration point); {hint}"
            )
        )
    if degenerate:
        findings.append(
            Finding(
                "degenerate",
                True,
                f"{_listed(mesh, degenerate)} degenerate (without volume); remove them or mesh again there",
            )
        )
    if distorted:
        findings.append(
            Finding(
                "distorted",
                False,
                f"{_listed(mesh, distorted)} distorted: the Jacobian is <= 0 at a "
                f"node, though not where it is integrated",
            )
        )
    return findings


def _listed(mesh: Mesh, chosen: Mapping[str, IntArray]) -> str:
    """Return a text such as '3 tetra10 cells (numbers 5, 8, 12) are'."""
    parts = []
    for kind, rows in chosen.items():
        numbers = mesh.cell_numbers[kind][rows[:5]] if kind in mesh.cell_numbers else rows[:5]
        first = ", ".join(str(number) for number in numbers)
        at = _vector(mesh.nodes[mesh.cells[kind][rows[0]]].mean(axis=0))
        parts.append(
            f"{rows.size} {kind} cells ({'numbers' if kind in mesh.cell_numbers else 'rows'} {first}"
            f"{', ...' if rows.size > 5 else ''}; the first at {at})"
        )
    return " and ".join(parts) + " are"


def _link_findings(links: Connectivity, coincident: IntArray, mesh: Mesh) -> list[Finding]:
    findings = []
    merge = f"; {coincident.size} nodes coincide with another: merge them" if coincident.size else ""
    if len(links.part_cells) > 1:
        shown = ", ".join(
            f"{count} cells about {_vector(mesh.nodes[node])}"
            for count, node in zip(links.part_cells[:5], links.part_node, strict=False)
        )
        findings.append(
            Finding(
                "parts",
                True,
                f"the mesh falls into {len(links.part_cells)} parts that are not "
                f"connected ({shown}); expected one body{merge}",
            )
        )
    elif coincident.size:
        findings.append(
            Finding(
                "coincident",
                False,
                f"{coincident.size} nodes coincide with another (first: node "
                f"{coincident[0]} at {_vector(mesh.nodes[coincident[0]])}): the "
                f"mesh has a gap there, unless it is intended; merge them",
            )
        )
    if links.n_facet_parts > len(links.part_cells):
        findings.append(
            Finding(
                "hinge",
                False,
                f"{links.n_facet_parts} pieces share no facet with the rest and are "
                f"connected by single nodes or edges, which may act as hinges",
            )
        )
    if links.n_overlapping:
        findings.append(
            Finding(
                "overlap",
                True,
                f"{links.n_overlapping} facets belong to more than two cells: cells overlap; remove the doubled ones",
            )
        )
    if links.n_mismatched:
        findings.append(
            Finding(
                "transition",
                True,
                f"{links.n_mismatched} facets join cells with different middle "
                f"nodes (linear next to quadratic): their middle nodes are "
                f"unconnected; use one order",
            )
        )
    if links.n_transitions:
        findings.append(
            Finding(
                "tetra-on-quad",
                False,
                f"{links.n_transitions} quadrilateral facets carry triangles "
                f"of other cells: displacements gape there; use one type",
            )
        )
    return findings


def _vector(x: Array) -> str:
    return f"({', '.join(f'{value:.5g}' for value in x)})"
