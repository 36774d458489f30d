"""Boxes with different walls, converted to general sections.

Walls 1 to 4 are at +y, +z, -y, -z. Area and second moments are those of the outer rectangle minus the hole. Shear and
torsion are those of the thin-walled cell along the middle line. For a force V along c (y or z) and I = ∮ c² t ds,

    q(s) = q_0 - V/I ∫ c t ds,  ∮ q/t ds = 0,  A_s = V² / ∮ q²/t ds,

The moment of q about the centroid, divided by V, gives the shear centre. J = 4 A_m² / ∮ ds/t + ∮ t³ ds / 3 (Bredt).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["UnevenBox", "uneven_box"]

ROUNDOFF = 1e-12


@dataclass(frozen=True)
class UnevenBox:
    """Box as a table [sections.NAME] of a job, and its position."""

    shape: dict[str, Any]
    centroid: tuple[float, float]  #: centroid (y, z) relative to the centre of the outer rectangle


def uneven_box(b: float, h: float, walls: tuple[float, ...]) -> UnevenBox | None:
    """Return the section of a box; None if walls differ in both directions, which rotates its principal axes.

    Parameters
    ----------
    b, h
        Outer sides along y and z.
    walls
        Thickness at +y, +z, -y, -z, (4,).

    Raises
    ------
    ValueError
        If the walls leave no hole.
    """
    t_1, t_2, t_3, t_4 = walls
    b_i, h_i = b - t_1 - t_3, h - t_2 - t_4
    if min(b_i, h_i, *walls) <= 0:
        raise ValueError("expected walls above zero that leave a hole")
    hole = np.array([(t_3 - t_1) / 2, (t_4 - t_2) / 2])  # centre of the hole
    A, A_i = b * h - b_i * h_i, b_i * h_i
    centroid = -A_i * hole / A
    own, inner = -centroid, hole - centroid
    products = b * h * own[0] * own[1] - A_i * inner[0] * inner[1]
    Iy = b * h**3 / 12 + b * h * own[1] ** 2 - b_i * h_i**3 / 12 - A_i * inner[1] ** 2
    Iz = h * b**3 / 12 + b * h * own[0] ** 2 - h_i * b_i**3 / 12 - A_i * inner[0] ** 2
    if abs(products) > ROUNDOFF * max(Iy, Iz):
        return None
    y, z = ((b - t_1) / 2, (-b + t_3) / 2), ((h - t_2) / 2, (-h + t_4) / 2)
    corners = np.array([(y[0], z[1]), (y[0], z[0]), (y[1], z[0]), (y[1], z[1])])
    lengths = np.linalg.norm(np.roll(corners, -1, axis=0) - corners, axis=1)
    t = np.array(walls)
    A_m = (y[0] - y[1]) * (z[0] - z[1])
    J = 4 * A_m**2 / float((lengths / t).sum()) + float((lengths * t**3).sum()) / 3
    A_sy, arm_z = _shear(corners, t, 0)
    A_sz, arm_y = _shear(corners, t, 1)
    # a force along y turns the section by -z, one along z by +y
    middle = _line_centroid(corners, t)
    shear_center = (middle[0] + arm_y - centroid[0], middle[1] - arm_z - centroid[1])
    outline = np.array([(-b, -h), (b, -h), (b, h), (-b, h)]) / 2 - centroid
    shape = {
        "shape": "general", "area": A, "iy": float(Iy), "iz": float(Iz), "torsion": J, "shear_area_y": A_sy,
        "shear_area_z": A_sz, "shear_center": [float(x) for x in shear_center], "outline": outline.tolist(),
    }  # fmt: skip
    return UnevenBox(shape, (float(centroid[0]), float(centroid[1])))


def _line_centroid(corners: Array, t: Array) -> Array:
    """Return the centroid of the middle line with its wall thicknesses, (2,)."""
    ends = np.roll(corners, -1, axis=0)
    weights = np.linalg.norm(ends - corners, axis=1) * t
    return np.asarray(weights @ (corners + ends) / 2 / weights.sum())


def _shear(corners: Array, t: Array, c: int) -> tuple[float, float]:
    """Return the shear area along component c, and the moment about the centroid of the shear flow of a unit force."""
    xi, w = np.polynomial.legendre.leggauss(3)  # exact for q², of degree 4
    xi, w = (xi + 1) / 2, w / 2
    X = corners - _line_centroid(corners, t)
    ends = np.roll(X, -1, axis=0)
    lengths = np.linalg.norm(ends - X, axis=1)
    a, z = X[:, c], ends[:, c]
    inertia = float((t * lengths * (a**2 + a * z + z**2) / 3).sum())
    whole = t * lengths * (a + z) / 2  # ∫ c t ds of each wall
    before = np.concatenate([[0.0], np.cumsum(whole)[:-1]])
    part = t * lengths * (np.outer(xi, a) + np.outer(xi**2, z - a) / 2)  # (3 points, 4 walls)
    q = -(before + part) / inertia
    q -= float(w @ (q * lengths / t).sum(axis=1)) / float((lengths / t).sum())
    energy = float(w @ (q**2 * lengths / t).sum(axis=1))
    tangents = (ends - X) / lengths[:, None]
    arms = X[:, 0] * tangents[:, 1] - X[:, 1] * tangents[:, 0]
    return 1 / energy, float(w @ (q * lengths * arms).sum(axis=1))
