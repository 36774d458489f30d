"""The contact between wheel and rail: contact points of rigid bodies, and the smooth quasi-elastic contact.

The position of a wheel relative to its rail is given by u, the outward shift of the wheel, the roll phi (outer side
up), the yaw psi, and the height h of its centre above the nominal radius. A rail does not change along the track.
Therefore each circle of the wheel, at s, can touch the rail only at the point whose normal is perpendicular to the rail
(Wang's line of contact). With the axle a = (-sin psi cos phi, cos psi cos phi, sin phi), f = (cos psi, sin psi, 0) and
d = (sin psi sin phi, -cos psi sin phi, cos phi), the angle t of this point on its circle follows from

    f_x sin t - d_x cos t = R'(s) a_x

The wheel is reduced to a curve (x, y, z)(s) that faces the profile Z(y) of the rail, and its penetration is
p(s) = Z(y(s) + u + offset) - z(s) - h.

- rigid: the local maxima of p within a tolerance of the highest one;
- quasi-elastic: q = eps log( int w exp(p/eps) dy / L ), a smoothed maximum over heights of about eps. Its gradient is
  the mean of slopes and levers with the weights exp(p/eps). Forces along it therefore have a potential, and the contact
  never jumps.
"""

from dataclasses import dataclass, field
from functools import cached_property
from hashlib import sha256
from typing import NamedTuple

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import frozen_copies
from floatframe.components.rails.profile import Profile
from floatframe.components.rails.standard_profiles import GAUGE_DEPTH, inclined, rail_60e1, rotated_rail, wheel_s1002
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = ["ContactPoint", "Pair", "QuasiElastic", "quasi_elastic", "rigid_contacts", "wheel_curve"]

STEP = 1e-4  #: step of the coordinate s on the wheel in the search [m]
FLANK = (0.35, 0.7)  #: range of slopes in which the tread blends into the flange
TYPICAL_RADIUS = 0.5  #: typical radius of relative curvature, for the length L of the quasi-elastic depth [m]


@frozen_copies
@dataclass(frozen=True, eq=False)
class Pair:
    """A wheel on its rail: profiles, radius, and distances of wheels and rails.

    Raises
    ------
    ModelError
        If the flange does not fit between the rails (gauge, distance of the wheels), or values are not in metres.
    """

    wheel: Profile = field(default_factory=wheel_s1002)
    rail: Profile = field(default_factory=rail_60e1)  #: upright profile; it is inclined by `inclination`
    radius: float = 0.46  #: nominal radius r_0 of the wheel, at y = 0 of its profile [m]
    running_circles: float = 1.5  #: distance between the running circles of the two wheels [m]
    gauge: float = 1.435  #: distance between the rails, 14 mm below their top [m]
    inclination: float = 1 / 40  #: inclination of the rails, as a tangent

    def __post_init__(self) -> None:
        for name in ("radius", "running_circles", "gauge"):
            object.__setattr__(self, name, number(f"wheel and rail: {name}", getattr(self, name), above=0.0))
        for name, kind in (("wheel", "wheel"), ("rail", "rail")):
            if not isinstance(getattr(self, name), Profile) or getattr(self, name).kind != kind:
                raise ModelError(f"wheel and rail: {name}: expected the profile of a {kind}")
        if self.radius > 5 or self.gauge > 5 or self.running_circles > 5:
            raise ModelError(
                f"wheel and rail: radius {self.radius:g} m, gauge {self.gauge:g} m, running circles "
                f"{self.running_circles:g} m apart: these look like millimetres; give metres (times 0.001)"
            )
        if self.radius + self.wheel.z.min() <= 0:
            raise ModelError(f"wheel and rail: radius {self.radius:g} m is smaller than the depth of the profile")
        if self.has_flange and not 0.0 < self.flange_clearance < 0.05:
            raise ModelError(
                f"wheel and rail: gauge {self.gauge:g} m and running circles {self.running_circles:g} m apart leave "
                f"{self.flange_clearance * 1e3:.3g} mm between flange and rail: expected 0 to 50 mm; check the gauge, "
                "the distance of the running circles, and that y > 0 points to the field side of the profile"
            )

    @cached_property
    def content(self) -> tuple[bytes | float, ...]:
        """Key for equal pairs, which share their tables."""
        shapes = (self.wheel.y, self.wheel.z, self.rail.y, self.rail.z)
        numbers = (self.radius, self.running_circles, self.gauge, self.inclination)
        return (*(sha256(values.tobytes()).digest() for values in shapes), *numbers)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Pair) and self.content == other.content

    def __hash__(self) -> int:
        return hash(self.content)

    @cached_property
    def head(self) -> Profile:
        """The rail as installed in the track, inclined inwards."""
        return inclined(self.rail, self.inclination)

    @cached_property
    def gauge_point(self) -> float:
        """Position y of the gauge face on the head, the innermost point within 14 mm below its top, y < 0 [m]."""
        y, z, _ = rotated_rail(self.rail, self.inclination)
        inner = slice(0, int(np.argmax(z)) + 1)
        y, z = y[inner], z[inner]
        if z[0] > -GAUGE_DEPTH:
            raise ModelError(
                f"profile {self.rail.name!r}: ends {-z[0] * 1e3:.3g} mm below the top on its inner side, above the "
                f"{GAUGE_DEPTH * 1e3:g} mm where the gauge is measured: give more of the profile"
            )
        return float(min(y[z >= -GAUGE_DEPTH].min(), np.interp(-GAUGE_DEPTH, z, y)))

    @cached_property
    def offset(self) -> float:
        """Offset from y(s) on a centred wheel to the position on the head of the rail [m]."""
        return 0.5 * self.running_circles - (0.5 * self.gauge - self.gauge_point)

    @cached_property
    def has_flange(self) -> bool:
        """Whether the wheel has a flange with a height of 15 mm or more."""
        return bool(self.wheel.z.max() > 0.015)

    @cached_property
    def flange_clearance(self) -> float:
        """Shift of a wheel until its flange, 10 mm below the running circle, touches the gauge face [m]."""
        y, F = self.wheel.y, self.wheel.z
        flank = np.flatnonzero((F >= 0.010) & (y < 0))
        if not len(flank):
            return np.inf
        return 0.5 * self.gauge - 0.5 * self.running_circles - float(y[flank[-1]])

    @cached_property
    def typical_width(self) -> float:
        """L of the quasi-elastic depth, without its factor sqrt(eps) [m^(1/2)]."""
        return float(np.sqrt(2 * np.pi * TYPICAL_RADIUS))


class Curve(NamedTuple):
    """Points of a wheel that can touch a straight rail, from its centre: x forward, y outward, z up."""

    s: Array
    x: Array
    y: Array
    z: Array


def wheel_curve(pair: Pair, roll: float = 0.0, yaw: float = 0.0, s: Array | None = None) -> Curve:
    """Return the points of a wheel whose normal is perpendicular to the rail direction, for increasing s.

    a = (-sin psi cos phi, cos psi cos phi, sin phi) is the axle, f = (cos psi, sin psi, 0), d the upward normal of a in
    the plane of both, and R(s) = r_0 + F(s). The surface is s a + R (sin t f - cos t d), with the normal sin t f - cos
    t d - R' a. This has no x component if f_x sin t - d_x cos t = R' a_x.
    """
    s = np.arange(pair.wheel.y[0], pair.wheel.y[-1], STEP) if s is None else s
    R, R_s = pair.radius + pair.wheel.spline(s), pair.wheel.spline(s, 1)
    sp, cp, sr, cr = np.sin(yaw), np.cos(yaw), np.sin(roll), np.cos(roll)
    a, f, d = (-sp * cr, cp * cr, sr), (cp, sp, 0.0), (sp * sr, -cp * sr, cr)
    wanted = R_s * a[0] / np.hypot(f[0], d[0])
    t = np.arctan2(d[0], f[0]) + np.arcsin(np.clip(wanted, -1, 1))
    st, ct = np.sin(t), np.cos(t)
    x, y, z = (s * a[k] + R * (st * f[k] - ct * d[k]) for k in range(3))
    return Curve(s, x, y, np.where(np.abs(wanted) < 1, z, np.inf))


class ContactPoint(NamedTuple):
    """A contact point of rigid bodies."""

    s: float  #: coordinate on the wheel, from the running circle [m]
    y: float  #: position on the head of the rail [m]
    x: float  #: distance ahead of the wheel centre [m]
    radius: float  #: rolling radius r_0 + F(s) [m]
    angle: float  #: angle of the contact plane to the track, positive if the rail rises outward [rad]
    height: float  #: height h at which the wheel touches at this point [m]


def rigid_contacts(
    pair: Pair, u: float, *, roll: float = 0.0, yaw: float = 0.0, tolerance: float = 1e-6
) -> list[ContactPoint]:
    """Return the contact points of a rigid wheel: the deepest one first, then others within `tolerance` of it.

    Every local maximum of the depth is refined by a parabola through three points with distance STEP.

    Parameters
    ----------
    pair
        Wheel and rail.
    u, roll, yaw
        Outward shift [m], roll [rad] and yaw [rad] of the wheel relative to the rail.
    tolerance
        Tolerance of the height [m].

    Raises
    ------
    ModelError
        If no part of the wheel is above the rail.
    """
    curve = wheel_curve(pair, roll, yaw)
    y = curve.y + u + pair.offset
    p = pair.head.height(y) - (curve.z + pair.radius)
    if not np.isfinite(p).any():
        raise ModelError(f"rigid_contacts: the wheel is off the rail at u = {u:g} m")
    left, middle, right = p[:-2], p[1:-1], p[2:]
    tops = np.flatnonzero((middle >= left) & (middle > right)) + 1
    found = []
    for i in [*tops, int(np.argmax(p))] if int(np.argmax(p)) not in tops else tops:
        shift = 0.0
        if 0 < i < len(p) - 1 and np.isfinite(p[i - 1 : i + 2]).all():
            bend = p[i - 1] - 2 * p[i] + p[i + 1]
            shift = 0.5 * (p[i - 1] - p[i + 1]) / bend if bend < 0 else 0.0
        s = np.array([curve.s[i] + shift * STEP])
        at = wheel_curve(pair, roll, yaw, s)
        place = float(at.y[0] + u + pair.offset)
        height = float(pair.head.height(at.y + u + pair.offset)[0] - at.z[0] - pair.radius)
        angle = float(np.arctan(pair.head.slope(np.array(place))))
        found.append(
            ContactPoint(
                float(s[0]), place, float(at.x[0]), float(pair.radius + pair.wheel.spline(s[0])), angle, height
            )
        )
    found.sort(key=lambda point: -point.height)
    return [point for point in found if point.height >= found[0].height - tolerance]


class QuasiElastic(NamedTuple):
    """The quasi-elastic contact of a part of the wheel: weighted means, see the module docstring."""

    q: Array  #: depth at h = 0 [m]
    slope: Array  #: dq/du, mean of Z': tangent of the contact angle, positive if the rail rises outward
    x: Array  #: position of the contact point relative to the wheel centre, forward [m]
    y: Array  #: position outwards [m]; with this lever the moment about the track direction equals that of dq/dphi
    z: Array  #: position upwards [m], near -radius
    radius: Array  #: rolling radius [m]
    bend: Array  #: curvature of p in the lateral direction, in the contact plane: eps/variance [1/m]


def quasi_elastic(
    pair: Pair, u: Array, *, roll: float = 0.0, yaw: float = 0.0, smoothing: float = 2e-5, part: str = "all"
) -> QuasiElastic:
    """Return the quasi-elastic contact for shifts u, (n,), with the same roll and yaw.

    Parameters
    ----------
    pair
        Wheel and rail.
    u
        Outward shifts [m], (n,).
    roll, yaw
        Roll and yaw [rad].
    smoothing
        Smoothing height eps [m].
    part
        "all" of the wheel, its "tread" or its "flange", with weights whose sum is one and which blend smoothly where
        the slope of the profile is between 0.35 and 0.7.
    """
    curve = wheel_curve(pair, roll, yaw)
    u = np.asarray(u, dtype=float)
    share = part_of_wheel(pair.wheel, curve.s, part)
    dy = np.gradient(curve.y)
    use = (share > 0) & (dy > 0) & np.isfinite(curve.z)
    s, x, y0, z, measure = curve.s[use], curve.x[use], curve.y[use], curve.z[use], (share * dy)[use]
    y = y0 + u[:, None] + pair.offset
    p = pair.head.height(y) - (z + pair.radius)
    best = p.max(axis=1, keepdims=True)
    best = np.where(np.isfinite(best), best, -1.0)  # off the rail: a depth below all real values
    weights = measure * np.exp((p - best) / smoothing)
    total = weights.sum(axis=1)
    width = pair.typical_width * np.sqrt(smoothing)
    off = total == 0
    total = np.where(off, 1.0, total)
    weights = weights / total[:, None]

    def mean(values: Array) -> Array:
        return np.einsum("ij,ij->i", weights, np.broadcast_to(values, weights.shape))

    slopes, touching = np.zeros_like(weights), weights > 0
    slopes[touching] = pair.head.slope(np.clip(y[touching], pair.head.y[0], pair.head.y[-1]))
    q = best[:, 0] + smoothing * np.log(total / width)
    slope, z_mean = mean(slopes), mean(z)
    lever = mean(y0 + slopes * z) - slope * z_mean
    # spread of the contact in the contact plane
    mean_y = mean(y0)
    cos = 1 / np.sqrt(1 + slope**2)
    variance = np.maximum(mean(y0**2) - mean_y**2, 0.0) + STEP**2 / 12
    bend = smoothing * cos**3 / variance
    radius = mean(pair.radius + pair.wheel.spline(s))
    return QuasiElastic(q, slope, mean(x), lever, z_mean, radius, bend)


def part_of_wheel(wheel: Profile, s: Array, part: str) -> Array:
    """Return the weight of a part at positions s of a wheel; the weights of tread and flange add to one."""
    if part == "all":
        return np.ones_like(s)
    steep = np.clip((-wheel.slope(s) - FLANK[0]) / (FLANK[1] - FLANK[0]), 0.0, 1.0)
    flange = steep * steep * (3 - 2 * steep)
    # beyond the steepest point of the flank, tip and back belong to the flange
    tip = int(np.argmax(wheel.z))
    if wheel.z[tip] > 0.015:
        last = s[len(s) - 1 - np.argmax((flange >= 1)[::-1])] if (flange >= 1).any() else wheel.y[tip]
        flange = np.where(s <= last, 1.0, flange)
    if part == "flange":
        return flange
    if part == "tread":
        return 1.0 - flange
    raise ModelError(f"quasi_elastic: part: expected all, tread or flange, got {part!r}")
