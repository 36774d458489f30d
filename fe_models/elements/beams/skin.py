"""Skin of a frame: section outlines swept along the lines. Its nodes are drawn and have the section stress."""

from dataclasses import dataclass

import numpy as np

from fe_models.elements.beams.axes import LineGeometry
from fe_models.elements.beams.section_properties import SectionProperties
from fe_models.foundation.arrays import Array, IntArray, frozen

__all__ = ["Skin", "make_skin"]

SAME = 1e-9  #: relative tolerance for ends and axes of two lines to count as continuous


@dataclass(frozen=True, eq=False)
class Skin:
    """Rings of section points at the ends of the lines. Continuous lines share a ring."""

    points: Array  #: positions of the skin points, (n_skin, 3) [m]
    mover: IntArray  #: mesh node that each point follows rigidly, (n_skin,)
    triangles: IntArray  #: triangles between points, normals outward, (n_tri, 3)
    line_of: IntArray  #: line of each triangle, (n_tri,)
    ring_start: IntArray  #: index of the first point of the ring at both ends of each line, (n_lines, 2)


def make_skin(
    nodes: Array, lines: IntArray, geometry: LineGeometry, of_line: IntArray, sections: tuple[SectionProperties, ...]
) -> Skin:
    """Sweep the outlines along the lines.

    Parameters
    ----------
    nodes, lines
        Nodes and lines of the mesh, (n_nodes, 3) and (n_lines, 2).
    geometry
        Ends and axes of the lines.
    of_line
        Section of each line, (n_lines,).
    sections
        Sections with their outlines.
    """
    size = float(np.linalg.norm(np.ptp(nodes, axis=0))) or 1.0
    rings: dict[
        tuple[int, int], list[tuple[Array, Array, int, int]]
    ] = {}  # line ends without continuation so far, by (node, section)
    points, mover, triangles = [], [], []
    line_of: list[IntArray] = []
    start = np.zeros((len(lines), 2), np.int64)
    uses: dict[int, list[tuple[int, int]]] = {}
    n_points = 0
    for line, (pair, section) in enumerate(zip(lines, of_line, strict=True)):
        outline = sections[section].points
        for end, node in enumerate(pair):
            X, R = geometry.ends[line, end], geometry.R[line]
            open_rings = rings.setdefault((int(node), int(section)), [])
            match = next(
                (
                    place
                    for place, (X_other, R_other, other_end, _) in enumerate(open_rings)
                    if other_end != end
                    and np.abs(X - X_other).max() <= SAME * size
                    and np.abs(R - R_other).max() <= SAME
                ),
                None,
            )
            if match is None:
                first = n_points
                points.append(X + outline @ R[:, 1:].T)
                mover.append(np.full(len(outline), node))
                n_points += len(outline)
                open_rings.append((X, R, end, first))
            else:
                first = open_rings.pop(match)[3]
            start[line, end] = first
            uses.setdefault(first, []).append((line, end))
        for loop, turn in zip(sections[section].loops, (1, *[-1] * len(sections[section].loops)), strict=False):
            triangles.append(_side(start[line], loop, turn))
            line_of.append(np.full(len(triangles[-1]), line))
    for first, ends in uses.items():
        if len(ends) == 1:  # a line without continuation here is closed by a cap
            line, end = ends[0]
            cap = sections[of_line[line]].cap + first
            triangles.append(cap if end == 1 else cap[:, ::-1])
            line_of.append(np.full(len(cap), line))
    return Skin(
        frozen(np.concatenate(points) if points else np.zeros((0, 3))),
        frozen(np.concatenate(mover) if mover else np.zeros(0), np.int64),
        frozen(np.concatenate(triangles) if triangles else np.zeros((0, 3)), np.int64),
        frozen(np.concatenate(line_of) if line_of else np.zeros(0), np.int64),
        frozen(start, np.int64),
    )


def _side(start: IntArray, loop: IntArray, turn: int) -> IntArray:
    """Return the triangles between two rings of a loop; turn = -1 is a hole, whose normals point inward."""
    a, b = start[0] + loop, start[1] + loop
    a_next, b_next = np.roll(a, -1), np.roll(b, -1)
    side = np.concatenate([np.stack([a, a_next, b_next], axis=1), np.stack([a, b_next, b], axis=1)])
    return side if turn == 1 else side[:, ::-1]
