"""A straight beam as beam theory sees it: mass and stiffness per length along x, uniform, tapered or stepped."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.polynomial import Polynomial

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import BodyError

__all__ = ["BeamLine", "Law"]

Law = float | Polynomial | Callable[[Array], Array]  #: a value per length: constant, or a function of x

STIFFNESSES = ("EA", "EIy", "EIz", "GJ", "GAy", "GAz")
SMOOTH_DEGREE = 24  #: degree to which a law given as a function is integrated


@dataclass(frozen=True, eq=False)
class BeamLine:
    """A straight beam from x = 0 to its length, y and z the principal axes of its sections, centroids on x.

    Each law is a number, a `numpy.polynomial.Polynomial` of x, or a function of an array of x. Integrals are exact for
    numbers and polynomials between `breaks`; functions count as polynomials of degree 24.

    Raises
    ------
    BodyError
        If the length is not positive or the breaks are not inside it, ascending; later, where a law is not positive.
    """

    length: float  #: [m]
    rho_A: Law  # noqa: N815  #: mass [kg/m]
    EA: Law  #: of tension [N]
    EIy: Law  #: of bending in the x-z plane, EI of ∫ z² [N m²]
    EIz: Law  #: of bending in the x-y plane, EI of ∫ y² [N m²]
    GJ: Law  #: of torsion [N m²]
    rho_Iy: Law = 0.0  # noqa: N815  #: rotary inertia ∫ rho z² [kg m]
    rho_Iz: Law = 0.0  # noqa: N815  #: rotary inertia ∫ rho y² [kg m]
    GAy: Law = np.inf  #: of shear along y; infinite: sections stay normal to the axis [N]
    GAz: Law = np.inf  #: of shear along z [N]
    breaks: tuple[float, ...] = ()  #: where laws jump or have a kink, ascending, inside the length [m]

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
        """Whether it deforms in shear."""
        return any(callable(law) or np.isfinite(law) for law in (self.GAy, self.GAz))

    @property
    def degree(self) -> int:
        """Highest degree of the laws, as they are integrated."""
        degrees = [0]
        for name in (*STIFFNESSES, "rho_A", "rho_Iy", "rho_Iz"):
            law = getattr(self, name)
            if isinstance(law, Polynomial):
                degrees.append(law.degree())
            elif callable(law):
                degrees.append(SMOOTH_DEGREE)
        return max(degrees)

    def at(self, name: str, x: Array) -> Array:
        """Return the values of a law at the places x, (n,).

        Raises
        ------
        BodyError
            Where it is not positive (inertia: negative) or gives numbers of another shape.
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
        """Return Gauss points and weights, exact for laws times polynomials of this degree between the breaks, (n,)."""
        inner = np.asarray(self.breaks if breaks is None else [*self.breaks, *breaks])
        inner = np.unique(inner[(inner > 0) & (inner < self.length)])
        ends = np.concatenate([[0.0], inner, [self.length]])
        ends = ends[np.concatenate([[True], np.diff(ends) > 1e-12 * self.length])]
        ends[-1] = self.length
        xi, weight = np.polynomial.legendre.leggauss((degree + self.degree) // 2 + 1)
        half = np.diff(ends)[:, None] / 2
        middle = (ends[1:] + ends[:-1])[:, None] / 2
        return (middle + half * xi).ravel(), (half * weight).ravel()
