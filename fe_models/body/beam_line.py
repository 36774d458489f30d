"""Straight beam with mass and stiffness per length along x: uniform, tapered or stepped."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.polynomial import Polynomial

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError, BodyError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields

__all__ = ["BeamLine", "Law"]

Law = float | Polynomial | Callable[[Array], Array]  #: quantity per length: a constant, or a function of x

STIFFNESSES = ("EA", "EIy", "EIz", "GJ", "GAy", "GAz")
SMOOTH_DEGREE = 24  #: polynomial degree assumed for the integration of a law that is a Python function


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class BeamLine:
    """A straight beam from x = 0 to its length; y and z are the principal axes of its sections, with centroids on x.

    Each law is a number, a `numpy.polynomial.Polynomial` of x, or a function of an array of x. Integrals of numbers and
    polynomials are exact between `breaks`. Functions are integrated as polynomials of degree 24.

    Parameters
    ----------
    length
        Length of the beam [m].
    rho_A
        Mass per length [kg/m].
    EA
        Axial stiffness [N].
    EIy
        Bending stiffness in the x-z plane, EI with I = ∫ z² dA [N m²].
    EIz
        Bending stiffness in the x-y plane, EI with I = ∫ y² dA [N m²].
    GJ
        Torsional stiffness [N m²].
    rho_Iy
        Rotary inertia per length, ∫ rho z² [kg m].
    rho_Iz
        Rotary inertia per length, ∫ rho y² [kg m].
    GAy
        Shear stiffness along y; infinite: sections stay normal to the axis [N].
    GAz
        Shear stiffness along z [N].
    breaks
        Ascending positions inside the length at which laws have a jump or a kink [m].

    Raises
    ------
    BodyError
        If the length is not positive, or the breaks are not ascending inside it; later, where a law is not positive.
    """

    length: float
    rho_A: Law  # noqa: N815
    EA: Law
    EIy: Law
    EIz: Law
    GJ: Law
    rho_Iy: Law = 0.0  # noqa: N815
    rho_Iz: Law = 0.0  # noqa: N815
    GAy: Law = np.inf
    GAz: Law = np.inf
    breaks: tuple[float, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "length", float(self.length))
        object.__setattr__(self, "breaks", tuple(float(x) for x in self.breaks))
        if not 0 < self.length < np.inf:
            raise BodyError(f"beam line: length: expected a number above zero, got {self.length:g}")
        ends = (0.0, *self.breaks, self.length)
        if not all(a < b for a, b in pairwise(ends)):
            raise BodyError(
                f"beam line: breaks: expected ascending numbers inside 0 .. {self.length:g}, got {ends[1:-1]}"
            )

    @property
    def has_shear(self) -> bool:
        """Whether the beam has shear deformation."""
        return any(callable(law) or np.isfinite(law) for law in (self.GAy, self.GAz))

    @property
    def degree(self) -> int:
        """Highest polynomial degree of the laws, as used for their integration."""
        degrees = [0]
        for name in (*STIFFNESSES, "rho_A", "rho_Iy", "rho_Iz"):
            law = getattr(self, name)
            if isinstance(law, Polynomial):
                degrees.append(law.degree())
            elif callable(law):
                degrees.append(SMOOTH_DEGREE)
        return max(degrees)

    def at(self, name: str, x: Array) -> Array:
        """Return the values of a law at the positions x, (n,).

        Parameters
        ----------
        name
            Field name of the law, such as "EA".
        x
            Positions along the axis, (n,) [m].

        Raises
        ------
        BodyError
            If a value is not positive (for inertia: negative), or the law returns an array of another shape.
        """
        law = getattr(self, name)
        values = np.asarray(law(x) if callable(law) else np.full(np.shape(x), float(law)), dtype=float)
        least = 0.0 if name.startswith("rho_I") else np.finfo(float).tiny
        if values.shape != np.shape(x) or not (values >= least).all():
            wrong = values.ravel()[np.argmin(np.where(np.isnan(values), -np.inf, values))] if values.size else np.nan
            raise BodyError(
                f"beam line: {name}: expected {'no negative' if least == 0 else 'positive'} numbers, one for each of "
                f"{np.shape(x)} places, got {values.shape}, least {wrong:g}"
            )
        return values

    def points(self, degree: int, *, breaks: Array | None = None) -> tuple[Array, Array]:
        """Return Gauss points and weights, (n,), exact between breaks for products of a law and such a polynomial."""
        inner = np.asarray(self.breaks if breaks is None else [*self.breaks, *breaks])
        inner = np.unique(inner[(inner > 0) & (inner < self.length)])
        ends = np.concatenate([[0.0], inner, [self.length]])
        ends = ends[np.concatenate([[True], np.diff(ends) > 1e-12 * self.length])]
        ends[-1] = self.length
        xi, weight = np.polynomial.legendre.leggauss((degree + self.degree) // 2 + 1)
        half = np.diff(ends)[:, None] / 2
        middle = (ends[1:] + ends[:-1])[:, None] / 2
        return (middle + half * xi).ravel(), (half * weight).ravel()
