"""Report of a frame: numbers and findings, before any solution."""

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from scipy.spatial import cKDTree

from fe_models.body.material import Material
from fe_models.body.unit_check import BodyNumbers, implausible_numbers
from fe_models.checks.report import Finding, Report
from fe_models.elements.beams.attachments import RigidLink, Spring
from fe_models.foundation.units import Units
from fe_models.meshes.line_mesh import LineMesh

__all__ = ["FrameReport", "report_frame"]

COINCIDENCE = 1e-6  #: distance of coincident nodes over the diagonal of the bounding box


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
    materials: Iterable[Material],
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
    ends = mesh.nodes[mesh.lines]
    size = float(np.linalg.norm(np.ptp(mesh.nodes, axis=0)))
    n = len(mesh.nodes)
    pairs = [mesh.lines, *[np.array([spring.nodes]) for spring in springs]]
    pairs += [np.array([(link.node, follower) for follower in link.followers]) for link in links]
    joined = np.concatenate(pairs)
    graph = sp.coo_array((np.ones(len(joined)), (joined[:, 0], joined[:, 1])), shape=(n, n))
    n_parts, part = sp.csgraph.connected_components(graph, directed=False)
    findings = []
    if n_parts > 1:
        first = [int(np.flatnonzero(part == k)[0]) for k in range(min(n_parts, 4))]
        findings.append(
            Finding(
                "parts",
                True,
                f"{n_parts} parts that no line, link or spring joins, with the nodes {', '.join(_names(mesh, first))}; "
                "merge coincident nodes, or accept parts that an interface holds together",
            )
        )
    close = cKDTree(mesh.nodes).query_pairs(COINCIDENCE * size) if size else set()
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
    numbers = BodyNumbers(size=size, materials=tuple(materials))
    findings += [Finding("units", is_error, text) for is_error, text in implausible_numbers(units, numbers)]
    length = float(np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1).sum())
    return FrameReport(mesh.source, units, n, len(mesh.lines), length, n_parts, tuple(findings))


def _names(mesh: LineMesh, nodes: Iterable[int]) -> list[str]:
    return [str(mesh.node_numbers[node] if mesh.node_numbers.size else node) for node in nodes]
