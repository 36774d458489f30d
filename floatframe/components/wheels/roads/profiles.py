"""Profiles of roads: random unevenness by ISO 8608, and single obstacles."""

from collections.abc import Sequence
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.components.wheels.roads.road import GridRoad, Polyline, knots
from floatframe.errors import ModelError
from floatframe.model.checked_values import array_of_shape, number

__all__ = ["ROUGHNESS", "bump", "cosine_bump", "density", "iso_8608_road", "ramp", "step", "track_correlation"]


# iso 8608 -------------------------------------------------------------------------------------------------------------
# Random roads of ISO 8608 with the one-sided density G_d(n) = G_d(n_0) (n/n_0)^-w of the height, n_0 = 0.1 cycles/m.
#
# A profile is the sum of cosines sqrt(2 G_d dn) cos(2 pi n x + phi) at equally spaced n with random phases, so that its
# density is exactly that of the class, not only on average. Tracks at distance b on an isotropic surface have the
# normalised cross density (the two-dimensional density is proportional to |n|^-(w + 1); its section at lag b is
# Basset's integral)
#
#     g(n, b) = 2/Gamma(w/2) (pi n b)^(w/2) K_(w/2)(2 pi n b),
#
# which is 1 for long waves and 0 for short ones. Tracks are made from independent tracks with the Cholesky factor of
# the matrix of g between all of them. The coherence is g².


#: spectral density G_d(n_0) at the geometric mean of each class [m³]
ROUGHNESS = {name: 16e-6 * 4.0**k for k, name in enumerate("ABCDEFGH")}
REFERENCE = 0.1  #: reference wavenumber n_0 [cycles/m]
CLASS_RANGE = 0.011, 2.83  #: range of wavenumbers n for the classes of the standard [cycles/m]
WAVES = 8  #: number of the longest waves in the period of the series


def density(road_class: str, n: Array, *, waviness: float = 2.0) -> Array:
    """Return the one-sided spectral density G_d [m³] in the middle of a class, at wavenumber n [cycles/m]."""
    if road_class not in ROUGHNESS:
        raise ModelError(f"road: class: expected one of {', '.join(ROUGHNESS)}, got {road_class!r}")
    return ROUGHNESS[road_class] * (np.asarray(n) / REFERENCE) ** -waviness


def track_correlation(n: Array, b: float, *, waviness: float = 2.0) -> Array:
    """Return g(n, b) of tracks at distance b [m] on an isotropic surface, with the shape of n [cycles/m]."""
    from scipy.special import gamma, kv  # slow to import

    a = np.pi * np.asarray(n, dtype=float) * abs(b)
    small = a < 1e-8
    safe = np.where(small, 1.0, a)
    order = 0.5 * waviness
    return np.where(small, 1.0, 2 / gamma(order) * safe**order * kv(order, 2 * safe))


def iso_8608_road(
    road_class: str,
    length: float,
    *,
    seed: int,
    tracks: Sequence[float] = (0.0,),
    spacing: float = 0.05,
    band: tuple[float, float] = CLASS_RANGE,
    waviness: float = 2.0,
    run_in: float = 0.0,
    coherence: float | None = None,
    metre: float = 1.0,
) -> GridRoad:
    """Return a random road of a class from A (smooth) to H.

    Parameters
    ----------
    road_class
        Class, A to H.
    length
        Length of the road, which begins at x = 0 [m].
    seed
        Seed of the phases; the same seed gives the same road.
    tracks
        Positions y of the tracks, increasing [m]; the road is interpolated between them and level beyond them.
    spacing
        Spacing of the knots [m].
    band
        Lowest and highest n [cycles/m].
    waviness
        Exponent w.
    run_in
        Length over which the heights grow from zero, as a haversine [m].
    coherence
        Coherence of every two tracks, at all n; None: that of an isotropic surface.
    metre
        One metre in units of the system, such as 1000 for mm. All lengths above are in metres.

    Raises
    ------
    ModelError
        If a number is out of its range, or the spacing is too wide for the highest n.
    """
    length, spacing = number("road: length", length, above=0.0), number("road: spacing", spacing, above=0.0)
    low, high = array_of_shape("road: band", band, (2,))
    y = knots("road: tracks", tracks, least=1)
    metre = number("road: metre", metre, above=0.0)
    if not 0 < low < high:
        raise ModelError(f"road: band: expected 0 < lowest < highest n, got {low:g} and {high:g}")
    if 2 * spacing * high > 1:
        raise ModelError(
            f"road: spacing: {spacing:g} m does not resolve waves of {high:g} cycles/m; choose at most "
            f"{0.5 / high:.3g} m"
        )
    if coherence is not None and not 0 <= coherence <= 1:
        raise ModelError(f"road: coherence: expected a number from 0 to 1, got {coherence:g}")
    n_samples = 2 ** int(np.ceil(np.log2(max(length, WAVES / low) / spacing + 1)))
    n = np.fft.rfftfreq(n_samples, spacing)
    inside = (n >= low) & (n <= high)
    amplitude = np.zeros(len(n))
    amplitude[inside] = np.sqrt(2 * density(road_class, n[inside], waviness=waviness) * n[1])
    phases = np.random.default_rng(seed).uniform(0, 2 * np.pi, (len(y), len(n)))
    waves = amplitude * np.exp(1j * phases)
    if len(y) > 1:
        waves = mixed(waves, n, y, waviness, coherence)
    z = np.fft.irfft(0.5 * n_samples * waves, n_samples, axis=1)  # cosines with the given amplitudes
    x = np.arange(int(np.ceil(length / spacing - 1e-9)) + 1) * spacing
    z = z[:, : len(x)]
    if run_in > 0:
        z = z * 0.5 * (1 - np.cos(np.pi * np.clip(x / run_in, 0, 1)))
    return GridRoad(np.asarray(metre * x), np.asarray(metre * z.T, dtype=np.float64), y=metre * y)


def mixed(waves: Any, n: Any, y: Array, waviness: float, coherence: float | None) -> Any:
    """Return independent waves, (n_tracks, n_n), combined so that the tracks have their correlation at each n."""
    apart = np.abs(y[:, None] - y[None, :])
    g = np.empty((len(n), len(y), len(y)))
    for i in range(len(y)):
        for j in range(len(y)):
            if coherence is None:
                g[:, i, j] = track_correlation(n, apart[i, j], waviness=waviness)
            else:
                g[:, i, j] = 1.0 if i == j else np.sqrt(coherence)
    factor = np.linalg.cholesky(g + 1e-12 * np.eye(len(y)))
    return np.einsum("nij,jn->in", factor, waves)


# obstacles of a test track as profiles: step, ramp and bumps ----------------------------------------------------------


PIECES = 64  #: number of straight pieces of a rounded bump


def step(at: float, height: float, *, length: float) -> Polyline:
    """Return a road from x = 0 to `length` [m] with an upright step at x = at; a negative height steps down."""
    at, length = place("step", at, length)
    return Polyline(np.array([0.0, at, at, length]), np.array([0.0, 0.0, 1.0, 1.0]) * number("step: height", height))


def ramp(at: float, height: float, run: float, *, length: float) -> Polyline:
    """Return a road that rises by `height` over `run`, beginning at x = at, and is level up to `length` [m]."""
    at, length = place("ramp", at, length)
    run = number("ramp: run", run, above=0.0)
    x = np.array([0.0, at, at + run, max(length, at + run)])
    return Polyline(x, np.array([0.0, 0.0, 1.0, 1.0]) * number("ramp: height", height))


def bump(at: float, height: float, width: float, *, length: float) -> Polyline:
    """Return a level road with a cleat of rectangular section from x = at to at + width [m]."""
    at, length = place("bump", at, length)
    end = at + number("bump: width", width, above=0.0)
    x = np.array([0.0, at, at, end, end, max(length, end)])
    return Polyline(x, np.array([0.0, 0.0, 1.0, 1.0, 0.0, 0.0]) * number("bump: height", height))


def cosine_bump(at: float, height: float, width: float, *, length: float) -> Polyline:
    """Return a level road with the bump height (1 - cos(2 pi s/width))/2, 0 <= s = x - at <= width [m]."""
    at, length = place("cosine_bump", at, length)
    s = np.linspace(0.0, 1.0, PIECES + 1)
    rise = 0.5 * number("cosine_bump: height", height) * (1 - np.cos(2 * np.pi * s))
    x = at + s * number("cosine_bump: width", width, above=0.0)
    return Polyline(np.concatenate([[0.0], x, [max(length, x[-1])]]), np.concatenate([[0.0], rise, [0.0]]))


def place(where: str, at: float, length: float) -> tuple[float, float]:
    """Return the checked start of an obstacle and the length of its road."""
    at, length = number(f"{where}: at", at, at_least=0.0), number(f"{where}: length", length, above=0.0)
    if at >= length:
        raise ModelError(f"{where}: at: expected a position on the road of length {length:g}, got {at:g}")
    return at, length
