"""Observed places of a body: interfaces, nodes, elements and sets by their numbers, stress points."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cms.body.address import Address
from cms.body.reduced_body import ReducedBody
from fe_models.body.kept_nodes import TOLERANCE
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError

__all__ = ["QUANTITIES", "Observed", "Place", "found_places", "six_rows"]

QUANTITIES = ("acceleration", "displacement", "stress")
WAYS = ("interface", "node", "element", "set", "position", "point", "sensor", "recovery")
MOST_NODES = 500  #: largest number of nodes of an element or set


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Observed:
    """An observed place, given by one of interface, node, element, set, position and point.

    An element or a set stands for each of its kept nodes. The displacement is relative to the (first) base; the
    components of stress are in mesh axes.

    Parameters
    ----------
    name
        Name of the output.
    interface
        Name of an interface.
    node
        The user's number of a node; "INSTANCE.number" if instances have the same numbers.
    element
        Number of an element, in the same notation.
    set
        Name of a set of nodes or elements.
    position
        Mesh coordinates of a kept node, (3,) [m].
    point
        Stress point of the file, by name.
    quantities
        Names in `QUANTITIES`; (): acceleration, or stress at a stress point.
    tolerance
        Largest distance of a kept node from the position, relative to the size of the body.
    body
        Name of the body of a system; `position` may then also be on a rigid body.
    sensor
        Name of a sensor of a system, instead of a place.
    recovery
        Name of a recovery table of a body, for all of its rows.
    """

    name: str
    interface: str | None = None
    node: int | str | None = None
    element: int | str | None = None
    set: str | None = None
    position: Array | Sequence[float] | None = None
    point: str | None = None
    quantities: tuple[str, ...] = ()
    tolerance: float = TOLERANCE
    body: str | None = None
    sensor: str | None = None
    recovery: str | None = None

    def __post_init__(self) -> None:
        where = f"shake: output {self.name!r}"
        ways = [way for way in WAYS if getattr(self, way) is not None]
        if len(ways) != 1:
            raise ModelError(f"{where}: expected one of {', '.join(WAYS)}, got {', '.join(ways) or 'none'}")
        wanted = (self.quantities,) if isinstance(self.quantities, str) else tuple(self.quantities)
        for name in wanted:
            if name not in QUANTITIES:
                raise ModelError(f"{where}: unknown quantity {quoted(name)}{nearest(name, QUANTITIES)}")
        default = ("stress",) if self.point is not None else ("acceleration",)
        object.__setattr__(self, "quantities", wanted or default)
        if self.point is not None and self.quantities != ("stress",):
            raise ModelError(f"{where}: expected stress alone at a stress point, got {', '.join(self.quantities)}")


@dataclass(frozen=True, eq=False)
class Place:
    """An observed place: its motion and stress over x = (d, theta, q) in mesh axes."""

    name: str  #: name of the outputs
    words: str  #: description of the place
    point: Array  #: mesh coordinates, (3,) [m]
    rows: Array  #: translation, and rotation if known, (3 or 6, 6 + n_q)
    stress: Array | None  #: xx yy zz yz xz xy, (6, 6 + n_q); None if unknown


def found_places(body: ReducedBody, each: Observed) -> list[Place]:
    """Return the places in a body: one, or each node of an element or a set.

    Raises
    ------
    ModelError, BodyError
        If there is no such place (the message suggests the nearest), or a requested stress does not exist.
    """
    where, frame = f"shake: output {each.name!r}", body.frame
    if each.sensor is not None or each.body not in (None, body.name):
        raise ModelError(
            f"{where}: the test has no sensors and no other bodies, because it is of body {body.name!r} alone; observe "
            "this body, or test a system"
        )
    if each.interface is not None:
        interface = body.interface(each.interface)
        point = frame.origin + frame.axes @ interface.position
        if "stress" in each.quantities:
            raise ModelError(
                f"{where}: stress is known at nodes and stress points, not at interface {each.interface!r}"
            )
        rows = in_mesh_axes(body, six_rows(body, point, np.asarray(interface.Psi)))
        words = f"interface {each.interface}"
        return [Place(each.name, words, point, rows if interface.has_rotation else rows[:3], None)]
    if each.point is not None:
        return [stress_point(body, each, where)]
    found = Address(each.node, each.element, each.set, each.position, each.tolerance).find(body, where)
    if len(found.rows) > MOST_NODES:
        raise ModelError(
            f"{where}: {found.asked} has {len(found.rows)} kept nodes, expected up to {MOST_NODES}; name some of them"
        )
    if "stress" in each.quantities and body.stress is None:
        raise ModelError(f"{where}: body {body.name!r} has no stress modes; reduce it with stress = true")
    single = len(found.rows) == 1
    return [
        node_place(
            body,
            int(row),
            each,
            each.name if single else f"{each.name} {name}",
            found.description() if single else f"node {name}",
        )
        for row, name in zip(found.rows, found.names, strict=True)
    ]


def node_place(body: ReducedBody, row: int, each: Observed, name: str, words: str) -> Place:
    """Return a kept node by its row, with rotations if the body has them."""
    frame, local = body.frame, body.nodes[row]
    turn = None if body.kept is None else body.kept.of_node(row)
    Psi = np.concatenate([body.Phi[row], np.zeros((3, body.n_q)) if turn is None else turn])
    point = frame.origin + frame.axes @ local
    rows = in_mesh_axes(body, six_rows(body, point, Psi))
    stress = (
        stress_rows(body, np.asarray(body.stress[row]))
        if "stress" in each.quantities and body.stress is not None
        else None
    )
    return Place(name, words, point, rows[:3] if turn is None else rows, stress)


def stress_point(body: ReducedBody, each: Observed, where: str) -> Place:
    """Return a named stress point."""
    points = body.point_stress
    names = [] if points is None else list(points.names)
    if points is None or each.point not in names:
        raise ModelError(
            f"{where}: body {body.name!r} has no stress point "
            f"{quoted(str(each.point))}{nearest(str(each.point), names)}"
        )
    k = names.index(str(each.point))
    at = body.frame.origin + body.frame.axes @ points.positions[k]
    return Place(
        each.name,
        f"stress point {each.point}",
        at,
        np.zeros((0, 6 + body.n_q)),
        stress_rows(body, np.asarray(points.modes[k])),
    )


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
    """Return six rows rotated from axes of B to mesh axes."""
    return np.asarray(la.block_diag(body.frame.axes, body.frame.axes) @ rows)
