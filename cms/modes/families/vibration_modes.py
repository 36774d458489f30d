"""Vibration modes of a body whose interfaces are free, loaded, or partly held (docs/theory.md §2)."""

from dataclasses import replace

import numpy as np

from cms.errors import EigenError
from cms.linear_algebra.solvers.eigen import EigenResult, FactorMismatchError, counting_shift, eigenmodes
from cms.linear_algebra.solvers.mode_count import ModeCount
from cms.linear_algebra.solvers.shift_inverted import ModeRequest
from cms.modes.families.flexibility import Flexibility
from cms.modes.families.rigid_modes import rounding_of_energy, without_energy

__all__ = ["elastic_modes"]

#: rounding of a body's energy over the energy of a mode that its neighbours alone hold, above which omega² is lost
LOST = 2e-3


def elastic_modes(flexibility: Flexibility, wanted: ModeCount) -> EigenResult:
    """Return elastic vibration modes under any boundary conditions of the interfaces, over all dofs (n_dof, k).

    Free modes belong to a free boundary, loaded modes to K + K_load, M + M_load, and mixed modes hold some boundary
    dofs. The rigid-body motions that the conditions leave free are known in advance, and are not among the modes.
    """
    K, M, numbering = flexibility.K, flexibility.M, flexibility.numbering
    try:
        modes = eigenmodes(K, M, replace(wanted, verify=False), factorization=flexibility, numbering=numbering)
    except FactorMismatchError as error:
        raise _lost_in_rounding(flexibility) from error
    if wanted.verify:
        modes = _proven(flexibility, modes, wanted)
    modes = replace(modes, Phi=flexibility.expand(modes.Phi))
    if flexibility.conditions.K_load is not None:
        body, omega2 = flexibility.condensed.body, modes.omega2
        rounding = rounding_of_energy(body, modes.Phi)
        if (without_energy(body, modes.Phi) & (rounding > LOST * omega2)).any():
            raise _lost_in_rounding(flexibility)
    return modes


def _lost_in_rounding(flexibility: Flexibility) -> EigenError:
    """Return the error about motions whose stiffness is near the rounding of the largest stiffness."""
    load = flexibility.conditions.K_load
    largest = float(np.abs(flexibility.K.diagonal()).max())
    softest = "" if load is None else f", those of its neighbours {np.abs(np.diag(load)).max():.1e} at most"
    return EigenError(
        f"body {flexibility.condensed.body.name!r}: its slowest modes are lost in rounding: some motion besides the "
        f"rigid ones has almost no stiffness compared with the largest stiffness, {largest:.1e}{softest}; rounding is "
        f"some {np.finfo(float).eps * largest:.1e}: increase the stiffness of this motion, or remove it"
    )


def _proven(flexibility: Flexibility, modes: EigenResult, asked: ModeCount) -> EigenResult:
    """Return the modes after their number agrees with the inertia, counted for boundary and interior separately.

    The proof of `eigenmodes` factorises K - sigma M as a whole. The reference node of a distributing interface has
    neither mass nor stiffness, only multipliers, so that its pivots there are zero.
    """
    k = len(modes.omega2)
    wanted = ModeRequest(k, None) if asked.cutoff is None else ModeRequest.of(asked)
    last, sigma = counting_shift(modes.omega2, k, wanted, 0.0)
    for n_extra in (4, 12, 36):  # a gap for counting lies beyond the requested modes
        try:
            more = eigenmodes(
                flexibility.K, flexibility.M, k + n_extra, factorization=flexibility, numbering=flexibility.numbering
            )
        except EigenError:  # there are no more modes
            break
        last, sigma = counting_shift(more.omega2, k, wanted, 0.0)
        if last < k + n_extra:
            break
    n_below = flexibility.count_below(sigma)
    if n_below != last:
        raise EigenError(
            f"eigenmodes: found {last} modes below {np.sqrt(sigma) / (2 * np.pi):.6g} Hz, but the inertia counts "
            f"{n_below}; ask for more modes"
        )
    return replace(modes, is_proven=True)
