"""Fields of a modal file, and the verdict that compares each field with the model.

`FIELDS` names for every field of `ReducedBody`, and of the records in it, the record that judges it. A new field
without a record fails a test (tests/cms/assessment/quality/of_reduction/test_contents.py).
"""

from collections.abc import Mapping
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["FIELDS", "Compared", "apart", "leaves", "same"]

#: field -> record that assesses it. `contents_records` makes these records, in addition to "same-body" and
#: "mass-properties"
FIELDS: Mapping[str, str] = {
    "name": "origin",
    "units": "same-body",  # a difference of units is an error before the comparison
    "frame.kind": "frame",
    "frame.origin": "points",
    "frame.axes": "points",
    "frame.at": "frame",
    "frame.dofs": "frame",
    "M": "same-body",
    "K": "same-body",
    "D": "damping-matrix",
    "labels": "sources",
    "energy_shares": "sources",
    "sources": "sources",
    "moments.m": "mass-properties",
    "moments.S": "mass-properties",
    "moments.R": "mass-properties",
    "moments.C1": "invariants",
    "moments.P": "invariants",
    "moments.S_kl": "invariants",
    "moments.is_exact": "invariants",
    "moments.missing": "invariants",
    "free_frequencies": "same-body",
    "nodes": "points",
    "node_ids": "points",
    "Phi": "same-body",
    "surface": "points",
    "interfaces.name": "interfaces",
    "interfaces.kind": "interfaces",
    "interfaces.position": "interfaces",
    "interfaces.triad": "interfaces",
    "interfaces.Psi": "interfaces",
    "interfaces.members": "interfaces",
    "interfaces.has_rotation": "interfaces",
    "provenance": "origin",
    "columns.labels": "sources",
    "columns.groups": "sources",
    "columns.A": "sources",
    "columns.F": "sources",
    "nodal_sums.w": "nodal-sums",
    "nodal_sums.S": "nodal-sums",
    "nodal_sums.R": "nodal-sums",
    "nodal_sums.U1": "nodal-sums",
    "nodal_sums.U2": "nodal-sums",
    "nodal_sums.is_volume": "nodal-sums",
    "load_cases.name": "load-cases",
    "load_cases.kind": "load-cases",
    "load_cases.force": "load-cases",
    "load_cases.torque": "load-cases",
    "load_cases.h": "load-cases",
    "stress": "stress-modes",
    "point_stress.names": "stress-modes",
    "point_stress.positions": "stress-modes",
    "point_stress.modes": "stress-modes",
    "geometric.translation": "geometric-stiffness",
    "geometric.rotation": "geometric-stiffness",
    "geometric.spin": "geometric-stiffness",
    "geometric.interfaces": "geometric-stiffness",
    "geometric.turned.translation": "geometric-stiffness",
    "geometric.turned.rotation": "geometric-stiffness",
    "geometric.turned.spin": "geometric-stiffness",
    "geometric.turned.interfaces": "geometric-stiffness",
    "geometric.spread.K": "geometric-stiffness",
    "geometric.spread.turned": "geometric-stiffness",
    "geometric.spread.turned_rigid": "geometric-stiffness",
    "geometric.is_loaded": "geometric-stiffness",
    "quadratic": "quadratic-modes",
    "numbering.nodes": "points",
    "numbering.on_skin": "points",
    "numbering.elements": "points",
    "numbering.instances": "points",
    "numbering.node_instance": "points",
    "numbering.element_instance": "points",
    "numbering.sets.name": "points",
    "numbering.sets.kind": "points",
    "numbering.sets.members": "points",
    "numbering.sets.size": "points",
    "kept.nodes": "points",
    "kept.rotation": "kept-rotations",
    "kept.source": "kept-rotations",
    "recovery.name": "recovery-rows",
    "recovery.labels": "recovery-rows",
    "recovery.quantities": "recovery-rows",
    "recovery.entities": "recovery-rows",
    "recovery.numbers": "recovery-rows",
    "recovery.components": "recovery-rows",
    "recovery.dimensions": "recovery-rows",
    "recovery.dynamic": "recovery-rows",
    "recovery.loads": "recovery-rows",
    "recovery.load_dimensions": "recovery-rows",
    "recovery.static": "recovery-rows",
    "recovery.system": "recovery-rows",
    "recovery.truncated": "recovery-rows",
    "errors.frequency": "error-estimates",
    "errors.bound": "error-estimates",
    "errors.largest": "error-estimates",
    "errors.shape": "error-estimates",
    "errors.response": "error-estimates",
    "errors.interface_loads": "error-estimates",
    "errors.interface": "error-estimates",
    "errors.inertia": "error-estimates",
    "errors.method": "error-estimates",
    "errors.mesh": "error-estimates",
    "errors.mesh_sign": "error-estimates",
    "errors.mesh_method": "error-estimates",
    "errors.date": "error-estimates",
    "errors.left_out.mass": "error-estimates",
    "errors.left_out.shares": "error-estimates",
    "errors.left_out.inertia": "error-estimates",
    "errors.left_out.interfaces": "error-estimates",
    "errors.left_out.spin": "error-estimates",
    "errors.left_out.load_cases": "error-estimates",
}


@dataclass(frozen=True)
class Compared:
    """Comparison of one field of a file with the same field of the model."""

    field: str  #: field name, as in `FIELDS`
    defect: float  #: largest difference divided by the size of the field; infinite for differing texts and counts
    where: str = ""  #: description of the place of the largest difference
    doubt: str = ""  #: description of a difference that is not numerical


def leaves(value: Any, path: str = "") -> dict[str, list[Any]]:
    """Return the values of all fields of a record and of nested records, by field path.

    Records in a tuple or mapping share their paths; a missing record has no fields.
    """
    found: dict[str, list[Any]] = {}
    if value is None and path not in FIELDS:
        return found  # a missing record
    if is_dataclass(value) and path not in ("units", "recovery.system"):
        for each in fields(value):
            for name, values in leaves(getattr(value, each.name), f"{path}.{each.name}".removeprefix(".")).items():
                found.setdefault(name, []).extend(values)
        return found
    parts: tuple[Any, ...] = ()
    if isinstance(value, tuple):
        parts = value
    elif isinstance(value, Mapping) and path != "provenance":
        parts = tuple(value.values())
    if parts and all(is_dataclass(part) for part in parts):
        for part in parts:
            for name, values in leaves(part, path).items():
                found.setdefault(name, []).extend(values)
        return found
    return {path: [value]}


def same(field: str, got: Any, wanted: Any, where: str = "") -> Compared:
    """Compare texts, counts and indices for equality."""
    if isinstance(got, np.ndarray) or isinstance(wanted, np.ndarray):
        is_same = np.array_equal(np.asarray(got), np.asarray(wanted))
    else:
        is_same = got == wanted
    if is_same:
        return Compared(field, 0.0, where)
    shown = [
        text if len(text) <= 60 else f"{text[:57]}..." for text in (" ".join(repr(x).split()) for x in (got, wanted))
    ]
    return Compared(field, np.inf, where, f"the file says {shown[0]}, the model {shown[1]}")


def apart(field: str, got: Array, wanted: Array, size: Array | float, where: str = "", axes: str = "") -> Compared:
    """Compare numbers: return the largest ratio of difference to size; the size broadcasts.

    Parameters
    ----------
    axes
        Names of the axes of the arrays, such as "mode mode", to describe the index of the largest difference; "-" for
        an axis without name.
    """
    got, wanted = np.asarray(got), np.asarray(wanted)
    if got.shape != wanted.shape:
        return Compared(field, np.inf, where, f"the file has an array {got.shape}, the model {wanted.shape}")
    difference = np.abs(got - wanted)
    if not difference.size:
        return Compared(field, 0.0, where)
    size = np.broadcast_to(np.asarray(size, dtype=float), difference.shape)
    relative = np.divide(difference, size, out=np.where(difference == 0, 0.0, np.inf), where=size > 0)
    at = np.unravel_index(int(np.argmax(relative)), relative.shape)
    words = [f"{word} {place + 1}" for word, place in zip(axes.split(), at, strict=False) if word != "-"]
    return Compared(field, float(relative[at]), ", ".join(filter(None, [where, *words])))
