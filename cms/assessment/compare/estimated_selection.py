"""Automatic selection without a solution of the full model: the fewest modes whose estimated errors are small enough.

(1) count the exact modes up to the end of the band, by the inertia of K - sigma M
(2) compute the set with 8, 16, 32, ... modes, and estimate the errors of as many free frequencies
    (`cms.reduction.error_estimates`), until twice the largest estimate is at most the error, and the last of these
    frequencies lies in the band, so that the set lacks none
(3) find the fewest modes by bisection
"""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from cms.assessment.compare.selection import FEWEST, MOST, Selection, Trial
from cms.errors import ModeSetError
from cms.modes.families.families import Families
from cms.modes.mode_set import ModeSet
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.basis.free_basis import free_basis
from cms.reduction.error_estimates import frequency_errors

__all__ = ["select_by_estimate"]

SAFETY = 2.0  #: true error over its estimate that is allowed for; the estimate is at most the true error


def select_by_estimate(
    families: Families,
    *,
    set: str,
    error: float,
    band: tuple[float, float],
    options: Mapping[str, Any] | None = None,
    added: Callable[[ModeSet], ModeSet] | None = None,
    most: int = MOST,
) -> Selection:
    """Find the fewest modes whose estimated errors of the free frequencies meet an error over a band.

    Parameters
    ----------
    families
        Families of a coupled body.
    set, error, band, options, added, most
        As for `select_modes`.

    Raises
    ------
    ModeSetError
        If the band holds no mode, or no number of modes meets the error.
    EigenError
        If the modes cannot be counted.
    """
    body, time = families.body, families.body.units.time
    low, high = band[0] * time, band[1] * time
    n_band = families.free.count_below((2 * np.pi * high) ** 2)  # (1)
    if not n_band:
        raise ModeSetError(
            f"select_modes: no elastic free mode of body {body.name!r} lies below {band[1]:g} Hz; widen the band, or "
            "measure the frf"
        )
    history: dict[int, Trial] = {}
    sets: dict[int, ModeSet] = {}

    def meets(n: int) -> bool:
        """Return whether the set with n modes meets the error, and record it."""
        try:
            modes = MODE_SETS[set](families, n_modes=n, **(options or {}))
        except ModeSetError as problem:  # such as the set of normal modes with no modes
            history[n] = Trial(n, 0, np.inf, str(problem))
            return False
        sets[n] = modes if added is None else added(modes)
        basis = free_basis(body, sets[n], families)
        reduced = basis.frequencies()
        found, where = np.inf, f"the set has {len(reduced)} elastic modes, the band {n_band}"
        if len(reduced) >= n_band:
            errors = frequency_errors(families, basis, n_band).frequency
            if reduced[n_band - 1] / (1 + errors[-1]) > (1 + error) * high:
                where = f"the set lacks one of the {n_band} elastic modes of the band"
            else:
                judged = np.flatnonzero(reduced[:n_band] >= low)
                k = judged[int(np.argmax(errors[judged]))] if len(judged) else 0
                found, where = SAFETY * float(errors[k]), f"largest at free mode {k + 1}, {reduced[k] / time:.5g} Hz"
        history[n] = Trial(n, len(sets[n].labels), found, where)
        return found <= error

    n_most = min(most, max(0, body.n_dof - len(body.b) - 1))
    failed, n = -1, min(FEWEST, n_most)
    while not meets(n):  # (2)
        if n >= n_most:
            last = history[n]
            raise ModeSetError(
                f"select_modes: mode set {set!r} does not meet an estimated error of {error:g} from {band[0]:g} to "
                f"{band[1]:g} Hz with up to {n} modes: {last.where}; accept a larger error, or take another set or a "
                "lower band"
            )
        failed, n = n, min(n_most, 2 * n)
    while n - failed > 1:  # (3)
        middle = (failed + n) // 2
        failed, n = (failed, middle) if meets(middle) else (middle, n)
    chosen = history[n]
    modes = "no vibration modes are needed for" if n == 0 else f"{n} modes are the fewest with"
    words = (
        f"{set}: {modes} an estimated error of the free frequencies of at most {error:g} from {band[0]:g} to "
        f"{band[1]:g} Hz (twice the estimate counts): {chosen.error:.3g} with these {chosen.n_columns} columns, "
        f"{chosen.where}; all {n_band} elastic modes up to {band[1]:g} Hz are there, as counted"
    )
    asked = {"selected": words, "error": f"{error:g}", "band": f"{band[0]:g} to {band[1]:g} Hz"}
    named = replace(sets[n], options={**sets[n].options, **asked})
    return Selection(named, n, chosen.error, tuple(history[k] for k in sorted(history)), words, asked)
