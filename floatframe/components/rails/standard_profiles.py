"""Standard profiles: the wheel S1002, the rail 60E1 (UIC 60), cones, and inclined rails."""

from dataclasses import replace

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.components.rails.profile import Profile
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = ["GAUGE_DEPTH", "PROFILES", "cone", "inclined", "rail_60e1", "rotated_rail", "s1002", "wheel_s1002"]

GAUGE_DEPTH = 0.014  #: depth below the top of the rails at which the gauge is measured [m]
SPACING = 1e-4  #: spacing of the points that represent a curve [m]
STEEPEST = 15.0  #: largest slope at which the side of a rail belongs to the head in the contact search

#: S1002, y from the running circle outward and F downward, in mm: bounds between sections H to A, then the sections
S1002_BOUNDS = (-70.0, -62.764705882, -49.662510381, -39.764473993, -38.426669071, -35.0, -26.0, 32.15796, 60.0)
#: (height of the centre, radius, y of the centre, side) of the circles H, G, F and D
S1002_CIRCLES = {
    0: (9.519259302, 20.5, -49.5, 1.0),
    1: (16.0, 12.0, -55.0, 1.0),
    2: (8.834924130, 20.0, -58.558326413, 1.0),
    4: (16.446, 13.0, -26.210665, -1.0),
}
#: polynomials of the sections E, C, B and A, as coefficients of y^0, y^1, ...
S1002_POLYNOMIALS = {
    3: (-93.576667419, -2.747477419),
    5: (
        -4.320221063e3,
        -1.038384026e3,
        -1.065501873e2,
        -6.051367875,
        -2.054332446e-1,
        -4.169739389e-3,
        -4.687195829e-5,
        -2.252755540e-7,
    ),
    6: (
        0.0,
        -3.358537058e-2,
        1.565681624e-3,
        -2.810427944e-5,
        5.844240864e-8,
        -1.562379023e-8,
        5.309217349e-15,
        -5.957839843e-12,
        2.646656573e-13,
    ),
    7: (1.364323640, -0.066666667),
}


def s1002(y: Array) -> Array:
    """Return the profile S1002 (EN 13715, flange 28 mm high and 32.5 mm thick) at y, both in mm.

    Raises
    ------
    ModelError
        If y is out of the range -70 to 60 mm.
    """
    y = np.asarray(y, dtype=float)
    if y.min() < S1002_BOUNDS[0] or y.max() > S1002_BOUNDS[-1]:
        raise ModelError(f"profile S1002: known for y from -70 mm to 60 mm, got {y.min():g} to {y.max():g}")
    section = np.clip(np.searchsorted(S1002_BOUNDS, y, side="right") - 1, 0, 7)
    F = np.zeros_like(y)
    for k, (height, radius, centre, side) in S1002_CIRCLES.items():
        here = section == k
        F[here] = height + side * np.sqrt(radius**2 - (y[here] - centre) ** 2)
    for k, coefficients in S1002_POLYNOMIALS.items():
        here = section == k
        F[here] = np.polynomial.polynomial.polyval(y[here], coefficients)
    return F


def wheel_s1002() -> Profile:
    """Return S1002 as a profile, without the last, steepest 1.2 mm of the back of the flange."""
    y = np.linspace(-68.8, 60.0, 1 + round(128.8e-3 / SPACING))
    return Profile("wheel", y * 1e-3, s1002(y) * 1e-3, "S1002")


def cone(conicity: float, *, flange: bool = True) -> Profile:
    """Return a conical wheel, F = -conicity y, optionally with the flange of S1002 joined by a fillet.

    Parameters
    ----------
    conicity
        Tangent of the half angle of the cone; 1/20 and 1/40 are usual.
    flange
        If false, the cone continues to y = -60 mm.
    """
    conicity = number("cone: conicity", conicity)
    if not -0.5 < conicity < 0.5:
        raise ModelError(f"cone: conicity: expected a tangent between -0.5 and 0.5 such as 0.05, got {conicity:g}")
    if not flange:
        y = np.linspace(-60.0, 60.0, 1 + round(0.12 / SPACING))
        return Profile("wheel", y * 1e-3, -conicity * y * 1e-3, f"cone {conicity:g}")
    y = np.linspace(-68.8, 60.0, 1 + round(128.8e-3 / SPACING))
    # a fillet of 13 mm as in S1002, tangent to the flank of its flange, F = start - steep y, and to the cone
    steep, start, radius = 2.747477419, -93.576667419, 13.0
    up_flank, up_cone = np.hypot(1.0, steep), np.hypot(1.0, conicity)
    centre = (start + radius * (up_flank - up_cone)) / (steep - conicity)
    height = radius * up_cone - conicity * centre
    touch_e, touch_c = centre - radius * steep / up_flank, centre - radius * conicity / up_cone
    F = np.where(y > touch_c, -conicity * y, np.nan)
    fillet = (y <= touch_c) & (y >= touch_e)
    F[fillet] = height - np.sqrt(radius**2 - (y[fillet] - centre) ** 2)
    flank = (y < touch_e) & (y > S1002_BOUNDS[3])
    F[flank] = start - steep * y[flank]
    beyond = y <= S1002_BOUNDS[3]
    F[beyond] = s1002(y[beyond])
    return Profile("wheel", y * 1e-3, F * 1e-3, f"cone {conicity:g} with flange")


def rail_60e1() -> Profile:
    """Return the head of the rail 60E1 (UIC 60), upright.

    Circles of 300 mm, 80 mm and 13 mm are tangent to each other, the first over a width of 20.456 mm, the second up to
    52.053 mm, followed by a side of 1 : 20. The resulting head is 72.0 mm wide, as in the standard (EN 13674-1).
    """
    return head_of_circles(20.456, 52.053, "60E1")


def head_of_circles(width_1: float, width_2: float, name: str) -> Profile:
    """Return a head of circles of 300, 80 and 13 mm that meet at these widths [mm], with sides of 1 : 20."""
    half_1, half_2, side = width_1 / 2, width_2 / 2, 1 / 20
    angle_1 = np.arcsin(half_1 / 300.0)
    centre_2, low_2 = half_1 - 80.0 * np.sin(angle_1), -300.0 + (300.0 - 80.0) * np.cos(angle_1)
    angle_2 = np.arcsin((half_2 - centre_2) / 80.0)
    centre_3, low_3 = half_2 - 13.0 * np.sin(angle_2), low_2 + (80.0 - 13.0) * np.cos(angle_2)
    angle_3 = np.arctan2(1.0, side)
    # points equally spaced along the curve, because the sides are steep
    arcs = [
        (300.0, 0.0, -300.0, np.linspace(0.0, angle_1, 104)),
        (80.0, centre_2, low_2, np.linspace(angle_1, angle_2, 170)[1:]),
        (13.0, centre_3, low_3, np.linspace(angle_2, angle_3, 170)[1:]),
    ]
    y = np.concatenate([centre + radius * np.sin(angle) for radius, centre, _, angle in arcs])
    z = np.concatenate([low + radius * np.cos(angle) for radius, _, low, angle in arcs])
    down = np.linspace(0.0, 8.0, 81)[1:]
    y, z = np.append(y, y[-1] + side * down), np.append(z, z[-1] - down)
    return Profile("rail", np.append(-y[:0:-1], y) * 1e-3, np.append(z[:0:-1], z) * 1e-3, name)


def inclined(rail: Profile, inclination: float) -> Profile:
    """Return a rail rotated inward by an angle whose tangent is `inclination` (1/40, 1/20), its highest point at z = 0.

    The outer side of an inclined rail is higher than before: heights become about z + inclination y. Parts that are
    then undercut, or steeper than STEEPEST, are removed.
    """
    y, z, angle = rotated_rail(rail, inclination)
    top = int(np.argmax(z))
    flat = np.diff(y) * STEEPEST > np.abs(np.diff(z))
    last = top + int(np.argmin(np.append(flat[top:], False)))
    first = top - int(np.argmin(np.append(flat[:top][::-1], False)))
    return replace(rail, y=y[first : last + 1], z=z[first : last + 1], inclination=rail.inclination + angle)


def rotated_rail(rail: Profile, inclination: float) -> tuple[Array, Array, float]:
    """Return all points of a rail rotated inward, including its sides, with the top at z = 0, and the angle [rad]."""
    angle = float(np.arctan(number("inclination of the rail", inclination)))
    if abs(angle) > 0.2:
        raise ModelError(f"inclination of the rail: expected a tangent such as 0.025 (1/40), got {inclination:g}")
    c, s = np.cos(angle), np.sin(angle)
    y, z = c * rail.y - s * rail.z, s * rail.y + c * rail.z
    # the top, between the points, where the upright profile falls outward with the slope of the inclination
    top = int(np.clip(np.argmax(z), 1, len(z) - 2))
    bend = z[top - 1] - 2 * z[top] + z[top + 1]
    rise = -((z[top + 1] - z[top - 1]) ** 2) / (8 * bend) if bend < 0 else 0.0
    return y, z - (z[top] + max(rise, 0.0)), angle


#: names in the system file
PROFILES = {"s1002": wheel_s1002, "60e1": rail_60e1, "uic60": rail_60e1}
