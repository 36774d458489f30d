"""Checks of recovery rows in rigid motions, and of rows that follow from other data of the file."""

import numpy as np

from cms.assessment.quality.of_body.identities import body_length, mode_size
from cms.assessment.quality.record import QualityRecord, information, judge
from cms.body.recovery_table import N_RIGID, RecoveryTable
from cms.body.reduced_body import ReducedBody
from cms.errors import RecoveryError
from cms.reduction.recovery.interface_rows import interface_part
from cms.reduction.recovery.kept_rows import kept_part
from cms.reduction.recovery.load_columns import loads_of_body
from cms.reduction.recovery.request import Rows
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["check_recovery_forces", "check_recovery_motions", "check_recovery_shapes"]

MOTIONS = ("displacement", "velocity", "acceleration")
NO_TABLE = "the body has no recovery tables"


def check_recovery_forces(reduced: ReducedBody) -> QualityRecord:
    """Check that rows of stress, strain and element force are zero in the six rigid motions.

    Their entries in rigid motions are divided by the largest entry of the same quantity in a mode with the same largest
    displacement. Rotations are divided by the size of the body.
    """
    defects: dict[str, float] = {}
    if reduced.is_held or not reduced.n_q:
        return information("recovery-forces", "the body is held to the ground or has no modes")
    size = float(np.linalg.norm(np.ptp(reduced.nodes, axis=0))) if len(reduced.nodes) else 0.0
    lengths = np.concatenate([np.ones(3), np.full(3, 1 / (size or 1.0))])
    shape = np.abs(reduced.Phi).max(axis=(0, 1), initial=0.0)
    for name, table in reduced.recovery.items():
        for quantity in dict.fromkeys(table.quantities):
            if quantity in (*MOTIONS, "interface force", "net force"):
                continue
            rows = np.flatnonzero(np.array(table.quantities) == quantity)
            for dimensions in np.unique(table.dimensions[rows], axis=0):
                own = rows[(table.dimensions[rows] == dimensions).all(axis=1)]
                rigid = np.abs(table.dynamic[0][own, :N_RIGID] * lengths).max()
                elastic = (np.abs(table.dynamic[0][own, N_RIGID:]) / np.where(shape > 0, shape, 1.0)).max(initial=0.0)
                if quantity == "stress" and reduced.stress is not None:  # points in a rigid part have no stress
                    whole = np.abs(reduced.stress).max(axis=(0, 1), initial=0.0)
                    elastic = max(elastic, (whole / np.where(shape > 0, shape, 1.0)).max(initial=0.0))
                if quantity == "stress" and size > 0:
                    # modal force / size²: a lower bound, since thin bodies have far more stress at other places
                    stiffness = np.diag(reduced.K) / np.where(shape > 0, shape, np.inf) ** 2
                    elastic = max(elastic, float(stiffness.max(initial=0.0)) / size**2)
                key = f"{name}: {quantity}"
                found = float(rigid / elastic) if elastic > 0 else float(rigid > 0)
                defects[key] = max(defects.get(key, 0.0), found)
    if not defects:
        return information("recovery-forces", "no rows of stress or element forces" if reduced.recovery else NO_TABLE)
    worst = max(defects, key=lambda key: defects[key])
    reason = f"a rigid motion gives {defects[worst]:.1e} of the value in a mode with the same displacement, in {worst}"
    return judge("recovery-forces", defects[worst], reason, {"defects": defects})


def check_recovery_motions(reduced: ReducedBody) -> QualityRecord:
    """Check the rows of motions in unit translations and unit rotations of the body.

    The translation rows of a point at c must be A [1, -skew(c)] with the axes A of B. If the file contains the position
    of the point, c must be this position.
    """
    if reduced.is_held:
        return information("recovery-motions", "the body is held to the ground and has no rigid motion")
    defects: dict[str, float] = {}
    for name, table in reduced.recovery.items():
        for place, rows in places_of(table).items():
            defects[f"{name}: {place}"] = motion_defect(reduced, table, place, rows)
    if not defects:
        return information("recovery-motions", "no rows of motions" if reduced.recovery else NO_TABLE)
    worst = max(defects, key=lambda key: defects[key])
    reason = f"rows of {worst} deviate from a rigid motion by {defects[worst]:.1e} of it; {len(defects)} compared"
    return judge("recovery-motions", defects[worst], reason, {"defects": defects})


def places_of(table: RecoveryTable) -> dict[str, dict[str, int]]:
    """Return the rows of each place and quantity, by component, if all three translations exist."""
    found: dict[str, dict[str, int]] = {}
    for k, (label, quantity, component) in enumerate(
        zip(table.labels, table.quantities, table.components, strict=True)
    ):
        if quantity in MOTIONS:
            found.setdefault(label.removesuffix(f" {component}"), {})[component] = k
    return {place: rows for place, rows in found.items() if {"ux", "uy", "uz"} <= set(rows)}


def motion_defect(reduced: ReducedBody, table: RecoveryTable, place: str, rows: dict[str, int]) -> float:
    """Return the largest error of the rows at one place, with lengths divided by the body size."""
    A = reduced.frame.axes
    size = float(np.linalg.norm(np.ptp(reduced.nodes, axis=0))) if len(reduced.nodes) else 1.0
    order = MOTIONS.index(table.quantities[rows["ux"]])
    motion = A.T @ table.dynamic[order][[rows["ux"], rows["uy"], rows["uz"]], :N_RIGID]
    turn = motion[:, 3:]
    defect = max(np.abs(motion[:, :3] - np.eye(3)).max(), np.abs(turn + turn.T).max() / (size or 1.0))
    at = known_place(reduced, place)
    if at is not None:
        c = np.array([turn[1, 2], turn[2, 0], turn[0, 1]])  # theta × c: -skew(c)
        defect = max(defect, np.abs(c - at).max() / (size or 1.0))
    if {"rx", "ry", "rz"} <= set(rows):
        rotation = A.T @ table.dynamic[order][[rows["rx"], rows["ry"], rows["rz"]], :N_RIGID]
        defect = max(defect, np.abs(rotation[:, 3:] - np.eye(3)).max(), np.abs(rotation[:, :3]).max() * size)
    return float(defect)


def known_place(reduced: ReducedBody, place: str) -> Array | None:
    """Return the position of a place in B; None if the body does not store it."""
    entity, _, rest = place.partition(" ")
    name = rest.rpartition(" ")[0]
    if entity == "interface":
        return next((each.position for each in reduced.interfaces if each.name == name), None)
    rows = [k for k in range(len(reduced.nodes)) if reduced.node_name(k) == name]
    return reduced.nodes[rows[0]] if rows else None


def check_recovery_shapes(reduced: ReducedBody) -> QualityRecord:
    """Check that rows of kept nodes, stress points and interfaces follow from modes, stress and matrices of the file.

    Differences are divided by the largest entry of the quantity, for modes of unit strain energy. Rows that only the
    model can provide are not checked.
    """
    if not reduced.recovery or not reduced.n_q:
        return information("recovery-shapes", NO_TABLE)
    stiffness = np.diag(reduced.K)
    by_energy = 1 / np.sqrt(np.where(stiffness > 0, stiffness, 1.0))
    defects: dict[str, float] = {}
    for name, table in reduced.recovery.items():
        for quantity in dict.fromkeys(table.quantities):
            if quantity not in (*MOTIONS, "stress", "interface force"):
                continue
            own, made = rows_by_label(reduced, table, quantity)
            if not len(own):
                continue
            a, b = ((x[..., N_RIGID:] * by_energy) for x in (table.dynamic[:, own], made))
            if quantity == "stress":  # only the model provides the static stress outside the modes
                a, b = a[:1], b[:1]
            elif quantity in MOTIONS:
                order = MOTIONS.index(quantity)
                a, b = a[order], b[order]
            if quantity in MOTIONS:  # rotations are multiplied by the size of the body
                lengths = np.where(table.dimensions[own, 1] == 0, body_length(reduced), 1.0)
                a, b = a * lengths[:, None], b * lengths[:, None]
            # places that the frame fixes do not move, so the size at other places is used
            at_least = 1e-3 * float((mode_size(reduced) * by_energy).max()) if quantity in MOTIONS else 0.0
            size = np.maximum(np.abs(b).max(axis=(-2, -1), keepdims=True, initial=0.0), at_least)
            size = np.maximum(size, 1e-9 * size.max(initial=0.0))
            apart = np.abs(a - b)
            defects[f"{name}: {quantity}"] = float((apart / np.where(size > 0, size, 1.0)).max(initial=0.0))
    if not defects:
        return information("recovery-shapes", "no rows of quantities that the file contains")
    worst = max(defects, key=lambda key: defects[key])
    reason = f"largest difference from what modes and matrices of the file give is {defects[worst]:.1e}, of {worst}"
    return judge("recovery-shapes", defects[worst], reason, {"defects": defects})


def rows_by_label(reduced: ReducedBody, table: RecoveryTable, quantity: str) -> tuple[IntArray, Array]:
    """Return rows of a quantity that follow from other data of the file, (n,), and their values, (3, n, 6 + n_q)."""
    loads, forces = loads_of_body(reduced)
    made: dict[str, Array] = {}
    rows = [k for k, each in enumerate(table.quantities) if each == quantity]
    requests = [Rows(quantity)] if quantity == "interface force" else []
    if quantity != "interface force":
        requests = [Rows(quantity, (place,)) for place in dict.fromkeys(place_of(table, k) for k in rows)]
    for request in requests:
        try:
            if quantity == "interface force":
                part = interface_part(reduced, request, loads, forces)
            else:
                part = kept_part(reduced, request, loads)
        except RecoveryError:  # the file lacks the data for these rows
            continue
        made |= {each.label: part.dynamic[:, k] for k, each in enumerate(part.names)}
    found = [k for k in rows if table.labels[k] in made]
    width = N_RIGID + reduced.n_q
    values = np.array([made[table.labels[k]] for k in found]).reshape(len(found), 3, width)
    return np.array(found, dtype=np.int64), values.transpose(1, 0, 2)


def place_of(table: RecoveryTable, row: int) -> str | int:
    """Return the node, point or interface of a row, in the form used by requests."""
    words = table.labels[row].removeprefix(f"{table.entities[row]} ")
    place = words.removesuffix(f" {table.components[row]}").removesuffix(f" {table.quantities[row]}")
    node = place.partition(" skin ")[0]
    return int(node) if table.entities[row] == "node" and node.isdigit() else node
