"""Contacts that a solver with its own steps misses: open at both ends of a step, but closed between them.

An error estimate contains only forces that the solver has evaluated. Gaps are therefore evaluated along the cubic
through the ends of a step and their rates. If a gap closes only within the step, the solver repeats it: first to just
before the contact, then in steps short enough to end within the contact, where its force enters the error estimate.
(The dense output of a step may have evaluated the force that the step itself has missed.)
"""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["Stretch", "stretches_of_passed_contact"]

PARTS = 5  #: number of equal parts of a step at whose ends gaps are evaluated
WITHIN = 4  #: number of steps that resolve a missed contact
TOLERANCE = 1e-9  #: depth, relative to the change of the gap in the step, below which the contact is ignored


class Stretch(NamedTuple):
    """A part of a motion for which a solver chooses its own steps."""

    end: float  #: end of the part [s]
    most: float = np.inf  #: longest allowed step of the solver [s]


def stretches_of_passed_contact(
    gaps: Callable[[float, Array], Array], t_0: float, t_1: float, y: Array, rates: Array
) -> list[Stretch]:
    """Return the parts before and through the first contact in a step from t_0 to t_1; empty if there is none.

    Parameters
    ----------
    gaps
        Function of time and y that returns all gaps.
    y, rates
        Solution and its rates at both ends, (2, n) each.
    """
    from scipy.interpolate import CubicHermiteSpline
    from scipy.optimize import brentq, minimize_scalar

    way = CubicHermiteSpline([t_0, t_1], y, rates)
    t = np.linspace(t_0, t_1, PARTS + 1)
    values = np.array([gaps(at, way(at)) for at in t])
    found = []
    is_near = values.min(axis=0) <= np.ptp(values, axis=0)  # other gaps change too little to close between the values
    for g in np.flatnonzero((values[0] >= 0.0) & (values[-1] >= 0.0) & is_near):

        def gap(at: float, g: int = int(g)) -> float:
            return float(gaps(at, way(at))[g])

        depth = TOLERANCE * np.ptp(values[:, g])
        k = int(np.argmin(values[1:-1, g])) + 1
        lowest, least = t[k], values[k, g]
        if least >= -depth:  # a gap along a smooth path has one minimum between the neighbours of the lowest value
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
