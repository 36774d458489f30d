"""Roads: flat, or heights z(x, y) on a grid, in axes of their marker, with x along the road and z up."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.components.wheels.roads.surface import CENTRE, CUBIC, FLAT, GRID, GRIP, road_height
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, number

__all__ = ["FlatRoad", "GridRoad", "Grip", "Polyline", "Road", "profile_envelope", "profile_road"]


# the envelope of a profile for a rigid disc: the height of its lowest point when it touches the ground ----------------


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


# road -----------------------------------------------------------------------------------------------------------------


ENVELOPE_STEPS = 20  #: number of steps of an envelope per radius


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Grip:
    """A friction factor along the road, for example of a wet patch, linear between knots."""

    x: GivenArray = given()  #: increasing knots along the road, (n,) [m]
    factor: GivenArray = given()  #: friction factors above 0, (n,); constant outside the knots

    def __post_init__(self) -> None:
        x = knots("road: grip: x", self.x)
        factor = array_of_shape("road: grip: factor", self.factor, x.shape)
        if np.any(factor <= 0):
            k = int(np.argmin(factor))
            raise ModelError(f"road: grip: factor: expected numbers above 0, got {factor[k]:g} at x = {x[k]:g}")
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "factor", factor)


def with_grip(numbers: Array, grip: Grip | None) -> Array:
    """Return the data of a road, followed by that of its grip, if it has one."""
    if grip is None:
        return numbers
    begun = numbers.copy()
    begun[GRIP] = len(numbers)
    return np.concatenate([begun, [len(grip.x)], grip.x, grip.factor])


def check_grip(road: Any) -> None:
    """Raise `ModelError` unless the grip of a road is a `Grip` or None."""
    if not isinstance(road.grip, Grip | None):
        raise ModelError(f"road: grip: expected a Grip(x, factor) or None, got {road.grip!r}")


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class FlatRoad:
    """The infinite plane z = 0."""

    grip: Grip | None = None  #: friction factor for tyres along the road; None: 1

    def __post_init__(self) -> None:
        check_grip(self)

    def numbers(self) -> Array:
        """Data for `surface.road_height` and `surface.road_grip`: header and grip."""
        return with_grip(np.array([FLAT, 0.0, 0.0, 0.0, 0.0, 0.0]), self.grip)

    def height(self, x: float, y: float = 0.0) -> float:
        """Height, which is zero [m]."""
        return 0.0


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class GridRoad:
    """Heights z at knots x, along the road, and y, to the left; beyond the knots the road is level.

    One y gives a profile, the same at all y; two or more give tracks or a surface. Between the knots, the heights
    follow a monotone cubic (no overshoot, continuous slope) or, with `is_linear`, a straight line. A wheel uses height
    and slope at its contact point on the ground itself. Waves should therefore be longer than the wheel, R |z''| < 1;
    for shorter waves, use `enveloped`.
    """

    x: Array  #: increasing knots along the road, (n_x,) [m]
    z: Array  #: heights at the knots, (n_x, n_y) or (n_x,) [m]
    y: Array = (0.0,)  # type: ignore[assignment]  #: knots across, (n_y,) [m], increasing
    is_linear: bool = False  #: whether heights are linear between the knots
    envelope_radius: float | None = None  #: radius of the disc whose envelope is z [m]; None: z is the ground itself
    grip: Grip | None = None  #: friction factor for tyres along the road; None: 1

    def __post_init__(self) -> None:
        x, y = knots("road: x", self.x), knots("road: y", self.y, least=1)
        z = np.array(self.z, dtype=object)
        shape = (len(x), len(y))
        z = array_of_shape("road: z", np.reshape(z, shape) if z.shape == (len(x),) and len(y) == 1 else self.z, shape)
        for name, value in (("x", x), ("y", y), ("z", z)):
            object.__setattr__(self, name, value)
        if self.envelope_radius is not None:
            number("road: envelope_radius", self.envelope_radius, above=0.0)
        check_grip(self)

    @property
    def steepest(self) -> tuple[float, float]:
        """Steepest slope between knots along the road, and the x at which it begins [m]."""
        rise = np.abs(np.diff(self.z, axis=0) / np.diff(self.x)[:, None]).max(axis=1)
        return float(rise.max()), float(self.x[int(rise.argmax())])

    def numbers(self) -> Array:
        """Data for `surface.road_height` and `surface.road_grip`: header, knots, z, z_x, z_y, z_xy, grip."""
        z_x = slopes(self.x, self.z)
        z_y = slopes(self.y, self.z.T).T
        z_xy = slopes(self.y, z_x.T).T
        header = [float(GRID), len(self.x), len(self.y), 0.0 if self.is_linear else CUBIC, 0.0, 0.0]
        if self.envelope_radius is not None:
            header[4] = CENTRE
        tables = [part.ravel() for part in (self.z, z_x, z_y, z_xy)]
        return with_grip(np.concatenate([header, self.x, self.y, *tables]), self.grip)

    def height(self, x: float, y: float = 0.0) -> float:
        """Height at a place [m]."""
        return float(road_height(self.numbers(), 0, float(x), float(y))[0])

    def enveloped(self, radius: float, *, width: float = 0.0, step: float | None = None) -> "GridRoad":
        """Return the envelope for a rigid disc of radius R and a width [m]: points R below its centre when it touches.

        The ground is taken as linear between its knots. `step` is the spacing of the result [m], by default R/20.
        """
        R = number("envelope: radius", radius, above=0.0)
        half = 0.5 * number("envelope: width", width, at_least=0.0)
        if self.envelope_radius is not None:
            raise ModelError("envelope: this road is an envelope already; start from the ground itself")
        x = even_knots(self.x[0] - R, self.x[-1] + R, step or R / ENVELOPE_STEPS)
        rows = np.stack([profile_envelope(self.x, row, R, x) for row in self.z.T])  # (n_y, n)
        y = self.y if len(self.y) == 1 or half == 0.0 else np.unique([*self.y, *(self.y - half), *(self.y + half)])
        z = np.stack([widest(self.y, rows, low, high) for low, high in zip(y - half, y + half, strict=True)])
        return replace(self, x=x, y=y, z=z.T, envelope_radius=R)


def widest(y: Array, rows: Array, low: float, high: float) -> Array:
    """Return the highest of the rows, (n_y, n), at y, interpolated linearly, over low <= y <= high, (n,)."""
    if len(y) == 1:
        return rows[0]
    ends = [at_row(y, rows, low), at_row(y, rows, high)]
    return np.max([*ends, *rows[(y > low) & (y < high)]], axis=0)


def at_row(y: Array, rows: Array, place: float) -> Array:
    """Return the row at a position between rows, interpolated linearly and constant beyond them, (n,)."""
    k = int(np.clip(np.searchsorted(y, place) - 1, 0, len(y) - 2))
    s = float(np.clip((place - y[k]) / (y[k + 1] - y[k]), 0.0, 1.0))
    return (1 - s) * rows[k] + s * rows[k + 1]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Polyline:
    """A profile of straight pieces, which may have upright steps: two corners with equal x."""

    x: GivenArray = given()  #: x of the corners, not decreasing, (n,) [m]
    z: GivenArray = given()  #: z of the corners, (n,) [m]

    def __post_init__(self) -> None:
        x = array_of_shape("profile: x", self.x, (len(np.atleast_1d(np.asarray(self.x, dtype=object))),))
        object.__setattr__(self, "x", x)
        object.__setattr__(self, "z", array_of_shape("profile: z", self.z, x.shape))
        if len(x) < 2 or np.any(np.diff(x) < 0) or x[0] == x[-1]:
            raise ModelError(f"profile: x: expected at least two corners in the order of x, got {x.tolist()}")

    def road(self) -> GridRoad:
        """Return the profile itself as a road, for wheels that are small compared with it."""
        return GridRoad(self.x, self.z, is_linear=True)

    def enveloped(
        self, radius: float, *, step: float | None = None, between: Sequence[float] | None = None
    ) -> GridRoad:
        """Return the envelope for a rigid disc of that radius [m].

        Parameters
        ----------
        radius
            Radius of the unloaded wheel [m].
        step
            Spacing of the result [m]; by default a twentieth of the radius.
        between
            The obstacle lies between these two y [m], edges included; elsewhere the road is level at the height of its
            first corner. None: at all y.
        """
        R = number("envelope: radius", radius, above=0.0)
        x = even_knots(self.x[0] - R, self.x[-1] + R, step or R / ENVELOPE_STEPS)
        z = profile_envelope(self.x, self.z, R, x)
        if between is None:
            return GridRoad(x, z, envelope_radius=R)
        low, high = array_of_shape("envelope: between", between, (2,))
        if not low < high:
            raise ModelError(f"envelope: between: expected two y, the lower first, got {low:g} and {high:g}")
        edge = 1e-3 * (high - low)
        level = np.full_like(z, self.z[0])
        return GridRoad(
            x,
            np.stack([level, z, z, level], axis=1),
            y=np.array([low - edge, low, high, high + edge]),
            envelope_radius=R,
        )


Road = FlatRoad | GridRoad


def profile_road(x: Any, z: Any, *, is_linear: bool = False) -> GridRoad:
    """Return the road of a profile, the same at all y, with heights z at knots x, (n,) [m]."""
    return GridRoad(x, z, is_linear=is_linear)


def knots(where: str, values: Any, least: int = 2) -> Array:
    """Return values as increasing numbers, at least `least` of them; `ModelError` if they are not."""
    array = array_of_shape(where, values, (len(np.atleast_1d(np.asarray(values, dtype=object))),))
    if len(array) < least:
        raise ModelError(f"{where}: expected {least} knots or more, got {len(array)}")
    if np.any(np.diff(array) <= 0):
        k = int(np.argmax(np.diff(array) <= 0))
        raise ModelError(
            f"{where}: expected increasing numbers, got {array[k]:g}, then {array[k + 1]:g} at place {k + 1}"
        )
    return array


def even_knots(low: float, high: float, step: float) -> Array:
    """Return equally spaced numbers from low to high with a spacing of at most `step`."""
    number("envelope: step", step, above=0.0)
    return np.linspace(low, high, max(2, int(np.ceil((high - low) / step)) + 1))


def slopes(x: Array, z: Array) -> Array:
    """Return the slopes, (n, m), of the monotone cubic through z, (n, m), at knots x; zero for a single knot."""
    from scipy.interpolate import PchipInterpolator  # slow to import

    if len(x) == 1:
        return np.zeros_like(z)
    return np.ascontiguousarray(PchipInterpolator(x, z, axis=0).derivative()(x))
