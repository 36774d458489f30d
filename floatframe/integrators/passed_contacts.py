"""Contacts that a solver with steps of its own passes over: open at both ends of a step, closed between them.

An error estimate knows only what the solver has evaluated. The cubic through the ends of a step and their rates shows
the rest: where a gap is closed within the step alone, the solver goes anew to just before it, then in steps that end
within the contact. There its force enters the error estimate. (The dense output of a step may have evaluated the force
that the step itself has not seen.)
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["Stretch", "stretches_of_passed_contact"]

PARTS = 5  #: of a step, at whose ends gaps are evaluated
WITHIN = 4  #: steps within a contact that was passed over
TOLERANCE = 1e-9  #: depth that is no contact, by the change of the gap in the step


class Stretch(NamedTuple):
    """A stretch of a motion that a solver makes by itself."""

    end: float  #: [s]
    most: float = np.inf  #: its longest step [s]


def stretches_of_passed_contact(
    gaps: Callable[[float, Array], Array], t_0: float, t_1: float, y: Array, rates: Array
) -> list[Stretch]:
    """Return the stretches to and through the first contact within a step from t_0 to t_1; none without one.

    Parameters
    ----------
    gaps
        Gaps of a time and y.
    y, rates
        Solution and its rates at both ends, (2, n) each.
    """
    from scipy.interpolate import CubicHermiteSpline
    from scipy.optimize import brentq, minimize_scalar

    way = CubicHermiteSpline([t_0, t_1], y, rates)
    t = np.linspace(t_0, t_1, PARTS + 1)
    values = np.array([gaps(at, way(at)) for at in t])
    found = []
    for g in np.flatnonzero((values[0] >= 0.0) & (values[-1] >= 0.0)):

        def gap(at: float, g: int = int(g)) -> float:
            return float(gaps(at, way(at))[g])

        depth = TOLERANCE * np.ptp(values[:, g])
        k = int(np.argmin(values[1:-1, g])) + 1
        lowest, least = t[k], values[k, g]
        if least >= -depth:  # a gap along a smooth way has one minimum between the places beside the lowest
            best = minimize_scalar(gap, bounds=(t[k - 1], t[k + 1]), method="bounded")
            lowest, least = float(best.x), float(best.fun)
        if least < -depth:
            begin, end = brentq(gap, t_0, lowest), brentq(gap, lowest, t_1)
            found.append((begin, end))
    if not found:
        return []
    begin, end = min(found)
    before, through = 2 * begin - end, Stretch(2 * end - begin, (end - begin) / WITHIN)
    return [Stretch(before), through] if before > t_0 else [through]
