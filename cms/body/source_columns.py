"""Origin of modes: the share of each column of the mode set in the energy of a mode, and a label."""

from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import ArrayShape, checked_fields, frozen_copies

__all__ = ["SourceColumns", "source_columns"]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class SourceColumns:
    """Columns from which a reduced body was computed, with data that give their shares in the energy of any mode.

    With phi_k = Σ_c v_c A_ck and F_ck = v_cᵀ K phi_k, the term A_ck F_ck is the contribution of column c to the energy
    phi_kᵀ K phi_k. It does not change if the column is scaled; the scale is chosen so that A and F have the same size
    and unit. Both are linear in the mode, so they can be transformed with the modes to another frame.
    """

    labels: Annotated[tuple[str, ...], ArrayShape(("n_columns",))]  #: label of each column
    groups: Annotated[tuple[str, ...], ArrayShape(("n_columns",))]  #: group of each column
    A: Annotated[Array, ArrayShape(("n_columns", "n_q"))]  #: coordinates of the modes in terms of the columns [1/s]
    #: work of the elastic force K phi_k of each mode on each column [1/s]
    F: Annotated[Array, ArrayShape(("n_columns", "n_q"))]

    @property
    def sources(self) -> tuple[str, ...]:
        """Groups of the columns, each listed once, in their order."""
        return tuple(dict.fromkeys(self.groups))

    def shares(self) -> Array:
        """Return |A_ck F_ck| over its sum over c, (n_q, n_columns); each row sums to 1.

        The terms without absolute value sum to the energy, but some are negative if columns work against each other.
        """
        work = np.abs(np.asarray(self.A) * self.F)
        total = work.sum(axis=0)
        return np.divide(work, total, out=np.zeros_like(work), where=total > 0).T

    def group_shares(self) -> Array:
        """Return the shares of the groups, (n_q, n_sources)."""
        return self.shares() @ np.array([[group == s for s in self.sources] for group in self.groups], dtype=float)

    def mode_labels(self) -> tuple[str, ...]:
        """Return a label of each mode: 'constraint left ux (93 %)', or the two columns with the largest shares."""
        found = []
        for shares in self.shares():
            order = np.argsort(shares)[::-1]
            is_nearly_all = shares[order[0]] > 0.9 or len(order) < 2 or shares[order[1]] < 0.05
            parts = order[:1] if is_nearly_all else order[:2]
            found.append(", ".join(f"{self.labels[k]} ({100 * shares[k]:.0f} %)" for k in parts))
        return tuple(found)

    def of_modes(self, Z: Array) -> "SourceColumns":
        """Return the source columns of the modes Phi Z."""
        return replace(self, A=np.asarray(self.A) @ Z, F=np.asarray(self.F) @ Z)


def source_columns(labels: tuple[str, ...], groups: tuple[str, ...], A: Array, F: Array) -> SourceColumns:
    """Return the columns, with A and F of each scaled to equal size: A_c s and F_c / s with s² = |F_c| / |A_c|.

    A column without forces (a rigid-body motion) does not contribute to any energy; both rows are then zero.
    """
    size_A, size_F = np.linalg.norm(A, axis=1), np.linalg.norm(F, axis=1)
    works = (size_A > 0) & (size_F > 0)
    s = np.sqrt(np.divide(size_F, size_A, out=np.ones(len(A)), where=works))[:, None]
    return SourceColumns(labels, groups, np.where(works[:, None], A * s, 0.0), np.where(works[:, None], F / s, 0.0))
