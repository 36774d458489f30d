"""Places of a body at which its motion and stress are observed: interfaces, nodes by number, positions, stress points."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.reduced_body.reduced_body import ReducedBody
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.checked_values import array_of_shape
from floatframe.errors import ModelError

__all__ = ["QUANTITIES", "Observed", "Place", "found_place", "six_rows"]

QUANTITIES = ("acceleration", "displacement", "stress")
WAYS = ("interface", "node", "position", "point")
NEAR = 1e-3  #: distance from a position to its node, by the size of the body, above which it is another place


@dataclass(frozen=True, eq=False)
class Observed:
    """A place at which something is observed; one of interface, node, position and point says where.

    The displacement is relative to the (first) base; the stress has its components in mesh axes.
    """

    name: str
    interface: str | None = None
    node: int | None = None  #: number of a kept node
    position: Array | Sequence[float] | None = None  #: mesh coordinates of a kept node, (3,) [m]
    point: str | None = None  #: stress point of the file, by name
    quantities: tuple[str, ...] = ()  #: of QUANTITIES; (): acceleration, at stress points stress

    def __post_init__(self) -> None:
        where = f"shake: output {self.name!r}"
        ways = [way for way in WAYS if getattr(self, way) is not None]
        if len(ways) != 1:
            raise ModelError(f"{where}: expected one of {', '.join(WAYS)}, got {', '.join(ways) or 'none'}")
        if self.position is not None:
            object.__setattr__(self, "position", array_of_shape(f"{where}: position", self.position, (3,)))
        wanted = (self.quantities,) if isinstance(self.quantities, str) else tuple(self.quantities)
        for name in wanted:
            if name not in QUANTITIES:
                raise ModelError(f"{where}: unknown quantity {quoted(name)}{nearest(name, QUANTITIES)}")
        default = ("stress",) if self.point is not None else ("acceleration",)
        object.__setattr__(self, "quantities", wanted or default)
        if self.point is not None and self.quantities != ("stress",):
            raise ModelError(f"{where}: a stress point has stress only, got {', '.join(self.quantities)}")


@dataclass(frozen=True, eq=False)
class Place:
    """A place found: its motion and stress over x = (d, theta, q) in mesh axes."""

    words: str
    point: Array  #: mesh coordinates, (3,) [m]
    rows: Array  #: translation, and rotation where it is known, (3 or 6, 6 + n_q)
    stress: Array | None  #: xx yy zz yz xz xy, (6, 6 + n_q); None: not known


def found_place(body: ReducedBody, each: Observed) -> Place:
    """Return the place in a body.

    Raises
    ------
    ModelError
        If there is no such place (with the nearest), or no stress where some is wanted.
    """
    where, frame = f"shake: output {each.name!r}", body.frame
    if each.interface is not None:
        interface = body.interface(each.interface)
        point = frame.origin + frame.axes @ interface.position
        if "stress" in each.quantities:
            raise ModelError(f"{where}: stress is known at nodes and stress points, not at interface {each.interface!r}")
        rows = in_mesh_axes(body, six_rows(body, point, np.asarray(interface.Psi)))
        return Place(f"interface {each.interface}", point, rows if interface.has_rotation else rows[:3], None)
    if each.point is not None:
        return stress_point(body, each, where)
    node, away = node_of(body, each, where)
    local = body.nodes[node]
    rows = np.hstack([rigid_motion_of_points(local[None], np.zeros(3))[0], body.Phi[node]])
    stress = None
    if "stress" in each.quantities:
        if body.stress is None:
            raise ModelError(f"{where}: body {body.name!r} has no stress modes; reduce it with stress = true")
        stress = stress_rows(body, np.asarray(body.stress[node]))
    words = f"node {body.node_ids[node]}" + (f", {away:.3g} {body.units.length_symbol} away" if away > 0 else "")
    return Place(words, frame.origin + frame.axes @ local, frame.axes @ rows, stress)


def node_of(body: ReducedBody, each: Observed, where: str) -> tuple[int, float]:
    """Return the index of a kept node, and how far it is from where it is asked for."""
    numbers = body.node_ids
    if each.node is not None:
        found = np.flatnonzero(numbers == each.node)
        if not len(found):
            choices = [str(number) for number in numbers[np.argsort(np.abs(numbers - each.node))[:3]]]
            raise ModelError(
                f"{where}: body {body.name!r} keeps no node {each.node}; the numbers nearest to it are {', '.join(choices)}"
            )
        return int(found[0]), 0.0
    local = (np.asarray(each.position) - body.frame.origin) @ body.frame.axes
    away = np.linalg.norm(body.nodes - local, axis=1)
    node = int(np.argmin(away))
    size = float(np.linalg.norm(np.ptp(body.nodes, axis=0)))
    if away[node] > NEAR * size:
        x, y, z = body.frame.origin + body.frame.axes @ body.nodes[node]
        raise ModelError(
            f"{where}: position {np.asarray(each.position).tolist()} is {away[node]:.4g} {body.units.length_symbol} away "
            f"from the nearest kept node, {numbers[node]} at [{x:.6g}, {y:.6g}, {z:.6g}]; give that position or node, or "
            "keep the node you mean when the body is reduced"
        )
    return node, float(away[node])


def stress_point(body: ReducedBody, each: Observed, where: str) -> Place:
    """Return a named stress point."""
    points = body.point_stress
    names = [] if points is None else list(points.names)
    if points is None or each.point not in names:
        raise ModelError(f"{where}: body {body.name!r} has no stress point {quoted(str(each.point))}{nearest(str(each.point), names)}")
    k = names.index(str(each.point))
    at = body.frame.origin + body.frame.axes @ points.positions[k]
    return Place(f"stress point {each.point}", at, np.zeros((0, 6 + body.n_q)), stress_rows(body, np.asarray(points.modes[k])))


def stress_rows(body: ReducedBody, modes: Array) -> Array:
    """Return stress rows over x in mesh axes, (6, 6 + n_q), from stress modes in axes of B, (6, n_q)."""
    return np.hstack([np.zeros((6, 6)), stress_turn(body.frame.axes) @ modes])


def stress_turn(axes: Array) -> Array:
    """Return the matrix of components xx yy zz yz xz xy from local axes to common ones, sigma' = A sigma Aᵀ, (6, 6)."""
    pairs = ((0, 0), (1, 1), (2, 2), (1, 2), (0, 2), (0, 1))
    turn = np.zeros((6, 6))
    for column, (i, j) in enumerate(pairs):
        tensor = np.outer(axes[:, i], axes[:, j])
        tensor = tensor if i == j else tensor + tensor.T
        turn[:, column] = [tensor[a, b] for a, b in pairs]
    return turn


def six_rows(body: ReducedBody, point: Array, Psi: Array) -> Array:
    """Return translation and rotation of a point (mesh coordinates) over x, axes of B, (6, 6 + n_q)."""
    local = (np.asarray(point) - body.frame.origin) @ body.frame.axes
    rows = np.zeros((6, 6 + body.n_q))
    rows[:3, :6] = rigid_motion_of_points(local[None], np.zeros(3))[0]
    rows[3:, 3:6] = np.eye(3)
    rows[:, 6:] = Psi
    return rows


def in_mesh_axes(body: ReducedBody, rows: Array) -> Array:
    """Return six rows turned from axes of B to those of the mesh."""
    return np.asarray(la.block_diag(body.frame.axes, body.frame.axes) @ rows)
