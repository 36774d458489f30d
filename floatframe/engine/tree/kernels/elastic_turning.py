"""Derivatives of the elastic angular acceleration of a marker, in body axes.

With the elastic angle th, its rate w and the left Jacobian T at th, the angular velocity is nu = T w, and its rate is
T w_dot + c, c = (dT/dth [w]) w (kernels/marker_acceleration.py). With a = a(|th|), b = b(|th|) of kernels/rotation.py,
p = th·w, x = th × w, y = th × x

    c = a' p x + b' p y + b w × x,   a' = (da/dt)/t, b' = (db/dt)/t, and likewise a'' and b'' from a' and b'.
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.marker_acceleration import turning_bias
from floatframe.engine.kernels.rotation import quotient_b, quotient_da, quotient_db
from floatframe.engine.kernels.vector import add, cross, dot, scaled

__all__ = ["second_turning"]

SERIES_UP_TO = 4.0  #: value of t² below which series replace the closed forms, which lose digits there


@inner
def quotient_dda(x):
    """Return (d a'/dt)/t of x = t², a' = (t sin t - 2 (1 - cos t))/t⁴; by a series below t = 2."""
    if x > SERIES_UP_TO:
        t = math.sqrt(x)
        c = math.cos(t)
        return (x * c - 5 * t * math.sin(t) + 8 * (1 - c)) / (x * x * x)
    y = 1 / 763809585467056128000000
    y = 1 / 3122224243826688000 + x * (-1 / 1410110003939180544000 + x * y)
    y = 1 / 28582025472000 + x * (-1 / 8447576417280000 + x * y)
    y = 1 / 726485760 + x * (-1 / 124540416000 + x * y)
    y = 1 / 75600 + x * (-1 / 5987520 + x * y)
    y = 1 / 90 + x * (-1 / 1680 + x * y)
    return y


@inner
def quotient_ddb(x):
    """Return (d b'/dt)/t of x = t², b' = ((1 - cos t) - 3 (t - sin t)/t)/t⁴; by a series below t = 2."""
    if x > SERIES_UP_TO:
        t = math.sqrt(x)
        s = math.sin(t)
        return (t * s + 8 + 7 * math.cos(t) - 15 * s / t) / (x * x * x)
    y = 1 / 20622858807610515456000000
    y = 1 / 71811157608013824000 + x * (-1 / 35252750098479513600000 + x * y)
    y = 1 / 543058483968000 + x * (-1 / 177399104762880000 + x * y)
    y = 1 / 10897286400 + x * (-1 / 2117187072000 + x * y)
    y = 1 / 831600 + x * (-1 / 77837760 + x * y)
    y = 1 / 630 + x * (-1 / 15120 + x * y)
    return y


@inner
def turning_bias_by_angle(th, w, d):
    """Return the change of c for a change d of the rotation vector th."""
    x = dot(th, th)
    p, m, b = dot(th, w), cross(th, w), quotient_b(x)
    y = cross(th, m)
    da, db = quotient_da(x), quotient_db(x)
    dp, dm, along = dot(d, w), cross(d, w), dot(th, d)
    dy = add(cross(d, m), cross(th, dm))
    first = scaled(quotient_dda(x) * along * p + da * dp, m)
    second = scaled(quotient_ddb(x) * along * p + db * dp, y)
    third = add(scaled(da * p, dm), scaled(db * p, dy))
    return add(add(first, second), add(third, add(scaled(db * along, cross(w, m)), scaled(b, cross(w, dm)))))


@inner
def second_turning(th, w, nu, v, b, b_1):
    """Return (d²T/dth² [w, w]) v, with nu = T w, b = T v and b_1 = (dT/dth [w]) v.

    Variations of a motion fulfil (dT [w]) v - (dT [v]) w = nu × b. Its derivative along w is
    (d²T [w, w]) v = (d²T [v, w]) w + c × b + nu × b_1.
    """
    turning = add(cross(turning_bias(th, w), b), cross(nu, b_1))
    return add(turning_bias_by_angle(th, w, v), turning)
