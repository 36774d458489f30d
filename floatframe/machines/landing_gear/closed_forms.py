"""Retraction of a gear in its plane, by intersection of circles: knee of the brace, length and force of the jack.

The leg rotates by theta about its hinge, the origin, which takes a point (y, z) of it to (y cos theta - z sin theta, y
sin theta + z cos theta).
The brace connects its hinge on the airframe to a point of the leg, by two links of equal length with a knee.
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array

__all__ = ["Retraction", "retraction"]

BRACE, FOOT, LINK = (0.55, 0.0), (0.05, -0.45), 0.34  #: hinge on the airframe, point of the leg, length of a link [m]
JACK, HORN = (0.5, 0.1), (0.06, 0.15)  #: ends of the jack on the airframe and on the leg [m]
LEG_MASS, LEG_CENTRE, LINK_MASS = 90.0, (0.0, -0.9), 4.0


@dataclass(frozen=True, eq=False)
class Retraction:
    """The mechanism at angles of the leg, each array (n,), or (n, 2) in its plane (y, z)."""

    knee: Array  #: (n, 2) [m]
    jack: Array  #: distance between the ends of the jack [m]
    #: of leg and links, divided by g, zero where all centres of mass are at the height of the hinge [kg m]
    potential: Array


def turned(theta: Array, point: tuple[float, float]) -> Array:
    """Return a point of the rotated leg, (n, 2)."""
    y, z = point
    return np.stack([y * np.cos(theta) - z * np.sin(theta), y * np.sin(theta) + z * np.cos(theta)], axis=1)


def retraction(theta: Array) -> Retraction:
    """Return the mechanism at the angles theta of the leg, (n,) [rad]; zero is the extended gear."""
    theta = np.atleast_1d(np.asarray(theta, dtype=float))
    hinge, foot = np.array(BRACE), turned(theta, FOOT)
    between = foot - hinge
    d = np.linalg.norm(between, axis=1, keepdims=True)
    normal = np.stack([between[:, 1], -between[:, 0]], axis=1) / d  # to the side of the knee, less
    knee = hinge + between / 2 - np.sqrt(LINK**2 - (d / 2) ** 2) * normal
    jack = np.linalg.norm(turned(theta, HORN) - np.array(JACK), axis=1)
    centre = turned(theta, LEG_CENTRE)[:, 1]
    links = (hinge[1] + knee[:, 1]) / 2 + (knee[:, 1] + foot[:, 1]) / 2
    return Retraction(knee, jack, LEG_MASS * centre + LINK_MASS * links)
