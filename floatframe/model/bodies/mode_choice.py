"""A reduced body with a subset of its modes, which is stiffer, for comparisons."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cms.body.recovery_table import N_RIGID
from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from floatframe.errors import ModelError

__all__ = ["frozen_to_rigid", "with_modes", "without_modes"]


def with_modes(body: ReducedBody, modes: Sequence[int]) -> ReducedBody:
    """Return the body with only the modes of these numbers (from zero), in this order.

    Mass, inertia, interfaces and nodes are kept. Stress points, the columns of the mode set and the data for another
    body frame are removed. Results have fewer modes than the file, so that films of them need this body.

    Parameters
    ----------
    body
        The reduced body, which does not change.
    modes
        Numbers of the modes, from zero.

    Raises
    ------
    ModelError
        If a number is out of range or given twice.
    """
    chosen = [int(k) for k in modes]
    if any(not 0 <= k < body.n_q for k in chosen) or len(set(chosen)) != len(chosen):
        raise ModelError(
            f"with_modes: body {body.name!r} has modes 0 to {body.n_q - 1}, each to be named once, got {chosen}"
        )
    k = np.array(chosen, dtype=np.int64)
    coordinates = np.concatenate([np.arange(N_RIGID), N_RIGID + k])
    moments = body.moments

    def square(matrix: Array) -> Array:
        return np.asarray(matrix)[np.ix_(k, k)]

    return replace(
        body,
        M=square(body.M),
        K=square(body.K),
        D=square(body.D),
        labels=tuple(body.labels[i] for i in chosen),
        energy_shares=np.asarray(body.energy_shares)[k],
        moments=replace(
            moments,
            C1=moments.C1[:, k],
            P=moments.P[:, :, k],
            S_kl=moments.S_kl[:, :, k][:, :, :, k],
        ),
        free_frequencies=np.zeros(0),
        errors=None,  # those of all modes together
        Phi=body.Phi[:, :, k],
        interfaces=tuple(replace(i, Psi=i.Psi[:, k]) for i in body.interfaces),
        columns=None,
        nodal_sums=None,
        kept=None if body.kept is None else body.kept.of_modes(np.eye(body.n_q)[:, k]),
        load_cases=tuple(replace(case, h=case.h[k]) for case in body.load_cases),
        stress=None if body.stress is None else body.stress[:, :, k],
        point_stress=None,
        recovery={
            name: replace(table, dynamic=table.dynamic[:, :, coordinates]) for name, table in body.recovery.items()
        },
        geometric=None if body.geometric is None else replace(body.geometric, spread=None).of_modes(k),
        quadratic=None if body.quadratic is None else np.asarray(body.quadratic)[:, :, k[:, None], k],
    )


def without_modes(body: ReducedBody, modes: Sequence[int]) -> ReducedBody:
    """Return the body without the modes with these numbers."""
    off = {int(k) for k in modes}
    if any(not 0 <= k < body.n_q for k in off):
        raise ModelError(f"without_modes: body {body.name!r} has modes 0 to {body.n_q - 1}, got {sorted(off)}")
    return with_modes(body, [k for k in range(body.n_q) if k not in off])


def frozen_to_rigid(body: ReducedBody) -> ReducedBody:
    """Return the body without any modes: a rigid body with the same mass, inertia and interfaces."""
    return with_modes(body, [])
