"""Rolling radius difference, equivalent conicity and Klingel's wavelength: the kinematics of a free wheelset.

A wheelset that rolls slowly without slip satisfies y'' + delta_r(y)/(r_0 e_0) = 0. y is the lateral shift at the height
of the rails (that of the axle, which also rolls, is smaller by r_0 phi), e_0 the distance of the contact points, and
primes are derivatives along the track. For a conical wheelset, delta_r = 2 lam y, the wavelength is 2 pi sqrt(r_0
e_0/(2 lam)). The equivalent conicity for an amplitude is that of the cone with the same wavelength (definition of UIC
519 and EN 15302).
"""

import numpy as np
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from scipy.optimize import brentq

from fe_models.foundation.arrays import Array
from floatframe.components.rails.contact_search import Pair, quasi_elastic, rigid_contacts
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = ["equivalent_conicity", "harmonic_conicity", "klingel_wavelength", "rolling_radius_difference", "wheelset_at"]


def klingel_wavelength(conicity: float, radius: float, running_circles: float) -> float:
    """Return 2 pi sqrt(r_0 e_0/(2 lam)) [m], with the distance e_0 of the running circles (Klingel 1883)."""
    for name, value in (("conicity", conicity), ("radius", radius), ("running_circles", running_circles)):
        number(f"klingel_wavelength: {name}", value, above=0.0)
    return float(2 * np.pi * np.sqrt(radius * running_circles / (2 * conicity)))


def wheelset_at(pair: Pair, y: Array, *, smoothing: float | None = None) -> tuple[Array, Array, Array]:
    """Return left and right rolling radii and the roll of a wheelset shifted by y to the left, (n,) each.

    y is the shift at the height of the rails; that of the axle is y - r_0 phi. Both wheels are in contact: the roll phi
    (left side up) satisfies h_left = h_right + e_0 phi. With `smoothing`, the contact is quasi-elastic, otherwise that
    of rigid bodies.
    """
    y = np.atleast_1d(np.asarray(y, dtype=float))
    left, right, rolls = np.empty_like(y), np.empty_like(y), np.empty_like(y)
    for i, shift in enumerate(y):

        def heights(phi: float, shift: float = float(shift)) -> tuple[float, float, float, float]:
            # a roll about the centre of the axle also shifts the centres of both wheels by arm (1 - cos), which is
            # neglected
            found = []
            for side in (1.0, -1.0):
                u = side * (shift - pair.radius * float(np.sin(phi)))
                if smoothing is None:
                    point = rigid_contacts(pair, u, roll=side * phi)[0]
                    found.append((point.height, point.radius))
                else:
                    one = quasi_elastic(pair, np.array([u]), roll=side * phi, smoothing=smoothing)
                    found.append((float(one.q[0]), float(one.radius[0])))
            return found[0][0], found[1][0], found[0][1], found[1][1]

        def gap(phi: float) -> float:
            h_left, h_right, _, _ = heights(phi)
            return h_left - h_right - pair.running_circles * phi

        try:
            phi = float(brentq(gap, -0.05, 0.05, xtol=1e-10))
        except ValueError:
            raise ModelError(f"wheelset_at: at y = {shift:g} m no roll brings both wheels onto their rails") from None
        _, _, left[i], right[i] = heights(phi)
        rolls[i] = phi
    return left, right, rolls


def rolling_radius_difference(pair: Pair, y: Array, *, smoothing: float | None = None) -> Array:
    """Return r_left - r_right [m] for a shift y to the left at the height of the rails [m], (n,)."""
    left, right, _ = wheelset_at(pair, y, smoothing=smoothing)
    return left - right


def equivalent_conicity(
    pair: Pair, amplitude: float, *, difference: tuple[Array, Array] | None = None, smoothing: float | None = None
) -> float:
    """Return the conicity of the cone with the same wavelength as the non-linear wave of this amplitude.

    Energy of y'' = -f(y), f = delta_r/(r_0 e_0): y'²/2 + U(y) = U(a); wavelength = 2 int dy/sqrt(2 (U(a) - U(y)))
    between the turning points; lam = (2 pi/wavelength)² r_0 e_0/2.

    Parameters
    ----------
    pair
        Wheel and rail, equal on both sides.
    amplitude
        Half the distance between the turning points [m]; usually 3 mm.
    difference
        Measured y and delta_r, (n,) each, instead of those of the pair.
    smoothing
        Smoothing of a quasi-elastic contact [m]; None: rigid contact.

    Raises
    ------
    ModelError
        If there is no restoring effect (delta_r does not rise through zero).
    """
    amplitude = number("equivalent_conicity: amplitude", amplitude, above=0.0)
    if amplitude > 0.02:
        raise ModelError(f"equivalent_conicity: amplitude: expected millimetres such as 0.003 m, got {amplitude:g} m")
    if difference is None:
        y = np.linspace(-1.25, 1.25, 101) * amplitude
        delta = rolling_radius_difference(pair, y, smoothing=smoothing)
    else:
        y, delta = (np.asarray(each, dtype=float) for each in difference)
    scale = pair.radius * pair.running_circles
    # rigid contact has small kinks; the potential is integrated piecewise linearly, smooth enough for its spline
    fine = np.linspace(y[0], y[-1], 20 * len(y))
    f = np.interp(fine, y, delta) / scale
    U = CubicSpline(fine, np.concatenate([[0.0], np.cumsum(0.5 * (f[1:] + f[:-1]) * np.diff(fine))]))
    centre = float(fine[np.argmin(U(fine))])
    if not fine[2] < centre < fine[-3]:
        raise ModelError(
            "equivalent_conicity: the wheelset has no restoring effect: delta_r does not rise through zero"
        )

    def turning(low: float) -> float:
        return float(U(low) - U(low + 2 * amplitude))

    try:
        left = float(
            brentq(turning, max(fine[0], centre - 2 * amplitude), min(centre, fine[-1] - 2 * amplitude), xtol=1e-12)
        )
    except ValueError:
        raise ModelError(
            f"equivalent_conicity: no wave of amplitude {amplitude:g} m within the shifts "
            f"from {fine[0]:g} to {fine[-1]:g} m"
        ) from None
    top = float(U(left))
    middle = left + amplitude

    def integrand(angle: float) -> float:
        # the substitution y = middle + a sin(angle) removes the singularities at the ends
        height = top - float(U(middle + amplitude * np.sin(angle)))
        return amplitude * np.cos(angle) / np.sqrt(2 * height) if height > 0 else 0.0

    half, _ = quad(integrand, -np.pi / 2 + 1e-4, np.pi / 2 - 1e-4, limit=200, epsrel=1e-6)
    # the integrand is nearly constant at the two ends, a/sqrt(a |f|)
    half += 1e-4 * (integrand(-np.pi / 2 + 1e-4) + integrand(np.pi / 2 - 1e-4))
    return float((np.pi / half) ** 2 * scale / 2)


def harmonic_conicity(pair: Pair, amplitude: float, *, smoothing: float | None = None, points: int = 90) -> float:
    """Return the conicity from harmonic linearisation: (1/(2 pi a)) int delta_r(a sin t) sin t dt over one period.

    It is obtained from the first harmonic of delta_r = 2 lam y along a sine, and is close to the equivalent conicity.
    """
    amplitude = number("harmonic_conicity: amplitude", amplitude, above=0.0)
    t = 2 * np.pi * (np.arange(points) + 0.5) / points
    quarter = t[: points // 2]
    delta = rolling_radius_difference(pair, amplitude * np.sin(quarter), smoothing=smoothing)
    other = rolling_radius_difference(pair, -amplitude * np.sin(quarter), smoothing=smoothing)
    both = np.concatenate([delta * np.sin(quarter), -other * np.sin(quarter)])
    return float(both.sum() / points / amplitude)
