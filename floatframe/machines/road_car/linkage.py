"""The position of a double wishbone suspension from circles and spheres, independently of the joints of the system.

For a corner whose body is at rest:

    (1) the lower ball rotates about the hinge of its wishbone by an angle phi
    (2) the upper ball lies on its circle, at the length of the upright from the lower ball:  A cos psi + B sin psi = C
    (3) the outer end of the rod lies on three spheres, around both balls and the inner end of the rod
    (4) balls and rod end are three points of the upright, to which wheel centre and axle are fixed

`Linkage.at` uses phi; `Linkage.lifted` finds phi for a height of the wheel centre.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import brentq

from fe_models.foundation.arrays import Array
from floatframe.machines.road_car.description import Axle, RoadCar

__all__ = ["CornerPlace", "Linkage", "spring_preload"]


MOST = 0.45  #: largest rotation of a lower wishbone that is considered [rad]


@dataclass(frozen=True, eq=False)
class CornerPlace:
    """A corner in one position, in axes of the body."""

    centre: Array  #: of the wheel, (3,) [m]
    R: Array  #: rotation of the upright relative to its design position, (3, 3)
    seat: Array  #: lower end of the spring, (3,) [m]
    jack: Array  #: lower end of the cylinder, (3,) [m]
    lower_angle: float  #: rotation of the lower wishbone about its hinge axis, which points to the rear [rad]
    spring: float  #: length [m]
    cylinder: float  #: length [m]

    @property
    def axle(self) -> Array:
        """Direction of the axle to the left, (3,)."""
        return np.asarray(self.R[:, 1])

    @property
    def steer(self) -> float:
        """Angle of the wheel about z, positive to the left [rad]."""
        return float(np.arctan2(-self.axle[0], self.axle[1]))

    @property
    def inclination(self) -> float:
        """Angle of the wheel about x, positive if its top leans to the right [rad]."""
        return float(np.arcsin(self.axle[2]))


def rotated_point(point: Array, origin: Array, axis: Array, angle: float) -> Array:
    """Return a point rotated about a line (Rodrigues), (3,)."""
    d = point - origin
    c, s = np.cos(angle), np.sin(angle)
    return np.asarray(origin + c * d + s * np.cross(axis, d) + (1 - c) * (axis @ d) * axis)


def frame(a: Array, b: Array, c: Array) -> Array:
    """Return the axes of a triangle as columns, (3, 3): along a-b, in its plane, normal to it."""
    x = (b - a) / np.linalg.norm(b - a)
    z = np.cross(x, c - a)
    z /= np.linalg.norm(z)
    return np.stack([x, np.cross(z, x), z], axis=1)


class Linkage:
    """The corner of an axle on a side (1: left, -1: right), with its rod moved by `rack` along y."""

    def __init__(self, axle: Axle, side: int, rack: float = 0.0) -> None:
        self.p = {name: axle.point(name, side) for name in POINTS}
        self.inner = self.p["rod_inner"] + (0.0, rack, 0.0)
        self.side = side
        self.rest = frame(self.p["lower_ball"], self.p["upper_ball"], self.p["rod_outer"])

    def at(self, phi: float) -> CornerPlace:
        """Return the corner with the lower wishbone rotated by phi [rad] about its hinge axis, front to rear."""
        p = self.p
        hinge = p["lower_rear"] - p["lower_front"]
        hinge /= np.linalg.norm(hinge)
        on_arm = ("lower_ball", "seat", "jack")
        low, seat, jack = (rotated_point(p[name], p["lower_front"], hinge, phi) for name in on_arm)  # (1)
        up = self._upper_ball(low)
        out = self._rod_end(low, up)
        now = frame(low, up, out)
        R = now @ self.rest.T  # (4)
        centre = low + R @ (p["centre"] - p["lower_ball"])
        spring, cylinder = (float(np.linalg.norm(p["tower"] - end)) for end in (seat, jack))
        return CornerPlace(centre, R, seat, jack, phi, spring, cylinder)

    def lifted(self, z: float) -> CornerPlace:
        """Return the corner with its wheel centre z [m] above the design height."""
        height = self.p["centre"][2] + z
        return self.at(brentq(lambda phi: self.at(phi).centre[2] - height, -MOST, MOST, xtol=1e-14, rtol=1e-14))

    def _upper_ball(self, low: Array) -> Array:
        """Return the upper ball by (2): on its circle, on the same side as at design height."""
        p = self.p
        axis = p["upper_rear"] - p["upper_front"]
        axis /= np.linalg.norm(axis)
        foot = p["upper_front"] + axis * (axis @ (p["upper_ball"] - p["upper_front"]))
        e = p["upper_ball"] - foot
        f = np.cross(axis, e)
        length = np.linalg.norm(p["upper_ball"] - p["lower_ball"])
        d = low - foot
        A, B = 2 * d @ e, 2 * d @ f
        C = e @ e + d @ d - length**2
        at, off = np.arctan2(B, A), np.arccos(C / np.hypot(A, B))
        psi = min((at + off, at - off), key=abs)
        return np.asarray(foot + np.cos(psi) * e + np.sin(psi) * f)

    def _rod_end(self, low: Array, up: Array) -> Array:
        """Return the rod end by (3): of the two common points of three spheres, the one on the side of the design."""
        p = self.p
        r = [np.linalg.norm(p["rod_outer"] - p[name]) for name in ("lower_ball", "upper_ball", "rod_inner")]
        u = up - low
        length = np.linalg.norm(u)
        u = u / length
        v = self.inner - low
        x_i = u @ v
        v = v - x_i * u
        y_i = np.linalg.norm(v)
        v = v / y_i
        w = np.cross(u, v)
        x = (r[0] ** 2 - r[1] ** 2 + length**2) / (2 * length)
        y = (r[0] ** 2 - r[2] ** 2 + x_i**2 + y_i**2 - 2 * x_i * x) / (2 * y_i)
        z = np.sqrt(r[0] ** 2 - x**2 - y**2)
        ends = [low + x * u + y * v + s * z * w for s in (1.0, -1.0)]
        return np.asarray(min(ends, key=lambda end: float(np.linalg.norm(end - p["rod_outer"]))))


POINTS = (
    "centre", "lower_front", "lower_rear", "lower_ball", "upper_front", "upper_rear", "upper_ball", "rod_inner",
    "rod_outer", "seat", "jack", "tower",
)  # fmt: skip


def spring_preload(car: RoadCar, name: str, support: str) -> float:
    """Return the compression force of a spring at design height [N]; without oil it includes the force of the oil."""
    axle, c = car.axle(name), car.control
    if support == "hydraulic":
        return axle.preload
    low, high = (Linkage(axle, 1).lifted(z) for z in (-1e-4, 1e-4))
    push = (c.pressure - c.ambient) * (c.head_area - c.rod_area)
    return axle.preload + push * (high.cylinder - low.cylinder) / (high.spring - low.spring)
