"""Reports of meshes of shells and of lines: numbers and findings, before any solution."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from fe_models.body.material import AnyMaterial
from fe_models.body.unit_check import BodyNumbers, implausible_numbers
from fe_models.checks.report import Finding, Report
from fe_models.elements.beams.attachments import RigidLink, Spring
from fe_models.elements.shells.quality import WARP_LIMIT, cell_quality
from fe_models.elements.shells.skin import cell_edges
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.units import Units
from fe_models.meshes.line_mesh import LineMesh
from fe_models.meshes.objects.as_mesh import as_shell_mesh
from fe_models.meshes.shell_mesh import ShellMesh

__all__ = ["FrameReport", "ShellReport", "report_frame", "report_shell"]

COINCIDENCE = 1e-6  #: distance of coincident nodes over the diagonal of the bounding box
WARP_NOTED = 10.0  #: angle between the two halves of a quad above which a warning is given [degree]
ASPECT_NOTED = 20.0  #: ratio of longest to shortest side above which a warning is given


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class ShellReport(Report):
    """Numbers of a shell mesh, and findings.

    Parameters
    ----------
    source
        The file, or how the mesh was made.
    units
        Unit system of the numbers.
    n_nodes
        Number of nodes.
    n_cells
        Number of cells by type.
    n_lines
        Number of stiffener lines.
    area
        Area of the cells [m²].
    warp
        Largest warp of all quads [degree].
    n_parts
        Number of parts that are not joined by a cell, stiffener, link or spring.
    n_free_edges
        Number of edges that belong to one cell only.
    findings
        Faults of the mesh, and doubts about it.
    """

    source: str
    units: Units
    n_nodes: int
    n_cells: dict[str, int]
    n_lines: int
    area: float
    warp: float
    n_parts: int
    n_free_edges: int
    findings: tuple[Finding, ...]

    def numbers(self) -> list[tuple[str, str]]:
        """Return label and value of each number, as text."""
        length = self.units.length_symbol
        return [
            ("file", self.source),
            ("nodes", str(self.n_nodes)),
            *[(f"cells {kind}", str(count)) for kind, count in self.n_cells.items()],
            ("lines of stiffeners", str(self.n_lines)),
            ("area", f"{self.area:.6g} {length}²"),
            ("largest warp of a quad", f"{self.warp:.3g} degrees"),
            ("free edges", str(self.n_free_edges)),
            ("connected parts", str(self.n_parts)),
        ]


def report_shell(
    mesh: Any,
    materials: Iterable[AnyMaterial],
    *,
    units: Units,
    springs: Iterable[Spring] = (),
    links: Iterable[RigidLink] = (),
) -> ShellReport:
    """Measure a shell, and check its cells, its connection and the plausibility of its units.

    Parameters
    ----------
    mesh
        Nodes, cells, and lines of stiffeners.
    materials
        Materials of cells and stiffeners.
    units
        Declared unit system.
    springs, links
        Springs and rigid links, which also join parts.
    """
    mesh = as_shell_mesh(mesh)
    findings, area, warp = _judge_cells(mesh)
    edges = cell_edges(tuple(mesh.cells.values()))
    part, found = _parts(mesh, [edges.nodes, mesh.lines], "cell, stiffener", springs, links)
    findings += found
    size, close = _coincident(mesh.nodes)
    if close:
        pair = min(close)
        findings.append(
            Finding(
                "coincident",
                False,
                f"{len(close)} pairs of nodes lie at one place, first {' and '.join(_names(mesh, pair))}; merge them "
                "unless a slit is intended",
            )
        )
    flips = (edges.nodes[edges.first] == edges.nodes[edges.second]).all(axis=1)
    if flips.any():
        nodes = _names(mesh, edges.nodes[edges.first[flips][0]])
        findings.append(
            Finding(
                "normals",
                False,
                f"the normal changes sides at {int(flips.sum())} edges, first between nodes {' and '.join(nodes)}: "
                "top, bottom, offset and pressure change sides there; give the cells one sense (orient_normals), "
                "unless the walls are intended like this",
            )
        )
    findings += _units(units, size, materials)
    return ShellReport(
        mesh.source,
        units,
        len(mesh.nodes),
        {kind: len(cells) for kind, cells in mesh.cells.items()},
        len(mesh.lines),
        area,
        warp,
        int(part.max()) + 1,
        int((edges.count == 1).sum()),
        tuple(findings),
    )


def _judge_cells(mesh: ShellMesh) -> tuple[list[Finding], float, float]:
    """Return findings about single cells, the total area, and the largest warp angle."""
    findings = []
    area = warp = 0.0
    for kind, cells in mesh.cells.items():
        if not len(cells):
            continue
        quality = cell_quality(mesh.nodes, cells)
        area += float(quality.area.sum())
        warp = max(warp, float(quality.warp.max()))
        is_sound = ~quality.is_degenerate & ~quality.is_folded
        for word, is_error, is_found, text in (
            ("degenerate", True, quality.is_degenerate, "have no area; merge their nodes and remove them"),
            (
                "inverted",
                True,
                quality.is_folded,
                "are folded: an inner angle of 180 degrees or more; move their nodes",
            ),
            (
                "warped",
                True,
                is_sound & (quality.warp > WARP_LIMIT),
                f"are warped beyond {WARP_LIMIT:g} degrees, by up to {quality.warp.max():.3g}; split them into "
                "triangles, or mesh finer",
            ),
            (
                "warped",
                False,
                is_sound & (quality.warp > WARP_NOTED) & (quality.warp <= WARP_LIMIT),
                f"are warped by more than {WARP_NOTED:g} degrees; a finer mesh is more exact there",
            ),
            (
                "aspect",
                False,
                is_sound & (quality.aspect > ASPECT_NOTED),
                f"have sides in a ratio above {ASPECT_NOTED:g}, up to {quality.aspect.max():.3g}",
            ),
        ):
            rows = np.flatnonzero(is_found)
            if rows.size:
                first = mesh.cell_name(kind, rows[0])
                findings.append(Finding(word, is_error, f"{rows.size} {kind} cells {text} (first {first})"))
    return findings, area, warp


@dataclass(frozen=True, eq=False)
class FrameReport(Report):
    """Numbers of a mesh of lines, and findings."""

    source: str
    units: Units
    n_nodes: int
    n_lines: int
    length: float  #: total length of all lines [m]
    n_parts: int  #: number of parts that no line, link or spring connects
    findings: tuple[Finding, ...]

    def numbers(self) -> list[tuple[str, str]]:
        """Return label and value of each number, as text."""
        return [
            ("file", self.source),
            ("nodes", str(self.n_nodes)),
            ("lines", str(self.n_lines)),
            ("length of all lines", f"{self.length:.6g} {self.units.length_symbol}"),
            ("connected parts", str(self.n_parts)),
        ]


def report_frame(
    mesh: LineMesh,
    materials: Iterable[AnyMaterial],
    *,
    units: Units,
    springs: Iterable[Spring] = (),
    links: Iterable[RigidLink] = (),
) -> FrameReport:
    """Measure a frame, and check whether it is connected and whether its units are plausible.

    Parameters
    ----------
    mesh
        Nodes and lines.
    materials
        Materials of the sections.
    units
        Declared unit system.
    springs, links
        Springs and rigid links, which also join parts.
    """
    part, findings = _parts(mesh, [mesh.lines], "line", springs, links)
    size, close = _coincident(mesh.nodes)
    apart = [pair for pair in close if part[pair[0]] != part[pair[1]]]
    if apart:
        findings.append(
            Finding(
                "coincident",
                False,
                f"{len(apart)} pairs of nodes of different parts lie at one place, first "
                f"{' and '.join(_names(mesh, apart[0]))}; merge them if the parts are one",
            )
        )
    findings += _units(units, size, materials)
    ends = mesh.nodes[mesh.lines]
    length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
    n_parts = int(part.max()) + 1
    return FrameReport(mesh.source, units, len(mesh.nodes), len(mesh.lines), length, n_parts, tuple(findings))


def _parts(
    mesh: ShellMesh | LineMesh, pairs: list[IntArray], what: str, springs: Iterable[Spring], links: Iterable[RigidLink]
) -> tuple[IntArray, list[Finding]]:
    """Return the part of each node, from 0, and the finding if there are several.

    Parameters
    ----------
    pairs
        Nodes that belong together, (n, 2) each.
    what
        Elements that join nodes, for the message.
    """
    pairs = [*pairs, *[np.array([spring.nodes]) for spring in springs]]
    pairs += [np.array([(link.node, follower) for follower in link.followers]) for link in links]
    joined, n = np.concatenate(pairs), len(mesh.nodes)
    graph = sp.coo_array((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(n, n))
    n_parts, part = sp.csgraph.connected_components(graph, directed=False)
    if n_parts == 1:
        return part, []
    first = [int(np.flatnonzero(part == k)[0]) for k in range(min(n_parts, 4))]
    words = (
        f"{n_parts} parts that no {what}, link or spring joins, with the nodes {', '.join(_names(mesh, first))}; "
        "merge coincident nodes, or accept parts that an interface holds together"
    )
    return part, [Finding("parts", True, words)]


def _units(units: Units, size: float, materials: Iterable[AnyMaterial]) -> list[Finding]:
    """Return the findings about implausible numbers."""
    numbers = BodyNumbers(size=size, materials=tuple(materials))
    return [Finding("units", is_error, text) for is_error, text in implausible_numbers(units, numbers)]


def _names(mesh: ShellMesh | LineMesh, nodes: Iterable[int]) -> list[str]:
    return [str(mesh.node_numbers[node] if mesh.node_numbers.size else node) for node in nodes]


def _coincident(nodes: Array) -> tuple[float, set[tuple[int, int]]]:
    """Return the length of the diagonal of the nodes, and the pairs of nodes that lie at one place."""
    size = float(np.linalg.norm(np.ptp(nodes, axis=0)))
    return size, cKDTree(nodes).query_pairs(COINCIDENCE * size) if size else set()
