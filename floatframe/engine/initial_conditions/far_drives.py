"""Drives of angles that begin far from where their bodies were placed: the root of their row that is meant.

The row of a driven angle, (E cos f + Z sin f) · D = sin(f - th), vanishes at th = f and half a turn from there, and
Newton's method goes to the nearer one. From far away the drive is led there in steps of an eighth of a turn; a row
whose axes E, Z are turned by delta asks for f - delta.
"""

import numpy as np

from fe_models.foundation.arrays import Array, IntArray
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.kernels.model import Model
from floatframe.engine.kernels.work import Work
from floatframe.model.joints.rows import TURN, TURN_B
from floatframe.model.state import State

__all__ = ["driven_angles", "led_by", "stages", "way_of_drives"]

FAR = np.pi / 4  #: way of a drive from which it is led, and the longest of its steps


def driven_angles(model: Model) -> IntArray:
    """Return the rows that prescribe an angle over time."""
    is_turn = (model.rows.kind == TURN) | (model.rows.kind == TURN_B)
    return np.flatnonzero(is_turn & (model.rows.motion >= 0))


def way_of_drives(model: Model, work: Work, state: State, w: Array, rows: IntArray) -> Array:
    """Return f - th of driven angles at a state, at the time in `work`, between -pi and pi, (len(rows),) [rad]."""
    set_iterate(work, state, w=w)
    linearized(model, work, 1.0, 0.0, 0.0)
    sense = sense_of(model, rows)
    sine = sense * work.connections.g[rows]
    quarter_back = led_by(model, rows, np.full(len(rows), np.pi / 2))
    linearized(quarter_back, work, 1.0, 0.0, 0.0)
    return np.arctan2(sine, -sense * work.connections.g[rows])


def led_by(model: Model, rows: IntArray, delta: Array) -> Model:
    """Return the model in which driven angles are to be f - delta, delta (len(rows),) [rad]."""
    c, s = np.cos(delta)[:, None], (sense_of(model, rows) * np.sin(delta))[:, None]
    x, z = model.rows.x.copy(), model.rows.z.copy()
    x[rows] = c * model.rows.x[rows] - s * model.rows.z[rows]
    z[rows] = s * model.rows.x[rows] + c * model.rows.z[rows]
    return model._replace(rows=model.rows._replace(x=x, z=z))


def sense_of(model: Model, rows: IntArray) -> Array:
    """Return the sense of an angle as the marker of its axes sees it: -1 about an axis of B."""
    return np.where(model.rows.kind[rows] == TURN_B, -1.0, 1.0)


def stages(way: Array) -> list[Array]:
    """Return how far drives are still from their angles after each step of a lead, (n_drives,) each, the last left out.

    No step where all drives are near: they close by themselves.
    """
    n = int(np.ceil(np.abs(way).max(initial=0.0) / FAR))
    return [way * (1 - k / n) for k in range(1, n)]
