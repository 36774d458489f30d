"""Assignment of model nodes to measured points: by number, by position, or manually."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import cKDTree

from cms.assessment.correlation.errors import CorrelationError
from cms.assessment.correlation.measured import MeasuredModes
from cms.assessment.correlation.model_modes import ModelModes
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["Placement", "PointPairs", "pair_points"]

TOLERANCE = 0.02  #: largest distance between a node and its point, divided by the size of the model


@dataclass(frozen=True)
class Placement:
    """Position of the test axes in the mesh, and the assignment of points to nodes."""

    origin: tuple[float, float, float] = (0.0, 0.0, 0.0)  #: origin of the test in the mesh [length of the model]
    #: axes of the test in mesh axes
    axes: tuple[tuple[float, float, float], ...] = ((1.0, 0, 0), (0, 1.0, 0), (0, 0, 1.0))
    nodes: Mapping[int, int | str] = field(default_factory=dict)  #: node number of each manually assigned point
    match: str = "place"  #: "place": the nearest node; "number": the node with the number of the point
    tolerance: float = TOLERANCE

    def __post_init__(self) -> None:
        rows = np.array(self.axes, dtype=float)
        if rows.shape != (3, 3) or np.abs(rows @ rows.T - np.eye(3)).max() > 1e-6 or np.linalg.det(rows) < 0:
            raise CorrelationError(f"axes of the test: expected three right-handed unit vectors, got {self.axes}")
        if self.match not in ("place", "number"):
            raise CorrelationError(f'match: expected "place" or "number", got {self.match!r}')
        if not 0 < self.tolerance < np.inf:
            raise CorrelationError(f"tolerance: expected a share above 0, got {self.tolerance!r}")


@dataclass(frozen=True, eq=False)
class PointPairs:
    """Node and direction of each measured row."""

    rows: IntArray  #: index of the node of each row, (n_rows,)
    directions: Array  #: direction of each row in mesh axes, (n_rows, 3)
    points: IntArray  #: distinct measured points, (n_points,)
    nodes: tuple[str, ...]  #: name of the node of each point
    distances: Array  #: distance between point and node, NaN if the test has no positions, (n_points,)
    size: float  #: size of the model, by which distances are judged


def pair_points(measured: MeasuredModes, model: ModelModes, placement: Placement | None = None) -> PointPairs:
    """Find the node of every measured point.

    Raises
    ------
    CorrelationError
        If a node is missing, a point is too far from every node, or two points have the same node.
    """
    placement = placement or Placement()
    A = np.array(placement.axes, dtype=float).T
    points, first, inverse = np.unique(measured.points, return_index=True, return_inverse=True)
    places = np.array(placement.origin) + measured.places[first] @ A.T
    unknown = [point for point in placement.nodes if point not in points]
    if unknown:
        raise CorrelationError(f"nodes: the test has no point {unknown[0]}; it has {len(points)}, {listed(points)}")
    by_hand = np.array([int(point) in placement.nodes for point in points])
    found = np.full(len(points), -1, np.int64)
    for k, point in enumerate(points.tolist()):
        if by_hand[k] or placement.match == "number":
            found[k] = node_of(model, placement.nodes.get(point, point), f"measured point {point}")
    rest = np.flatnonzero(found < 0)
    if len(rest):
        if np.isnan(places[rest]).any():
            raise CorrelationError(
                f'measured point {points[rest[0]]}: has no position; give match = "number", or its node by hand'
            )
        found[rest] = cKDTree(model.nodes).query(places[rest])[1]
    away = np.linalg.norm(places - model.nodes[found], axis=1)
    far = np.flatnonzero(~by_hand & (away > placement.tolerance * model.size))
    if len(far):
        worst = far[np.argmax(away[far])]
        raise CorrelationError(
            f"{len(far)} of {len(points)} measured points have no node within {placement.tolerance:g} of the size "
            f"{model.size:.4g} of the model; the farthest is point {points[worst]}, {away[worst]:.4g} away from node "
            f"{model.numbering.node_name(int(found[worst]))}. Check length unit, origin and axes of the test; or "
            "give its node by hand, or a larger tolerance"
        )
    same, counts = np.unique(found, return_counts=True)
    if (counts > 1).any():
        node = same[np.argmax(counts)]
        twice = points[found == node]
        raise CorrelationError(
            f"measured points {listed(twice)} are all nearest to node {model.numbering.node_name(int(node))}; give "
            "their nodes by hand, or leave all but one out"
        )
    names = tuple(model.numbering.node_name(int(row)) for row in found)
    return PointPairs(found[inverse], measured.directions @ A.T, points, names, away, model.size)


def node_of(model: ModelModes, node: int | str, where: str) -> int:
    """Return the index of the node with a given number; the number is the index if the model has no numbers."""
    if not model.numbering.nodes.size:
        if not isinstance(node, int) or not 0 <= node < len(model.nodes):
            raise CorrelationError(f"{where}: the nodes of the model have no numbers; expected an index, got {node!r}")
        return node
    return int(model.numbering.rows_of_node(where, node)[0])


def listed(numbers: IntArray) -> str:
    """Return the first numbers of a list as text."""
    shown = ", ".join(str(number) for number in numbers[:5])
    return f"{shown}, ..." if len(numbers) > 5 else shown
