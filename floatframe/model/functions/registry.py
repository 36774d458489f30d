"""Functions of time by the `type` of their tables in system files; their arguments are the keys of the tables."""

from collections.abc import Callable
from dataclasses import replace

from floatframe.model.functions.path_motions import rest_to_rest_spline
from floatframe.model.functions.point_to_point import quintic, trapezoid
from floatframe.model.functions.tables import acceleration_table, interpolated
from floatframe.model.functions.time_functions import (
    TimeFunction,
    constant,
    cycloidal_spin_up,
    harmonic,
    piecewise,
    polynomial_of_time,
    smooth_step,
)

__all__ = ["TIME_FUNCTIONS", "measured_signal"]


def measured_signal(signal: TimeFunction, factor: float = 1.0) -> TimeFunction:
    """Return a measured signal multiplied by a factor.

    Parameters
    ----------
    signal
        The signal as a function of time.
    factor
        Factor on its values.
    """
    pieces = signal.pieces.copy()
    pieces[:, :7] *= factor
    return replace(signal, pieces=pieces)


TIME_FUNCTIONS: dict[str, Callable[..., TimeFunction]] = {
    "constant": constant,
    "polynomial": polynomial_of_time,
    "harmonic": harmonic,
    "smooth-step": smooth_step,
    "quintic": quintic,
    "trapezoid": trapezoid,
    "spline": rest_to_rest_spline,
    "cycloidal-spin-up": cycloidal_spin_up,
    "table": interpolated,
    "acceleration-table": acceleration_table,
    "signal": measured_signal,
    "piecewise": piecewise,
}
