"""Rows of a superelement that another program calls forces and stresses of elements: what they are, in our words.

Nastran numbers the items of an element force or stress by its output record; those of the types below are its first
words. Types that are not here have forces and moments in an order that is not known: their rows have no unit, and are
left out.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from cms.errors import ForeignBodyError
from cms.recovery.blocks import RowName
from fe_models.foundation.arrays import Array, IntArray, frozen
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.units import Dimensions

__all__ = ["ForeignRows", "force_rows", "motion_rows", "stress_rows"]

FORCE, MOMENT, STRESS = Dimensions(1, 1, -2), Dimensions(1, 2, -2), Dimensions(1, -1, -2)
PER_LENGTH, BENDING = Dimensions(1, 0, -2), Dimensions(1, 1, -2)
SHELL = (
    *((name, PER_LENGTH) for name in ("Nx", "Ny", "Nxy")),
    *((name, BENDING) for name in ("Mx", "My", "Mxy")),
    *((name, PER_LENGTH) for name in ("Qx", "Qy")),
)
TYPE_NAMES = {
    1: "CROD", 2: "CBEAM", 3: "CTUBE", 4: "CSHEAR", 10: "CONROD", 11: "CELAS1", 12: "CELAS2", 13: "CELAS3",
    33: "CQUAD4", 34: "CBAR", 39: "CTETRA", 67: "CHEXA", 68: "CPENTA", 74: "CTRIA3", 102: "CBUSH",
}  # fmt: skip
FORCE_ITEMS: Mapping[int, tuple[tuple[str, Dimensions], ...]] = {
    1: (("N", FORCE), ("T", MOMENT)),
    10: (("N", FORCE), ("T", MOMENT)),
    33: SHELL,
    34: (
        *((f"end {end} M{plane}", MOMENT) for end in "AB" for plane in (1, 2)),
        *((name, FORCE) for name in ("V1", "V2", "N")),
        ("T", MOMENT),
    ),
    74: SHELL,
    102: (*((name, FORCE) for name in ("fx", "fy", "fz")), *((name, MOMENT) for name in ("mx", "my", "mz"))),
}  #: items of element forces by type, in Nastran's order and signs


@frozen_copies
@dataclass(frozen=True, eq=False)
class ForeignRows:
    """Named rows over the dofs of a superelement."""

    names: tuple[RowName, ...]
    matrix: Array  #: (n_rows, n_dof)
    about: str = ""  #: what has to be known of them, in words

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", frozen(self.matrix))
        if self.matrix.ndim != 2 or len(self.matrix) != len(self.names):
            raise ForeignBodyError(f"recovery: {len(self.names)} names of rows, got a matrix {self.matrix.shape}")
        if not np.isfinite(self.matrix).all():
            raise ForeignBodyError("recovery: expected finite rows")


def force_rows(elements: IntArray, matrix: Array) -> tuple[ForeignRows, tuple[str, ...]]:
    """Return the element forces of known types, and in words which were left out.

    Parameters
    ----------
    elements
        (type, id, item from 1) of each row, (n_rows, 3).
    matrix
        (n_rows, n_dof).
    """
    counts = {
        (int(kind), int(number)): int(n)
        for (kind, number), n in zip(*np.unique(elements[:, :2], axis=0, return_counts=True), strict=True)
    }
    names: list[RowName] = []
    taken: list[int] = []
    lost: dict[str, int] = {}
    for row, (kind, number, item) in enumerate(elements.tolist()):
        items = FORCE_ITEMS.get(kind, ())
        if counts[kind, number] != len(items):
            word = TYPE_NAMES.get(kind, f"type {kind}")
            lost[word] = lost.get(word, 0) + 1
            continue
        component, dimensions = items[item - 1]
        names.append(RowName("element force", "element", number, str(number), component, dimensions))
        taken.append(row)
    notes = tuple(
        f"element forces (MEF1): {n} rows of {word} are left out: the order of their forces and moments is not known"
        for word, n in lost.items()
    )
    about = "Nastran's items, in the axes and signs of its elements"
    return ForeignRows(tuple(names), matrix[taken], about), notes


def stress_rows(elements: IntArray, matrix: Array) -> ForeignRows:
    """Return the element stresses, numbered by item; arguments as of `force_rows`."""
    names = tuple(
        RowName("element stress", "element", number, str(number), f"item {item}", STRESS)
        for _, number, item in elements.tolist()
    )
    return ForeignRows(names, matrix, "Nastran's items, numbered from 1; all are taken for stresses")


def motion_rows(dofs: IntArray, matrix: Array) -> ForeignRows:
    """Return displacements of nodes, (node number, component 0-5) of each row, (n_rows, 2), basic axes."""
    words = ("ux", "uy", "uz", "rx", "ry", "rz")
    names = tuple(
        RowName("displacement", "node", number, str(number), words[c], Dimensions(0, 0 if c >= 3 else 1, 0))
        for number, c in dofs.tolist()
    )
    return ForeignRows(names, matrix, "displacements of all nodes that the files recover")
