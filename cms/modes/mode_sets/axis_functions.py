"""Functions along the axis of a slender body: monomials, Legendre polynomials, cubic splines, with derivatives."""

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import Legendre, Polynomial
from scipy.interpolate import BSpline

from cms.errors import ModeSetError
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted

__all__ = ["AXIS_FUNCTIONS", "AxisFunctions", "axis_functions"]

CUBIC = 3


@dataclass(frozen=True, eq=False)
class AxisFunctions:
    """Functions of the axis coordinate s and their derivatives at given points."""

    values: Array  #: function values, (n_points, n) [-]
    slopes: Array  #: first derivatives with respect to s, (n_points, n) [1/m]
    curvatures: Array  #: second derivatives with respect to s, (n_points, n) [1/m²]
    names: tuple[str, ...]  #: name of each function, such as "P4"


def _polynomials(
    kind: type[Legendre] | type[Polynomial], letter: str, s: Array, span: Array, n: int, first: int
) -> AxisFunctions:
    """Return polynomials of degree first .. first + n - 1 of xi in [-1, 1] over the span."""
    middle, half = span.mean(), np.ptp(span) / 2
    xi = (s - middle) / half
    functions = [kind.basis(degree) for degree in range(first, first + n)]
    derivatives = [[f.deriv(d)(xi) / half**d if d else f(xi) for f in functions] for d in range(3)]
    tables = [np.array(rows).reshape(n, len(s)).T for rows in derivatives]
    values, slopes, curvatures = tables
    return AxisFunctions(values, slopes, curvatures, tuple(f"{letter}{degree}" for degree in range(first, first + n)))


def monomials(s: Array, span: Array, n: int, first: int) -> AxisFunctions:
    """Return n monomials of xi in [-1, 1], beginning with degree `first`."""
    return _polynomials(Polynomial, "xi^", s, span, n, first)


def legendre(s: Array, span: Array, n: int, first: int) -> AxisFunctions:
    """Return n Legendre polynomials of xi in [-1, 1], beginning with degree `first`."""
    return _polynomials(Legendre, "P", s, span, n, first)


def cubic_splines(s: Array, span: Array, n: int, first: int) -> AxisFunctions:
    """Return cubic B-splines over equal parts of the span; with degrees below `first` they span all cubic splines.

    All n + first B-splines contain 1 = sum B_j and s = sum g_j B_j, where the Greville points g_j are distinct.
    Therefore the first B-spline (if the set has 1) or the first and the last (if it has 1 and s) can be left out.
    """
    n_all = n + first
    if n_all < CUBIC + 1:
        raise ModeSetError(
            f"assumed_modes: expected at least {CUBIC + 1 - first} cubic splines here, got {n}; choose "
            f"{CUBIC + 1 - first} or more, or Legendre polynomials"
        )
    inner = np.linspace(span[0], span[1], n_all - CUBIC + 1)
    knots = np.concatenate([np.full(CUBIC, span[0]), inner, np.full(CUBIC, span[1])])
    kept = np.arange(1, n + 1)
    splines = BSpline(knots, np.eye(n_all)[:, kept], CUBIC)
    return AxisFunctions(
        splines(s), splines.derivative(1)(s), splines.derivative(2)(s), tuple(f"B{j + 1}" for j in kept)
    )


AXIS_FUNCTIONS = {"legendre": legendre, "monomials": monomials, "splines": cubic_splines}


def axis_functions(family: str, s: Array, span: Array, n: int, first: int) -> AxisFunctions:
    """Return n functions of a family at the points s in the span; degrees below `first` complete them."""
    if family not in AXIS_FUNCTIONS:
        raise ModeSetError(f"assumed_modes: unknown functions {quoted(family)}{nearest(family, AXIS_FUNCTIONS)}")
    return AXIS_FUNCTIONS[family](s, span, n, first)
