"""Condition number of the columns of a mode set before the finishing step."""

import numpy as np

from cms.assessment.quality.record import QualityRecord, judge
from cms.linear_algebra.independent import independent_columns
from cms.modes.mode_set import ModeSet
from cms.reduction.basis.free_basis import FreeBasis
from fe_models.body.fe_body import FEBody
from fe_models.foundation.tall.columns import inner

__all__ = ["column_condition", "conditioning_record", "dropped_record"]


def column_condition(body: FEBody, modes: ModeSet, omega2: float) -> tuple[float, tuple[str, ...]]:
    """Return the condition number of the independent columns at unit length in the W-norm, and the dropped columns.

    With W-orthonormal Q the columns are V = Q (Qᵀ W V), so V has the condition number of the small matrix Qᵀ W V. The
    Gram matrix of V would have its square, and rounding would hide large values.
    """
    V = modes.columns
    Q, redundant = independent_columns(V, body, omega2)
    kept = np.setdiff1d(np.arange(V.shape[1]), redundant)
    T = inner(Q.KX + omega2 * Q.MX, V)[:, kept]
    T = T / np.linalg.norm(T, axis=0)
    return float(np.linalg.cond(T)), tuple(modes.labels[k] for k in redundant)


def conditioning_record(condition: float, n_columns: int) -> QualityRecord:
    """Return the record "conditioning"."""
    digits = max(0.0, np.log10(condition)) if condition > 0 else np.inf
    reason = f"condition number {condition:.2e}: about {digits:.0f} of 16 digits are lost among the kept columns"
    return judge("conditioning", condition, reason, {"n_columns": n_columns})


def dropped_record(basis: FreeBasis, n_columns: int) -> QualityRecord:
    """Return the record "dropped-columns" of a mode set, which lists the dropped columns."""
    labels = basis.dropped
    reason = f"{len(labels)} of {n_columns} columns: {'; '.join(labels)}" if labels else "every column is independent"
    return judge("dropped-columns", float(len(labels)), reason, {"labels": labels})
