"""Recovery rows at the kept nodes of a reduced body, from its shapes and stress modes."""

import numpy as np

from cms.body.address import Address
from cms.body.recovery_table import N_RIGID, spin_accelerations
from cms.body.reduced_body import ReducedBody
from cms.errors import BodyError, RecoveryError
from cms.reduction.basis.node_results import turned_stress
from cms.reduction.frame_conversion import six_motions
from cms.reduction.recovery.blocks import RowName
from cms.reduction.recovery.interface_rows import PartOfTable
from cms.reduction.recovery.load_columns import SPIN, LoadColumns
from cms.reduction.recovery.request import OF_MOTION, Rows, motion_dimensions
from fe_models.body.rigid_motion import rigid_motion_of_points
from fe_models.foundation.arrays import MOTION_COMPONENTS, STRESS_COMPONENTS, Array, IntArray
from fe_models.foundation.units import Dimensions
from fe_models.foundation.words import nearest, quoted

__all__ = ["kept_part"]

STRESS = Dimensions(1, -1, -2)


def kept_part(body: ReducedBody, rows: Rows, loads: LoadColumns) -> PartOfTable:
    """Return motions of kept nodes and interfaces, or stress of kept nodes and points, in mesh axes.

    Raises
    ------
    RecoveryError
        If the body does not have the quantity, a place or a component.
    """
    if rows.quantity in OF_MOTION:
        order = OF_MOTION.index(rows.quantity)
        names, values, static = motion_rows(body, rows, order, loads)
    elif rows.quantity == "stress":
        order = 0
        names, values = stress_rows(body, rows)
        static = np.zeros((len(names), len(loads.names)))
    else:
        raise RecoveryError(
            f"body {body.name!r}: recovery of {rows.quantity}: a reduced body cannot provide it; make the table while "
            "the body is reduced (recovery = ..., [recovery.NAME] in a job)"
        )
    chosen = np.array([k for k, name in enumerate(names) if not rows.components or name.component in rows.components])
    known = tuple(dict.fromkeys(name.component for name in names))
    for component in rows.components:
        if component not in known:
            raise RecoveryError(
                f"body {body.name!r}: recovery of {rows.quantity}: no component {quoted(component)}"
                f"{nearest(component, known)}"
            )
    dynamic = np.zeros((3, len(chosen), N_RIGID + body.n_q))
    dynamic[order] = values[chosen]
    return PartOfTable(tuple(names[k] for k in chosen), dynamic, static[chosen])


def motion_rows(body: ReducedBody, rows: Rows, order: int, loads: LoadColumns) -> tuple[list[RowName], Array, Array]:
    """Return motions as rows over z in mesh axes; accelerations include the part omega × (omega × c) due to spin."""
    A = body.frame.axes
    names: list[RowName] = []
    values, static = [np.zeros((0, N_RIGID + body.n_q))], [np.zeros((0, len(loads.names)))]

    def add(entity: str, number: int, place: str, position: Array, motion: Array) -> None:
        turned = np.kron(np.eye(len(motion) // 3), A) @ motion
        for word in MOTION_COMPONENTS[: len(motion)]:
            names.append(RowName(rows.quantity, entity, number, place, word, motion_dimensions(order, word)))
        values.append(turned)
        of_loads = np.zeros((len(motion), len(loads.names)))
        if order == 2 and SPIN[0] in loads.names:
            first = loads.column(SPIN[0])
            of_loads[:3, first : first + 6] = A @ spin_accelerations(position)
        static.append(of_loads)

    for at in rows.at:
        interface = next((each for each in body.interfaces if each.name == at), None)
        if interface is not None:
            motion = np.hstack([six_motions(interface.position), interface.Psi])
            if not interface.has_rotation:
                motion = motion[:3]
            add("interface", -1, interface.name, interface.position, motion)
            continue
        for k in kept_nodes(body, at).tolist():
            rigid = rigid_motion_of_points(body.nodes[k][None], np.zeros(3))[0]
            motion, turn = np.hstack([rigid, body.Phi[k]]), rotation_of(body, k)
            if turn is not None:
                motion = np.vstack([motion, np.hstack([np.zeros((3, 3)), np.eye(3), turn])])
            add("node", number_of(body, k), name_of(body, k), body.nodes[k], motion)
    whole = np.concatenate(values)
    if body.is_held:
        whole[:, :N_RIGID] = 0.0
    return names, whole, np.concatenate(static)


def stress_rows(body: ReducedBody, rows: Rows) -> tuple[list[RowName], Array]:
    """Return rows of stress in mesh axes over z = (displacement, rotation, modal coordinates)."""
    names: list[RowName] = []
    modes = [np.zeros((0, 6, body.n_q))]
    points: tuple[str, ...] = () if body.point_stress is None else body.point_stress.names
    for at in rows.at:
        found = [k for k, name in enumerate(points) if name == at or name.startswith(f"{at} ")]
        if found:
            assert body.point_stress is not None
            places = [("point", -1, points[k]) for k in found]
            stress = np.asarray(body.point_stress.modes)[found]
        else:
            kept = kept_nodes(body, at, skin=True)
            if body.stress is None:
                raise RecoveryError(f"body {body.name!r}: recovery of stress: its file contains no stress of nodes")
            stress = np.asarray(body.stress)[kept]
            shows = stress.any(axis=(1, 2))
            kept, stress = kept[shows], stress[shows]
            places = [("node", number_of(body, k), name_of(body, k)) for k in kept.tolist()]
            if not len(kept):
                raise RecoveryError(
                    f"body {body.name!r}: node {at} has no stress: it is a reference node or on the axis "
                    "of a beam; take a node of the solid or shell, or a stress point"
                )
        names += [RowName("stress", *place, word, STRESS) for place in places for word in STRESS_COMPONENTS]
        modes.append(turned_stress(stress, body.frame.axes.T))
    values = np.concatenate(modes).reshape(-1, body.n_q)
    return names, np.hstack([np.zeros((len(values), N_RIGID)), values])


def kept_nodes(body: ReducedBody, at: str | int, *, skin: bool = False) -> IntArray:
    """Return the rows of the kept nodes that a node number, a set or an interface selects.

    Parameters
    ----------
    skin
        Whether to include skin points that move with the nodes.
    """
    where = f"body {body.name!r}: recovery"
    interface = next((each for each in body.interfaces if each.name == at), None)
    if interface is not None:
        return interface.members
    if isinstance(at, int) and not body.numbering.nodes.size:
        found = np.flatnonzero(body.node_ids == at)
        if not len(found):
            raise RecoveryError(f"{where}: node {at} is not among the {len(body.node_ids)} that the reduced body keeps")
        return found[:1]
    is_set = isinstance(at, str) and at in body.numbering.set_names
    if isinstance(at, str) and not is_set and at.rpartition(".")[0] not in body.numbering.instances:
        choices = [*(each.name for each in body.interfaces), *body.numbering.set_names]
        raise RecoveryError(f"{where}: no node set or interface {quoted(at)}{nearest(at, choices)}")
    try:
        address = Address(set=at) if isinstance(at, str) and is_set else Address(node=at)
        rows = address.find(body, "recovery").rows
        if skin and not is_set:
            return body.numbering.rows_of_node(where, at)
    except BodyError as error:
        raise RecoveryError(str(error)) from error
    return rows


def name_of(body: ReducedBody, row: int) -> str:
    """Return the name of a kept node. A skin point is named by its node and its index among the skin points there."""
    numbering, name = body.numbering, body.node_name(row)
    if numbering.on_skin.size and numbering.on_skin[row]:
        same = np.flatnonzero((numbering.nodes == numbering.nodes[row]) & (numbering.on_skin == 1))
        return f"{name} skin {int(np.searchsorted(same, row)) + 1}"
    return name


def number_of(body: ReducedBody, row: int) -> int:
    """Return the user's number of a kept node, or its index in the model if it has none."""
    return int(body.numbering.nodes[row] if body.numbering.nodes.size else body.node_ids[row])


def rotation_of(body: ReducedBody, row: int) -> Array | None:
    """Return the rotation of a kept node, (3, n_q), in B; None if the body does not store it."""
    return None if body.kept is None else body.kept.of_node(row)
