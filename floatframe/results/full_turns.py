"""Angles counted through full turns: by the turns that the run counted, otherwise from one output to the next."""

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.counted_angles import CountedAngle
from floatframe.errors import ResultsError
from floatframe.results.trajectory import Trajectory

__all__ = ["followed_angle", "through_turns"]

TURN = 2 * np.pi
#: largest difference between an angle and its extrapolation by rates over one output interval [rad]
DOUBTFUL = 0.5 * np.pi


def through_turns(trajectory: Trajectory, where: str, angle: CountedAngle, value: Array, rate: Array) -> Array:
    """Return an angle that is known up to full turns, with its full turns added, (n_t,) [rad].

    Parameters
    ----------
    trajectory
        The motion.
    where
        Description of the angle, for messages.
    angle
        Definition of the angle; a run counts the angles of its joints and of the sensors of its system.
    value
        The angle between -pi and pi, (n_t,) [rad].
    rate
        Its rate, (n_t,) [rad/s].

    Raises
    ------
    ResultsError
        If the run has not counted it, and the outputs are too far apart to follow it.
    """
    for k, known in enumerate(trajectory.head.angles or ()):
        if known.is_same(angle):
            counted = trajectory.source.read("angle")[:, k]
            return np.asarray(value + TURN * np.round((counted - value) / TURN))
    return followed_angle(where, trajectory.t, value, rate)


def followed_angle(where: str, t: Array, value: Array, rate: Array) -> Array:
    """Return an angle without a count, each value nearest to its extrapolation by the mean rate, (n_t,).

    Raises
    ------
    ResultsError
        If a value differs from the extrapolation by more than a quarter of a turn.
    """
    expected = 0.5 * (rate[1:] + rate[:-1]) * np.diff(t)
    step = np.diff(value)
    step = step + TURN * np.round((expected - step) / TURN)
    is_lost = np.abs(step - expected) > DOUBTFUL
    if is_lost.any():
        k = int(np.argmax(is_lost))
        raise ResultsError(
            f"{where}: the angle cannot be followed from t = {t[k]:.6g} to {t[k + 1]:.6g}, where it turns by about "
            f"{expected[k]:.3g} rad, and the run did not count it; write results more often (output_every), or add "
            "the sensor to the system before the run"
        )
    return np.concatenate([value[:1], value[:1] + np.cumsum(step)])
