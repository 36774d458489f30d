"""The envelope of a profile for a rigid disc: the height of its lowest point when it touches the ground."""

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["profile_envelope"]


def profile_envelope(x: Array, z: Array, radius: float, places: Array) -> Array:
    """Return the envelope max over s of z(s) + sqrt(R² - (s - x)²) - R at places x, for a piecewise linear profile.

    On a piece of slope m, the disc touches where s - x = m R / sqrt(1 + m²), and its lowest point lies R (sqrt(1 + m²)
    - 1) above the line. Otherwise it touches a corner. The exact maximum is the largest value over all pieces and
    corners.

    Parameters
    ----------
    x, z
        Corners, (n,) [m]; x must not decrease (equal values: upright steps). Before the first corner and beyond the
        last, the ground is level.
    radius
        R [m].
    places
        Positions of the centre, (n_places,) [m].

    Returns
    -------
    heights
        (n_places,) [m], never below the ground.
    """
    R = radius
    far = np.array([x[0] - 4 * R, x[-1] + 4 * R])
    far = np.array([min(far[0], places[0] - 2 * R), max(far[1], places[-1] + 2 * R)])
    x, z = np.concatenate([far[:1], x, far[1:]]), np.concatenate([z[:1], z, z[-1:]])
    run = np.diff(x)
    is_piece = run > 0
    slope = np.where(is_piece, np.diff(z) / np.where(is_piece, run, 1.0), 0.0)
    lift = R * (np.sqrt(1 + slope**2) - 1)
    ahead = slope * R / np.sqrt(1 + slope**2)
    heights = np.empty(len(places))
    for k, place in enumerate(places):
        first = max(np.searchsorted(x, place - R) - 1, 0)
        last = min(np.searchsorted(x, place + R, side="right") + 1, len(x))
        corners = np.abs(x[first:last] - place) <= R
        over = z[first:last][corners] + np.sqrt(R**2 - (x[first:last][corners] - place) ** 2) - R
        piece = slice(first, last - 1)
        touch = place + ahead[piece]
        inside = is_piece[piece] & (x[piece] <= touch) & (touch <= x[first + 1 : last])
        line = z[piece] + slope[piece] * (place - x[piece]) + lift[piece]
        heights[k] = np.max(np.concatenate([over, line[inside]]))
    return heights
