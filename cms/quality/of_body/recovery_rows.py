"""Recovery rows of a reduced body in rigid motions: no stress and no force, and every point where it belongs."""

import numpy as np

from cms.quality.record import QualityRecord, information, judge
from cms.reduced_body.recovery_table import N_RIGID, RecoveryTable
from cms.reduced_body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array

__all__ = ["check_recovery_forces", "check_recovery_motions"]

MOTIONS = ("displacement", "velocity", "acceleration")
NO_TABLE = "the body has no recovery tables"


def check_recovery_forces(reduced: ReducedBody) -> QualityRecord:
    """Rows of stress, strain and element forces are zero in the six rigid motions.

    Over the largest entry of their kind for a mode of the same largest displacement; rotations by the size of the body.
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
                key = f"{name}: {quantity}"
                found = float(rigid / elastic) if elastic > 0 else float(rigid > 0)
                defects[key] = max(defects.get(key, 0.0), found)
    if not defects:
        return information("recovery-forces", "no rows of stress or element forces" if reduced.recovery else NO_TABLE)
    worst = max(defects, key=lambda key: defects[key])
    reason = f"a rigid motion gives {defects[worst]:.1e} of what a mode of its size gives, in {worst}"
    return judge("recovery-forces", defects[worst], reason, {"defects": defects})


def check_recovery_motions(reduced: ReducedBody) -> QualityRecord:
    """Rows of motions say what a rigid body says: unit translations along the mesh axes, rotations about a place.

    The translations of a place are the axes of B and minus its skew matrix; of a kept node or an interface the place is
    its own.
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
    reason = f"rows of {worst} miss a rigid motion by {defects[worst]:.1e} of it, of {len(defects)} places"
    return judge("recovery-motions", defects[worst], reason, {"defects": defects})


def places_of(table: RecoveryTable) -> dict[str, dict[str, int]]:
    """Return the rows of each place and quantity by component, where all three translations are there."""
    found: dict[str, dict[str, int]] = {}
    for k, (label, quantity, component) in enumerate(
        zip(table.labels, table.quantities, table.components, strict=True)
    ):
        if quantity in MOTIONS:
            found.setdefault(label.removesuffix(f" {component}"), {})[component] = k
    return {place: rows for place, rows in found.items() if {"ux", "uy", "uz"} <= set(rows)}


def motion_defect(reduced: ReducedBody, table: RecoveryTable, place: str, rows: dict[str, int]) -> float:
    """Return the largest defect of the rows of one place, lengths over the size of the body."""
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
    """Return where a place is in B; None if the body does not keep it."""
    entity, _, rest = place.partition(" ")
    name = rest.rpartition(" ")[0]
    if entity == "interface":
        return next((each.position for each in reduced.interfaces if each.name == name), None)
    rows = [k for k in range(len(reduced.nodes)) if reduced.node_name(k) == name]
    return reduced.nodes[rows[0]] if rows else None
