"""Numbers of frequency responses: the greatest amplitude in a band, the least, means, or that at one frequency."""

from collections.abc import Callable

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.linear.frequency_response import resolved_frequencies
from floatframe.analyses.linear.linearization import LinearSystem
from floatframe.design.optimization.design import Quantity
from floatframe.errors import ModelError

__all__ = ["response_number"]

GRID = 120  #: frequencies evenly over a band, beside those about its resonances
LIKELY = 0.8  #: of the best on the grid, from which on an extreme between its neighbours is looked at


def response_number(quantity: Quantity, linear: LinearSystem, per_second: float) -> float:
    """Return the number that a quantity takes from the amplitude of a frequency response.

    The extremes of a band are found on a grid that is fine about resonances, then between the points of the grid, so
    that the number changes smoothly with the parameters.

    Parameters
    ----------
    quantity
        Of the analysis "response"; it is of "OUTPUT / INPUT".
    linear
        With the inputs and outputs of the system file.
    per_second
        From frequencies of the system to Hz.
    """
    amplitude = amplitude_of(quantity, linear, per_second)
    if quantity.at is not None:
        return float(amplitude(np.array([quantity.at]))[0])
    assert quantity.band is not None  # by `read_design`
    first, last = quantity.band
    f = resolved_frequencies(linear, first / per_second, last / per_second, n=GRID) * per_second
    a = amplitude(f)
    take = quantity.output.take
    if take in ("mean", "rms"):
        mean = np.trapezoid(a if take == "mean" else a**2, f) / (last - first)
        return float(mean if take == "mean" else np.sqrt(mean))
    return extreme(amplitude, f, a, 1.0 if take == "greatest" else -1.0)


def amplitude_of(quantity: Quantity, linear: LinearSystem, per_second: float) -> Callable[[Array], Array]:
    """Return the amplitude over frequencies in Hz; `ModelError` if there is no such output or input."""
    of = quantity.output.of
    names = of.split(" / ")
    if len(names) != 2:
        raise ModelError(f'{quantity.output.name}: of = {of!r}: expected "OUTPUT / INPUT", of a frequency response')
    places = []
    for name, known, kind in zip(names, (linear.outputs, linear.inputs), ("output", "input"), strict=True):
        if name not in known:
            hint = nearest(name, known) or f"; it has {', '.join(known) or 'none'}"
            raise ModelError(f"{quantity.output.name}: of = {of!r}: the system has no {kind} {quoted(name)}{hint}")
        places.append(known.index(name))
    i, j = places
    return lambda f: np.abs(linear.response(np.asarray(f) / per_second)[:, i, j])


def extreme(amplitude: Callable[[Array], Array], f: Array, a: Array, sign: float) -> float:
    """Return the greatest (sign 1) or least (-1) amplitude, looked for between the points of the grid too."""
    from scipy.optimize import minimize_scalar

    best = float((sign * a).max())
    limit = LIKELY * best if sign > 0 else best / LIKELY
    for k in range(1, len(f) - 1):
        if sign * a[k] >= limit and sign * a[k] >= sign * a[k - 1] and sign * a[k] >= sign * a[k + 1]:
            found = minimize_scalar(
                lambda x: -sign * amplitude(np.array([x]))[0], bounds=(f[k - 1], f[k + 1]), method="bounded",
                options={"xatol": 1e-9 * f[k]},
            )  # fmt: skip
            best = max(best, -float(found.fun))
    return sign * best
