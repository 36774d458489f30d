"""What a rigid disc feels of a profile: the height of its lowest point when it touches, its centre above a place."""

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["profile_envelope"]


def profile_envelope(x: Array, z: Array, radius: float, places: Array) -> Array:
    """Return max over s of z(s) + sqrt(R² - (s - x)²) - R at places x, for a profile of straight pieces.

    Within a piece of slope m the disc touches where s - x = m R / sqrt(1 + m²), and lies R (sqrt(1 + m²) - 1) above the
    line; else it touches corners: the exact maximum is the largest of both.

    Parameters
    ----------
    x, z
        Corners, (n,) [m], x not falling (upright steps). Before the first and behind the last the ground is level.
    radius
        R [m].
    places
        Where the centre stands, (n_places,) [m].

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
