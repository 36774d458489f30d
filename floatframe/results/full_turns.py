"""Angles over a motion through full turns: by the turns that the run has counted, else from one output to the next."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.compiling.counted_angles import CountedAngle
from floatframe.errors import ResultsError
from floatframe.results.trajectory import Trajectory

__all__ = ["followed_angle", "through_turns"]

TURN = 2 * np.pi
DOUBTFUL = 0.5 * np.pi  #: rad, by which an angle may be off from where its rates lead between two outputs


def through_turns(trajectory: Trajectory, where: str, angle: CountedAngle, value: Array, rate: Array) -> Array:
    """Return an angle, known but for full turns, as it is, (n_t,) [rad].

    Parameters
    ----------
    trajectory
        The motion.
    where
        What it is, for messages.
    angle
        How it is measured; a run counts the angles of its joints and of the sensors its system has.
    value
        Between -pi and pi, (n_t,) [rad].
    rate
        (n_t,) [rad/s].

    Raises
    ------
    ResultsError
        If the run has not counted it, and its outputs are too far apart to follow it.
    """
    for k, known in enumerate(trajectory.head.angles or ()):
        if known.is_same(angle):
            counted = trajectory.source.read("angle")[:, k]
            return np.asarray(value + TURN * np.round((counted - value) / TURN))
    return followed_angle(where, trajectory.t, value, rate)


def followed_angle(where: str, t: Array, value: Array, rate: Array) -> Array:
    """Return an angle that was not counted: each value is the one nearest to where the mean rate leads, (n_t,) [rad].

    Raises
    ------
    ResultsError
        If a value is more than a quarter of a turn away from there.
    """
    expected = 0.5 * (rate[1:] + rate[:-1]) * np.diff(t)
    step = np.diff(value)
    step = step + TURN * np.round((expected - step) / TURN)
    is_lost = np.abs(step - expected) > DOUBTFUL
    if is_lost.any():
        k = int(np.argmax(is_lost))
        raise ResultsError(
            f"{where}: the angle cannot be followed from t = {t[k]:.6g} to {t[k + 1]:.6g}, where it turns by about "
            f"{expected[k]:.3g} rad, and the run did not count it; write results of more steps (output_every), or give "
            "the sensor to the system before the run"
        )
    return np.concatenate([value[:1], value[:1] + np.cumsum(step)])
