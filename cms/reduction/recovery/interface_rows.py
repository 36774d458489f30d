"""Rows for the forces on a reduced body at its interfaces, computed from its motion with M, D and K.

M_z z'' + D_z z' + K_z z = Bᵀ f_b + G p over z = (d, theta, q), where f_b are the interface forces and G p all other
loads. The constraint modes Z of `interface_model` satisfy B Z = 1, so that

    f_b = Zᵀ (M_z z'' + D_z z' + K_z z - G p).

The net force of all interfaces needs no such modes: it is the rigid-motion part of the inertia forces, M_R and Y, minus
the resultant of the other loads.
"""

from dataclasses import dataclass

import numpy as np

from cms.body.recovery_table import N_RIGID
from cms.body.reduced_body import ReducedBody
from cms.errors import ExportError, RecoveryError
from cms.reduction.interface_model import BoundaryNode, interface_model
from cms.reduction.recovery.blocks import RowName
from cms.reduction.recovery.load_columns import WRENCH, LoadColumns, on_coordinates, rigid_rows
from cms.reduction.recovery.request import Rows
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import Array
from fe_models.foundation.units import Dimensions
from fe_models.foundation.words import nearest, quoted

__all__ = ["PartOfTable", "interface_part", "wrench_about"]

FORCE, MOMENT = Dimensions(1, 1, -2), Dimensions(1, 2, -2)


@dataclass(frozen=True, eq=False)
class PartOfTable:
    """Some rows of a recovery table, with their coefficients."""

    names: tuple[RowName, ...]
    dynamic: Array  #: factors of z and its first and second derivatives, (3, n_rows, 6 + n_q)
    static: Array  #: response to unit load amplitudes, (n_rows, n_loads)

    def over(self, Z: Array | None) -> "PartOfTable":
        """Return the rows over other modes, given by the columns of Z, (n_q, k); None keeps the modes."""
        if Z is None:
            return self
        dynamic = np.concatenate([self.dynamic[..., :N_RIGID], self.dynamic[..., N_RIGID:] @ Z], axis=2)
        return PartOfTable(self.names, dynamic, self.static)


def interface_part(body: ReducedBody, rows: Rows, loads: LoadColumns, forces: Array) -> PartOfTable:
    """Return rows of forces at single interfaces, or of the net force of several, in mesh axes.

    Parameters
    ----------
    loads, forces
        Loads, and their forces on z, (6 + n_q, n_loads).

    Raises
    ------
    RecoveryError
        If an interface is unknown, or the modes do not separate the forces of single interfaces.
    """
    known = [interface.name for interface in body.interfaces]
    for name in rows.at:
        if name not in known:
            raise RecoveryError(
                f"body {body.name!r}: recovery of {rows.quantity}: no interface {quoted(str(name))}"
                f"{nearest(str(name), known)}"
            )
    others = np.where(loads.is_interface, 0.0, forces)
    if rows.quantity == "net force":
        return net_part(body, rows, others)
    nodes, dynamic, static = single_forces(body, others)
    chosen, names = [], []
    for node, place in zip(nodes, node_words(nodes), strict=True):
        if rows.at and node.interface not in rows.at:
            continue
        for k, component in enumerate(node.components.tolist()):
            dimensions = MOMENT if component >= 3 else FORCE
            names.append(RowName(rows.quantity, "interface", -1, place, WRENCH[component], dimensions))
            chosen.append(node.first + k)
    return PartOfTable(tuple(names), dynamic[:, chosen], static[chosen])


def single_forces(body: ReducedBody, others: Array) -> tuple[tuple[BoundaryNode, ...], Array, Array]:
    """Return the interface nodes, and the rows of f_b: (3, n_b, 6 + n_q) over z, (n_b, n_loads) over loads."""
    try:
        model = interface_model(body)
    except ExportError as error:
        raise RecoveryError(
            f"recovery of interface forces: {error}; the net force of all interfaces needs no such modes"
        ) from error
    Z = model.T[:, : model.n_boundary]
    if body.is_held:
        Z = np.vstack([np.zeros((N_RIGID, model.n_boundary)), Z])
    M, D, K = on_coordinates(body)
    return model.nodes, np.array([Z.T @ K, Z.T @ D, Z.T @ M]), -Z.T @ others


def node_words(nodes: tuple[BoundaryNode, ...]) -> list[str]:
    """Return the names of interface nodes: the interface name, with a counter if it has several nodes."""
    names = [node.interface for node in nodes]
    count = dict.fromkeys(names, 0)
    words = []
    for name in names:
        count[name] += 1
        words.append(name if names.count(name) == 1 else f"{name} {count[name]}")
    return words


def net_part(body: ReducedBody, rows: Rows, others: Array) -> PartOfTable:
    """Return the resultant force and moment of all or some interfaces about a point, mesh axes."""
    about = np.asarray(rows.about, dtype=float)
    if rows.at or body.is_held:
        nodes, dynamic, static = single_forces(body, others)
        sums = np.zeros((6, static.shape[0]))
        for node in nodes:
            if not rows.at or node.interface in rows.at:
                own = slice(node.first, node.first + len(node.components))
                sums[:, own] = wrench_about(node, about)
        dynamic, static = sums @ dynamic, sums @ static
    else:
        to_point = carried_wrench(body, about)
        dynamic = np.zeros((3, 6, N_RIGID + body.n_q))
        dynamic[2] = to_point @ rigid_rows(body)
        static = -to_point @ others[:N_RIGID]
    place = f"of {', '.join(map(str, rows.at))}" if rows.at else ""
    point = f"about [{', '.join(f'{x:g}' for x in about)}]"
    names = tuple(
        RowName(rows.quantity, "body", -1, " ".join(w for w in (place, point) if w), word, MOMENT if k > 2 else FORCE)
        for k, word in enumerate(WRENCH)
    )
    return PartOfTable(names, dynamic, static)


def wrench_about(node: BoundaryNode, about: Array) -> Array:
    """Return the map from forces at a boundary node to force and moment about a point, (6, n_components)."""
    motion = np.zeros((6, 6))
    motion[:3] = rigid_motion_of_points(node.position[None], about)[0]
    motion[3:, 3:] = np.eye(3)
    return np.asarray(motion[node.components].T)


def carried_wrench(body: ReducedBody, about: Array) -> Array:
    """Return the map of force and torque from axes and origin of B to mesh axes and a given point, (6, 6)."""
    A = body.frame.axes
    to_point = np.kron(np.eye(2), A)
    arm = body.frame.origin - about
    to_point[3:, :3] = np.cross(arm, A, axisb=0, axisc=0)
    return np.asarray(to_point, np.float64)
