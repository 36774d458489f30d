"""Mode sets with fewer vibration modes, made from the columns of the largest set: V_n = V C_n."""

from collections.abc import Callable

import numpy as np

from cms.modes.mode_set import ModeSet
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["SUBSETS", "Subset", "column_subset", "leading_subset", "residual_subset", "whole_set"]

Subset = Callable[[ModeSet, Array, int], tuple[Array, tuple[str, ...]]]


def column_subset(modes: ModeSet, at_b: Array, n_modes: int) -> tuple[Array, tuple[str, ...]]:
    """Select the static columns and the first n_modes vibration columns.

    Parameters
    ----------
    modes
        Largest set.
    at_b
        Rows of this set at the boundary dofs, (n_b, n_columns).
    n_modes
        Number of vibration columns.

    Returns
    -------
    C
        Coefficients of the subset in the columns of the largest set, (n_columns, k).
    labels
        Label of each column of the subset, (k,).
    """
    kept = _retained_columns(modes, n_modes)
    return np.eye(len(modes.labels))[:, kept], tuple(modes.labels[k] for k in kept)


def residual_subset(modes: ModeSet, at_b: Array, n_modes: int) -> tuple[Array, tuple[str, ...]]:
    """Use fewer free modes, and add the static contribution of the removed modes to the residual attachment modes.

    residual_n = Psi_U - Phi_n Lambda_n⁻¹ Phi_n,Bᵀ = residual_N + sum over n < k <= N of phi_k omega_k⁻² phi_k,Bᵀ, for
    M-orthonormal phi_k. Parameters and returned values are those of `column_subset`.
    """
    kept = _retained_columns(modes, n_modes)
    C = np.eye(len(modes.labels))
    gone = np.setdiff1d(np.arange(len(modes.labels)), kept)
    residual = np.flatnonzero([group.startswith("residual") for group in modes.groups])
    omega2 = (2 * np.pi * modes.frequencies[gone]) ** 2
    C[np.ix_(gone, residual)] = (at_b[:, gone] / omega2).T
    return C[:, kept], tuple(modes.labels[k] for k in kept)


def leading_subset(modes: ModeSet, at_b: Array, n_modes: int) -> tuple[Array, tuple[str, ...]]:
    """Select the rigid-body and first-block columns (`n_static`, not counted by n_modes) and the next n_modes ones."""
    n = min(int(modes.data["n_static"][0]) + n_modes, len(modes.labels))
    return np.eye(len(modes.labels), n), modes.labels[:n]


def whole_set(modes: ModeSet, at_b: Array, n_modes: int) -> tuple[Array, tuple[str, ...]]:
    """Select all columns, for a set without vibration modes."""
    return np.eye(len(modes.labels)), modes.labels


def _retained_columns(modes: ModeSet, n_modes: int) -> IntArray:
    vibration = np.flatnonzero(~modes.is_static)[:n_modes]
    return np.sort(np.concatenate([np.flatnonzero(modes.is_static), vibration])).astype(np.int64)


#: sets that are made once, with the largest number of modes; others are recomputed for each number ("multilevel", whose
#: tree depends on the highest frequency)
SUBSETS: dict[str, Subset] = {
    "guyan": whole_set,
    "craig-bampton": column_subset,
    "craig-bampton-ir": column_subset,
    "benfield-hruda": column_subset,
    "attachment": column_subset,
    "unrestrained-attachment": column_subset,
    "herting": column_subset,
    "normal": column_subset,
    "rubin": residual_subset,
    "macneal": residual_subset,
    "dual-craig-bampton": residual_subset,
    "krylov": leading_subset,
}
