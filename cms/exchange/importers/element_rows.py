"""Rows for element forces and stresses of a superelement from another program, with names of this project.

Nastran numbers the items of an element force or stress by their position in the output record; the lists below have the
same order. Other element types are left out, because the units of their items are unknown: their record has several
positions (beams with stations, shells with corners), or one item that may be a force or a moment (scalar springs and
dampers).
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cms.errors import ForeignBodyError
from cms.reduction.recovery.blocks import RowName
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.records import frozen_copies
from fe_models.foundation.units import Dimensions

__all__ = ["ForeignRows", "force_rows", "motion_rows", "stress_rows"]

FORCE, MOMENT, STRESS, LENGTH = Dimensions(1, 1, -2), Dimensions(1, 2, -2), Dimensions(1, -1, -2), Dimensions(0, 1, 0)
PER_LENGTH, BENDING = Dimensions(1, 0, -2), Dimensions(1, 1, -2)
SHELL = (
    *((name, PER_LENGTH) for name in ("Nx", "Ny", "Nxy")),
    *((name, BENDING) for name in ("Mx", "My", "Mxy")),
    *((name, PER_LENGTH) for name in ("Qx", "Qy")),
)
ROD = (("N", FORCE), ("T", MOMENT))
SCALAR = (11, 12, 13, 14, 20, 21, 22, 23)  #: types of springs and dampers that have one item
TYPE_NAMES = {
    1: "CROD", 2: "CBEAM", 3: "CTUBE", 4: "CSHEAR", 10: "CONROD", 11: "CELAS1", 12: "CELAS2", 13: "CELAS3",
    14: "CELAS4", 20: "CDAMP1", 21: "CDAMP2", 22: "CDAMP3", 23: "CDAMP4", 24: "CVISC", 33: "CQUAD4", 34: "CBAR",
    38: "CGAP", 39: "CTETRA", 64: "CQUAD8", 67: "CHEXA", 68: "CPENTA", 69: "CBEND", 70: "CTRIAR", 74: "CTRIA3",
    75: "CTRIA6", 82: "CQUADR", 102: "CBUSH", 144: "CQUAD4 with corners",
}  # fmt: skip
FORCE_ITEMS: Mapping[int, tuple[tuple[str, Dimensions], ...]] = {
    1: ROD,
    3: ROD,
    4: (
        *((f"F{a}{b}", FORCE) for a, b in ((4, 1), (2, 1), (1, 2), (3, 2), (2, 3), (4, 3), (3, 4), (1, 4))),
        *(
            (name, unit)
            for k, flow in enumerate(("q12", "q23", "q34", "q41"), start=1)
            for name, unit in ((f"kick {k}", FORCE), (flow, PER_LENGTH))
        ),
    ),
    10: ROD,
    24: ROD,
    33: SHELL,
    34: (
        *((f"end {end} M{plane}", MOMENT) for end in "AB" for plane in (1, 2)),
        *((name, FORCE) for name in ("V1", "V2", "N")),
        ("T", MOMENT),
    ),
    38: (*((name, FORCE) for name in ("fx", "fy", "fz")), *((name, LENGTH) for name in ("u", "v", "w", "sv", "sw"))),
    69: tuple(
        (f"end {end} {name}", MOMENT if name in ("M1", "M2", "T") else FORCE)
        for end in "AB"
        for name in ("M1", "M2", "V1", "V2", "N", "T")
    ),
    74: SHELL,
    102: (*((name, FORCE) for name in ("fx", "fy", "fz")), *((name, MOMENT) for name in ("mx", "my", "mz"))),
}  #: items of element forces by element type, in the order and with the signs of Nastran


@frozen_copies
@dataclass(frozen=True, eq=False)
class ForeignRows:
    """Named rows over the dofs of a superelement."""

    names: tuple[RowName, ...]
    matrix: Array  #: factors of the dofs, (n_rows, n_dof)
    about: str = ""  #: data that are needed to use the rows, for messages

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", frozen(self.matrix))
        if self.matrix.ndim != 2 or len(self.matrix) != len(self.names):
            raise ForeignBodyError(f"recovery: {len(self.names)} names of rows, got a matrix {self.matrix.shape}")
        if not np.isfinite(self.matrix).all():
            raise ForeignBodyError("recovery: expected finite rows")


def force_rows(elements: IntArray, matrix: Array) -> tuple[ForeignRows, tuple[str, ...]]:
    """Return the element forces of known types, and descriptions of the omitted ones.

    Parameters
    ----------
    elements
        (type, id, item from 1) of each row, (n_rows, 3).
    matrix
        Factors of the dofs, (n_rows, n_dof).
    """
    counts = {
        (int(kind), int(number)): int(n)
        for (kind, number), n in zip(*np.unique(elements[:, :2], axis=0, return_counts=True), strict=True)
    }
    names: list[RowName] = []
    taken: list[int] = []
    lost: dict[int, int] = {}
    for row, (kind, number, item) in enumerate(elements.tolist()):
        items = FORCE_ITEMS.get(kind, ())
        if counts[kind, number] != len(items):
            lost[kind] = lost.get(kind, 0) + 1
            continue
        component, dimensions = items[item - 1]
        names.append(RowName("element force", "element", number, str(number), component, dimensions))
        taken.append(row)
    notes = tuple(
        f"element forces (MEF1): {n} rows of {TYPE_NAMES.get(kind, f'type {kind}')} are left out: {why_lost(kind)}"
        for kind, n in lost.items()
    )
    about = "Nastran's items, in the axes and signs of its elements"
    return ForeignRows(tuple(names), matrix[taken], about), notes


def why_lost(kind: int) -> str:
    """Return why the rows of an element type are omitted."""
    if kind in SCALAR:
        return "each is a force or a moment, and the file does not say which"
    return "the order of their forces and moments is unknown"


def stress_rows(elements: IntArray, matrix: Array) -> ForeignRows:
    """Return the element stresses, numbered by item; arguments as for `force_rows`."""
    names = tuple(
        RowName("element stress", "element", number, str(number), f"item {item}", STRESS)
        for _, number, item in elements.tolist()
    )
    return ForeignRows(names, matrix, "Nastran's items, numbered from 1; all are assumed to be stresses")


def motion_rows(dofs: IntArray, matrix: Array) -> ForeignRows:
    """Return displacement rows of nodes in basic axes, from (node number, component 0-5) of each row, (n_rows, 2)."""
    words = ("ux", "uy", "uz", "rx", "ry", "rz")
    names = tuple(
        RowName("displacement", "node", number, str(number), words[c], Dimensions(0, 0 if c >= 3 else 1, 0))
        for number, c in dofs.tolist()
    )
    return ForeignRows(names, matrix, "displacements of all nodes that the files recover")
