"""Functions of time for prescribed motions: piecewise, each piece a polynomial of degree five plus one sine.

The kernels only know this form. All user input (a table, a formula, a callable) is converted to it here.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import factorial, perm

import numpy as np

from fe_models.foundation.arrays import Array, frozen
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = [
    "NOT_OF_TIME",
    "TimeFunction",
    "constant",
    "cycloidal_spin_up",
    "harmonic",
    "piecewise",
    "polynomial_of_time",
    "sampled",
    "smooth_step",
    "table",
]

#: coefficients of a piece: six of a polynomial in t - t_k, then amplitude, angular frequency and phase of a sine
N_COEFFICIENTS = 9
MOST_PIECES = 20000

#: metadata of fields whose functions do not depend on time
NOT_OF_TIME = {"of_time": False}


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class TimeFunction:
    """A piecewise function; the first piece also applies before its start, and the last one has no end.

    Parameters
    ----------
    begins
        Start times of the pieces, increasing, (n,) [s].
    pieces
        Coefficients, (n, 9): Σ_k c_k (t - t_k)^k + amplitude sin(omega (t - t_k) + phase).
    """

    begins: Array
    pieces: Array

    def __post_init__(self) -> None:
        begins, pieces = np.array(self.begins, dtype=float), np.array(self.pieces, dtype=float)
        if begins.ndim != 1 or not len(begins) or pieces.shape != (len(begins), N_COEFFICIENTS):
            raise ModelError(
                f"TimeFunction: expected n times and ({N_COEFFICIENTS}) coefficients for each, got shapes "
                f"{begins.shape} and {pieces.shape}"
            )
        if not np.isfinite(begins).all() or not np.isfinite(pieces).all() or (np.diff(begins) <= 0).any():
            raise ModelError("TimeFunction: expected finite numbers and rising times")
        object.__setattr__(self, "begins", frozen(begins))
        object.__setattr__(self, "pieces", frozen(pieces))

    def jumps(self, order: int) -> tuple[Array, Array]:
        """Return the times at which the derivative of an order (0: value) jumps, and the jumps, (n,) each.

        A jump must exceed 1e-9 of the magnitudes of the numbers on both sides, unless these are negligible (denormal).
        """
        length = np.diff(self.begins)
        before, after = at_pieces(self.pieces[:-1], length, order), at_pieces(self.pieces[1:], 0.0, order)
        scale = np.maximum(piece_sizes(self.pieces[:-1], length, order), piece_sizes(self.pieces[1:], 0.0, order))
        is_jump = np.abs(after - before) > np.maximum(1e-9 * scale, np.finfo(float).tiny)
        return self.begins[1:][is_jump], (after - before)[is_jump]

    def __call__(self, t: float, order: int = 0) -> float:
        """Return the value at t, or its first or second derivative."""
        return float(self.at(np.array([t]), order)[0])

    def at(self, t: Array, order: int = 0) -> Array:
        """Return the values, or derivatives of an order, at times t, (n_t,)."""
        t = np.asarray(t, dtype=float)
        k = np.maximum(np.searchsorted(self.begins, t, side="right") - 1, 0)
        return at_pieces(self.pieces[k], t - self.begins[k], order)


def at_pieces(c: Array, x: Array | float, order: int = 0) -> Array:
    """Return values or derivatives of pieces c, (n, 9), at times x, (n,), since their starts."""
    smooth = np.zeros(len(c))
    for k in range(5, order - 1, -1):  # Horner's scheme
        smooth = smooth * x + perm(k, order) * c[:, k]
    amplitude, omega, phase = c[:, 6], c[:, 7], c[:, 8]
    return smooth + amplitude * omega**order * np.sin(omega * x + phase + order * np.pi / 2)


def piece_sizes(c: Array, x: Array | float, order: int) -> Array:
    """Return the sums of absolute terms in `at_pieces`, (n,), to which rounding errors are proportional."""
    c, x = np.abs(c), np.abs(x)
    terms = np.zeros(len(c))
    for k in range(5, order - 1, -1):
        terms = terms * x + perm(k, order) * c[:, k]
    return terms + c[:, 6] * c[:, 7] ** order * (1 + c[:, 7] * x)


def one_piece(coefficients: list[float], sine: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> TimeFunction:
    """Return a function with one piece that starts at t = 0."""
    row = np.zeros((1, N_COEFFICIENTS))
    row[0, : len(coefficients)] = coefficients
    row[0, 6:] = sine
    return TimeFunction(np.zeros(1), row)


def constant(value: float) -> TimeFunction:
    """Return a constant function.

    Parameters
    ----------
    value
        The value.
    """
    return one_piece([number("constant: value", value)])


def polynomial_of_time(coefficients: list[float]) -> TimeFunction:
    """Return the polynomial c_0 + c_1 t + c_2 t² + ..., up to t⁵.

    Parameters
    ----------
    coefficients
        Coefficients of 1, t, t² and so on.
    """
    if not 1 <= len(coefficients) <= 6:
        raise ModelError(f"polynomial: expected one to six coefficients, c_0 first, got {len(coefficients)}")
    return one_piece([number("polynomial: coefficients", c) for c in coefficients])


def harmonic(amplitude: float, omega: float, phase: float = 0.0, offset: float = 0.0) -> TimeFunction:
    """Return offset + amplitude sin(omega t + phase); omega in rad/s.

    Parameters
    ----------
    amplitude
        The amplitude.
    omega
        Angular frequency [rad/s].
    phase
        Phase at t = 0 [rad].
    offset
        Mean value.
    """
    a, w, p, o = (
        number(f"harmonic: {n}", v)
        for n, v in zip(("amplitude", "omega", "phase", "offset"), (amplitude, omega, phase, offset), strict=True)
    )
    return one_piece([o], (a, w, p))


def smooth_step(t_start: float, t_end: float, first: float, last: float) -> TimeFunction:
    """Return the polynomial of degree five from first to last, with zero rate and second rate at both ends.

    Parameters
    ----------
    t_start, t_end
        Times at which the step begins and ends [s].
    first, last
        Values before and after the step.
    """
    t_start, t_end = number("smooth_step: t_start", t_start), number("smooth_step: t_end", t_end)
    first, last = number("smooth_step: first", first), number("smooth_step: last", last)
    if t_end <= t_start:
        raise ModelError(f"smooth_step: expected t_end above t_start = {t_start:g}, got {t_end:g}")
    T, rise = t_end - t_start, last - first
    pieces = np.zeros((3, N_COEFFICIENTS))
    pieces[0, 0] = first
    pieces[1, :6] = [first, 0, 0, 10 * rise / T**3, -15 * rise / T**4, 6 * rise / T**5]
    pieces[2, 0] = last
    return TimeFunction(np.array([t_start - 1.0, t_start, t_end]), pieces)


def cycloidal_spin_up(omega: float, duration: float) -> TimeFunction:
    """Return omega (t²/(2T) + (T/(2 pi))² (cos(2 pi t/T) - 1)/T) until T, then omega (t - T/2): a gradual spin-up.

    Its rate rises from zero to omega without a jump of the acceleration (the spin-up of rotating beams).

    Parameters
    ----------
    omega
        Angular speed or angular frequency that is reached [rad/s].
    duration
        Duration T of the spin-up [s].
    """
    omega, T = number("cycloidal_spin_up: omega", omega), number("cycloidal_spin_up: duration", duration, above=0.0)
    s = omega * T / (2 * np.pi) ** 2
    pieces = np.zeros((3, N_COEFFICIENTS))
    pieces[1] = [-s, 0, omega / (2 * T), 0, 0, 0, s, 2 * np.pi / T, np.pi / 2]
    pieces[2, :2] = [omega * T / 2, omega]
    return TimeFunction(np.array([-1.0, 0.0, T]), pieces)


def piecewise(t: Sequence[float], pieces: Sequence[TimeFunction]) -> TimeFunction:
    """Return a function that follows pieces[k] from t[k] on, evaluated at the time since t[k].

    The first piece also holds before t[0], and the last one has no end. Values may jump between pieces (for forces). A
    prescribed motion must not jump in value or rate, and is then rejected.

    Parameters
    ----------
    t
        Rising times at which the pieces begin [s].
    pieces
        A function of the time since its beginning for each time.
    """
    begins = [number("piecewise: t", each) for each in t]
    if not begins or len(begins) != len(pieces) or (np.diff(begins) <= 0).any():
        raise ModelError(
            f"piecewise: expected rising times and as many functions, got {len(begins)} times and {len(pieces)} "
            "functions" + ("; the times do not rise" if (np.diff(begins) <= 0).any() else "")
        )
    times, rows = [], []
    for k, (begin, function) in enumerate(zip(begins, pieces, strict=True)):
        length = begins[k + 1] - begin if k + 1 < len(begins) else np.inf
        if k == 0:
            inside = function.begins < length
            times += list(begin + function.begins[inside])
            rows += list(function.pieces[inside])
            if not inside.any():  # only its first piece, which also holds before its start
                times.append(begin)
                rows.append(moved_piece(function.pieces[0], -function.begins[0]))
            continue
        first = max(int(np.searchsorted(function.begins, 0.0, side="right")) - 1, 0)
        times.append(begin)
        rows.append(moved_piece(function.pieces[first], -function.begins[first]))
        for later in range(first + 1, len(function.begins)):
            if 0.0 < function.begins[later] < length:
                times.append(begin + function.begins[later])
                rows.append(function.pieces[later])
    return TimeFunction(np.array(times), np.array(rows))


def moved_piece(c: Array, x: float) -> Array:
    """Return the coefficients of a piece whose origin moves to a time x after its start."""
    row = np.array(c)
    smooth = np.concatenate([c[:6], np.zeros(3)])[None, :]
    row[:6] = [at_pieces(smooth, x, k)[0] / factorial(k) for k in range(6)]
    row[8] = c[8] + c[7] * x
    return row


def table(t: Array, values: Array) -> TimeFunction:
    """Return the cubic spline (not-a-knot) of a table, which continues along its end tangents.

    Parameters
    ----------
    t
        Times, rising, (n,) [s].
    values
        Values at these times, (n,).
    """
    from scipy.interpolate import CubicSpline

    t, values = np.array(t, dtype=float), np.array(values, dtype=float)
    if t.ndim != 1 or t.shape != values.shape or len(t) < 4:
        raise ModelError(f"table: expected four or more times and as many values, got {t.shape} and {values.shape}")
    if not np.isfinite(t).all() or not np.isfinite(values).all() or (np.diff(t) <= 0).any():
        raise ModelError("table: expected finite numbers and rising times")
    spline = CubicSpline(t, values)
    pieces = np.zeros((len(t) + 1, N_COEFFICIENTS))
    pieces[1:-1, :4] = spline.c[::-1].T
    pieces[0, :2] = [values[0] - spline(t[0], 1), spline(t[0], 1)]
    pieces[-1, :2] = [values[-1], spline(t[-1], 1)]
    return TimeFunction(np.concatenate([[t[0] - 1.0], t]), pieces)


def sampled(function: Callable[[float], float], t_start: float, t_end: float, tolerance: float) -> TimeFunction:
    """Return a spline of a Python function; the number of knots doubles until errors between them are below tolerance.

    Parameters
    ----------
    function
        Function of the time [s].
    t_start, t_end
        Times between which it is sampled [s].
    tolerance
        Largest error of the spline between its knots, in the unit of the values.

    Raises
    ------
    ModelError
        If the tolerance is not reached with 20000 pieces, because the function jumps or has a kink.
    """
    n = 16
    error = np.inf
    while n <= MOST_PIECES:
        t = np.linspace(t_start, t_end, n + 1)
        spline = table(t, np.array([function(float(x)) for x in t]))
        between = np.concatenate([t[:-1] + part * np.diff(t) for part in (0.21, 0.5, 0.79)])
        error = max(abs(spline(float(x)) - function(float(x))) for x in between)
        if error <= tolerance:
            return spline
        n *= 2
    raise ModelError(
        f"sampled: {MOST_PIECES} pieces approximate the function within {error:.3g}, expected {tolerance:.3g}; it "
        "jumps or has a kink: give pieces between jumps and kinks, or a larger tolerance"
    )
