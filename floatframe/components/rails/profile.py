"""The profile of a wheel or a rail: a validated height over the lateral coordinate, with slope and curvature.

Coordinates are the same for both sides of the track: y points outward, away from the centre of the track. The profile
of a wheel is the increase of its radius relative to the nominal one, over the distance from the running circle; a
flange is at y < 0, with values of about +28 mm. The profile of a rail is its height above its top, positive upward.
"""

from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import frozen_copies
from floatframe.errors import ModelError

if TYPE_CHECKING:
    from scipy.interpolate import CubicSpline

__all__ = ["Profile", "profile_of_points"]

WIDTHS = {"wheel": (0.04, 0.25), "rail": (0.02, 0.25)}  #: range of the widths of profiles [m]
MOST_HEIGHT = 0.08  #: largest height of a profile [m]


@frozen_copies
@dataclass(frozen=True, eq=False)
class Profile:
    """Height z of a wheel or a rail over the lateral coordinate y, as a cubic spline through dense points.

    Raises
    ------
    ModelError
        If the points go back (z is not a function of y), are not numbers, or seem to be in millimetres.
    """

    kind: str  #: "wheel" or "rail"
    y: Array  #: increasing outward coordinates, (n,) [m]
    z: Array  #: heights, (n,) [m]: increase of the radius of a wheel, height above the top of a rail
    name: str = "points"  #: name of the profile in messages
    inclination: float = field(default=0.0, kw_only=True)  #: angle by which a rail has been inclined inwards [rad]

    def __post_init__(self) -> None:
        where = f"profile {self.name!r}"
        if self.kind not in WIDTHS:
            raise ModelError(f"{where}: kind: expected wheel or rail, got {self.kind!r}")
        y, z = checked_points(where, self.kind, self.y, self.z)
        for name, values in (("y", y), ("z", z)):
            values.flags.writeable = False
            object.__setattr__(self, name, values)

    @cached_property
    def spline(self) -> "CubicSpline":
        """The spline through the points."""
        from scipy.interpolate import CubicSpline  # a quarter of a second, where only the keys of a wheel are asked for

        return CubicSpline(self.y, self.z, bc_type="natural")

    def height(self, y: Array) -> Array:
        """Return z at y [m]; -infinity beyond the ends of the profile."""
        y = np.asarray(y, dtype=float)
        inside = (y >= self.y[0]) & (y <= self.y[-1])
        return np.where(inside, self.spline(np.clip(y, self.y[0], self.y[-1])), -np.inf)

    def slope(self, y: Array) -> Array:
        """Return dz/dy at y."""
        return self.spline(np.asarray(y, dtype=float), 1)

    def curvature(self, y: Array) -> Array:
        """Return z'' (1 + z'²)^(-3/2) at y [1/m]."""
        y = np.asarray(y, dtype=float)
        return self.spline(y, 2) * (1 + self.spline(y, 1) ** 2) ** -1.5


def checked_points(where: str, kind: str, y: Any, z: Any) -> tuple[Array, Array]:
    """Return y and z as increasing arrays; raise an error that describes invalid points."""
    try:
        y, z = np.array(y, dtype=float), np.array(z, dtype=float)
    except (TypeError, ValueError):
        raise ModelError(f"{where}: expected numbers for y and z [m]") from None
    if y.ndim != 1 or y.shape != z.shape or len(y) < 5:
        raise ModelError(
            f"{where}: expected two equal lists of at least 5 numbers, y and z, got {y.shape} and {z.shape}"
        )
    if not (np.isfinite(y).all() and np.isfinite(z).all()):
        raise ModelError(f"{where}: expected finite numbers")
    if y[0] > y[-1]:
        y, z = y[::-1].copy(), z[::-1].copy()
    width, height = float(np.ptp(y)), float(np.ptp(z))
    low, high = WIDTHS[kind]
    if width > 1000 * low * 0.5 or height > 1000 * MOST_HEIGHT * 0.1:
        raise ModelError(
            f"{where}: {width:g} m wide and {height:g} m high: these look like millimetres; give metres (times 0.001)"
        )
    back = np.flatnonzero(np.diff(y) <= 0)
    if len(back):
        i = back[0]
        raise ModelError(
            f"{where}: not a single height over y: point {i + 1} at y = {y[i]:.6g} m is followed by {y[i + 1]:.6g} m; "
            "a profile must not cross itself or turn back: cut it at its steep ends, and give each y once"
        )
    if not low <= width <= high:
        raise ModelError(f"{where}: a {kind} is between {low:g} m and {high:g} m wide, got {width:g} m")
    if height > MOST_HEIGHT:
        raise ModelError(f"{where}: heights differ by {height:g} m, more than {MOST_HEIGHT:g} m: is the unit metre?")
    return y, z


def profile_of_points(
    kind: str, y: Array, z: Array, *, name: str = "points", noise: float | None = None, spacing: float = 2e-4
) -> Profile:
    """Return a smoothed measured profile.

    The smoothing spline minimises sum (z_i - f(y_i))² + lam int f''² dy. With `noise`, the standard deviation of the
    measured heights, lam is chosen such that the residual has this size; otherwise by generalised cross-validation.

    Parameters
    ----------
    kind
        "wheel" or "rail".
    y, z
        Points [m], y strictly monotonic.
    name
        Name in messages.
    noise
        Standard deviation of z [m]; 0: interpolation of the points.
    spacing
        Spacing of the points that represent the smooth curve [m].
    """
    from scipy.interpolate import CubicSpline, make_smoothing_spline

    where = f"profile {name!r}"
    y, z = checked_points(where, kind, y, z)
    if noise is not None and not (np.isfinite(noise) and noise >= 0):
        raise ModelError(f"{where}: noise: expected a number of 0 or more [m], got {noise}")
    grid = np.linspace(y[0], y[-1], max(5, int(np.ceil((y[-1] - y[0]) / spacing)) + 1))
    # in millimetres, in which the normal equations of the smoothing spline are better scaled
    if noise == 0:
        smooth = CubicSpline(y * 1e3, z * 1e3, bc_type="natural")(grid * 1e3)
    elif noise is None:
        smooth = make_smoothing_spline(y * 1e3, z * 1e3)(grid * 1e3)
    else:
        smooth = smoothed_to_noise(y * 1e3, z * 1e3, noise * 1e3)(grid * 1e3)
    return Profile(kind, grid, smooth * 1e-3, name)


def smoothed_to_noise(y: Array, z: Array, noise: float) -> Any:
    """Return the smoothing spline with residual `noise`; the residual grows with lam, whose logarithm is bisected."""
    from scipy.interpolate import make_smoothing_spline

    low, high = -12.0, 8.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        spline = make_smoothing_spline(y, z, lam=10.0**middle)
        residual = float(np.sqrt(np.mean((spline(y) - z) ** 2)))
        low, high = (middle, high) if residual < noise else (low, middle)
    return make_smoothing_spline(y, z, lam=10.0**low)
