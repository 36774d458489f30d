"""Cross-sections of beams: closed forms for common shapes, and a general section with given properties.

Local axes: x along the beam; y and z are principal axes through the centroid. Widths are along y, heights along z.
Shear areas kappa A are Cowper's (1966) for circle, ring, rectangle, and thin-walled I and box sections along their
webs. At nu = 0 they equal the values from the energy of the shear flow, kappa = I² / (A ∫ S²/t² dA), which the tests
integrate.
"""

from dataclasses import dataclass, fields
from typing import Protocol

import numpy as np

from fe_models.elements.beams.section_properties import SectionProperties, normal_stress
from fe_models.elements.beams.torsion import rectangle_torsion_constant, rectangle_torsion_stress
from fe_models.errors import SectionError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.records import checked_fields

__all__ = [
    "SECTIONS",
    "BoxSection",
    "Circle",
    "GeneralSection",
    "ISection",
    "Rectangle",
    "Section",
    "Tube",
    "circle_points",
    "ring_cap",
    "triangulate_polygon",
]


# polygons of cross-sections: area moments and triangles of the cap ----------------------------------------------------


NOT_SIMPLE = "section: outline: expected a simple polygon, anticlockwise in (y, z)"


def circle_points(radius: float, n: int) -> Array:
    """Return n points on a circle, (n, 2), anticlockwise from the y axis."""
    angle = 2 * np.pi * np.arange(n) / n
    return radius * np.stack([np.cos(angle), np.sin(angle)], axis=1)


def ring_cap(n: int) -> IntArray:
    """Return triangles between outer loop 0..n-1 and inner loop n..2n-1, (2 n, 3), anticlockwise."""
    i = np.arange(n)
    j = (i + 1) % n
    return np.concatenate([np.stack([i, j, n + j], axis=1), np.stack([i, n + j, n + i], axis=1)])


def triangulate_polygon(points: Array) -> IntArray:
    """Return triangles of a simple anticlockwise polygon by ear clipping, (n - 2, 3).

    An ear is a convex corner whose triangle contains no other vertex.

    Raises
    ------
    SectionError
        If the polygon is not simple or runs clockwise.
    """
    rest = list(range(len(points)))
    triangles = []
    while len(rest) > 3:
        for k in range(len(rest)):
            a, b, c = rest[k - 1], rest[k], rest[(k + 1) % len(rest)]
            others = [p for p in rest if p not in (a, b, c)]
            if _area(points[a], points[b], points[c]) > 0 and not _any_inside(points[[a, b, c]], points[others]):
                triangles.append((a, b, c))
                rest.pop(k)
                break
        else:
            if _is_flat(points, rest):
                break
            raise SectionError(NOT_SIMPLE)
    if len(rest) == 3:
        triangles.append((rest[0], rest[1], rest[2]))
    areas = [_area(*points[list(triangle)]) for triangle in triangles]
    y, z = np.asarray(points).T
    whole = float(y @ np.roll(z, -1) - z @ np.roll(y, -1)) / 2
    if not whole > 0 or min(areas) < -1e-12 * whole or abs(sum(areas) - whole) > 1e-9 * whole:
        raise SectionError(NOT_SIMPLE)
    return np.array(triangles, dtype=np.int64).reshape(-1, 3)


def _area(a: Array, b: Array, c: Array) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])) / 2


def _is_flat(points: Array, rest: list[int]) -> bool:
    size = float(np.ptp(points, axis=0).max()) ** 2
    return all(abs(_area(points[rest[0]], points[rest[1]], points[p])) <= 1e-12 * size for p in rest)


def _any_inside(triangle: Array, points: Array) -> bool:
    """Return whether a point is inside the triangle or on its edges."""
    a, b, c = triangle
    size = _area(a, b, c)
    return any(min(_area(a, b, p), _area(b, c, p), _area(c, a, p)) >= -1e-12 * size for p in points)


# sections -------------------------------------------------------------------------------------------------------------


N_CIRCLE = 16  #: number of points of a circular outline; the largest bending stress is at most 2 % too low


class Section(Protocol):
    """Shape that can compute its section properties."""

    def properties(self, nu: float) -> SectionProperties:
        """Return area, second moments, torsion constant, shear areas for Poisson's ratio nu, outline and stress."""


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Circle:
    """Solid circle.

    Parameters
    ----------
    radius
        Radius [m].
    """

    radius: float

    def __post_init__(self) -> None:
        require_lengths(self)

    def properties(self, nu: float) -> SectionProperties:
        """Return the properties; kappa = 6 (1 + nu) / (7 + 6 nu)."""
        return round_properties(self.radius, 0.0, nu)


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Tube:
    """Hollow circle.

    Parameters
    ----------
    radius
        Outer radius [m].
    thickness
        Wall thickness [m].
    """

    radius: float
    thickness: float

    def __post_init__(self) -> None:
        require_lengths(self)
        if self.thickness >= self.radius:
            raise SectionError(f"section Tube: thickness {self.thickness:g} leaves no hole with radius {self.radius:g}")

    def properties(self, nu: float) -> SectionProperties:
        """Return the properties; kappa = 6 (1+nu) (1+m²)² / ((7+6nu) (1+m²)² + (20+12nu) m²), m inner/outer radius."""
        return round_properties(self.radius, self.radius - self.thickness, nu)


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class Rectangle:
    """Solid rectangle.

    Parameters
    ----------
    width
        Width along y [m].
    height
        Height along z [m].
    """

    width: float
    height: float

    def __post_init__(self) -> None:
        require_lengths(self)

    def properties(self, nu: float) -> SectionProperties:
        """Return the properties; kappa = 10 (1 + nu) / (12 + 11 nu) in both directions."""
        b, h = self.width, self.height
        A, Iy, Iz = b * h, b * h**3 / 12, h * b**3 / 12
        points = rectangle_points(b, h)
        stress = normal_stress(points, A, Iy, Iz)
        for k, side in ((1, 1), (5, -1)):  # mid-points of the sides y = ± b/2: tau_xz = 3 V / (2 A)
            stress[k, 2, 2] = 1.5 / A
            stress[k, 2, 3] = side * rectangle_torsion_stress(b, h)
        for k, side in ((3, 1), (7, -1)):  # mid-points of the sides z = ± h/2
            stress[k, 1, 1] = 1.5 / A
            stress[k, 1, 3] = -side * rectangle_torsion_stress(h, b)
        A_s = 10 * (1 + nu) / (12 + 11 * nu) * A
        return SectionProperties(
            A=A,
            Iy=Iy,
            Iz=Iz,
            J=rectangle_torsion_constant(b, h),
            A_sy=A_s,
            A_sz=A_s,
            points=points,
            stress=stress,
            loops=(np.arange(8),),
            cap=triangulate_polygon(points),
        )


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class BoxSection:
    """Rectangular hollow section, given by its outer dimensions; the webs are along z.

    Parameters
    ----------
    width
        Outer width along y [m].
    height
        Outer height along z [m].
    web
        Thickness of the two walls along z [m].
    flange
        Thickness of the two walls along y [m].
    """

    width: float
    height: float
    web: float
    flange: float

    def __post_init__(self) -> None:
        require_lengths(self)
        if 2 * self.web >= self.width or 2 * self.flange >= self.height:
            raise SectionError(f"section BoxSection: the walls leave no hole: {self}")

    def properties(self, nu: float) -> SectionProperties:
        """Return the properties; J = 4 A_m² / ∮ ds/t (Bredt) + ∮ t³ ds / 3, A_m within the middle line.

        Corners are treated as sharp-edged strips, so J is 1 % too low if walls are 1/50 of the width, 3 % if 1/12.
        """
        b, h, t_w, t_f = self.width, self.height, self.web, self.flange
        b_i, h_i = b - 2 * t_w, h - 2 * t_f
        A, Iy, Iz = b * h - b_i * h_i, (b * h**3 - b_i * h_i**3) / 12, (h * b**3 - h_i * b_i**3) / 12
        b_m, h_m = b - t_w, h - t_f
        J = 4 * (b_m * h_m) ** 2 / (2 * b_m / t_f + 2 * h_m / t_w) + 2 * (b_m * t_f**3 + h_m * t_w**3) / 3
        points = np.vstack([rectangle_points(b, h), rectangle_points(b_i, h_i)])
        stress = normal_stress(points, A, Iy, Iz)
        bredt_w, bredt_f = 1 / (2 * b_m * h_m * t_w), 1 / (2 * b_m * h_m * t_f)
        # first moments of one half of the box, for a force along z
        S_corner, S_web = b_m / 2 * t_f * h_m / 2, b_m / 2 * t_f * h_m / 2 + t_w * h_m**2 / 8
        S_flange = h_m / 2 * t_w * b_m / 2 + t_f * b_m**2 / 8  # first moments for a force along y
        for first in (0, 8):  # corners belong to the webs, which have shear flow only for a force along z
            for k, side in ((0, 1), (1, 1), (2, 1), (4, -1), (5, -1), (6, -1)):
                stress[first + k, 2, 2] = (S_web if k in (1, 5) else S_corner) / (Iy * t_w)
                stress[first + k, 2, 3] = side * bredt_w
            for k, side in ((3, 1), (7, -1)):
                stress[first + k, 1, 1] = S_flange / (Iz * t_f)
                stress[first + k, 1, 3] = -side * bredt_f
        return SectionProperties(
            A=A,
            Iy=Iy,
            Iz=Iz,
            J=J,
            A_sy=box_shear_coefficient(b_m, 2 * t_f, h_m, t_w, nu) * A,
            A_sz=box_shear_coefficient(h_m, 2 * t_w, b_m, t_f, nu) * A,
            points=points,
            stress=stress,
            loops=(np.arange(8), np.arange(8, 16)),
            cap=ring_cap(8),
        )


@dataclass(frozen=True)
@checked_fields(ArgumentError)
class ISection:
    """Doubly symmetric I or H section, web along z.

    Parameters
    ----------
    width
        Width of the flanges, along y [m].
    height
        Outer height along z [m].
    web
        Thickness of the web [m].
    flange
        Thickness of the flanges [m].
    """

    width: float
    height: float
    web: float
    flange: float

    def __post_init__(self) -> None:
        require_lengths(self)
        if 2 * self.flange >= self.height or self.web >= self.width:
            raise SectionError(f"section ISection: the walls fill the outline: {self}")

    def properties(self, nu: float) -> SectionProperties:
        """Return the properties; J is the sum of the three rectangles.

        Fillets and junctions are neglected. J is 2 to 4 % low for sharp-cornered rolled profiles, and 9 % low if the
        walls are a tenth of the width.
        """
        b, h, t_w, t_f = self.width, self.height, self.web, self.flange
        h_w, h_m = h - 2 * t_f, h - t_f
        A = 2 * b * t_f + h_w * t_w
        Iy, Iz = (b * h**3 - (b - t_w) * h_w**3) / 12, (2 * t_f * b**3 + h_w * t_w**3) / 12
        J = 2 * rectangle_torsion_constant(b, t_f) + rectangle_torsion_constant(h_w, t_w)
        w, u, top = b / 2, t_w / 2, h / 2
        inner = top - t_f
        right = [(w, inner), (w, top), (0, top)]
        left = [(-y, z) for y, z in right[1::-1]]
        web = [(-u, inner), (-u, 0.0), (-u, -inner)]
        upper = [*right, *left, *web]
        points = np.array([*upper, *[(-y, -z) for y, z in upper]])
        stress = normal_stress(points, A, Iy, Iz)
        S_junction, S_web = b * t_f * h_m / 2, b * t_f * h_m / 2 + t_w * h_w**2 / 8
        for k, (y, z) in enumerate(points):
            if abs(y) == u:  # in the web q = V S / I
                stress[k, 2, 2] = (S_web if z == 0 else S_junction) / (Iy * t_w)
                stress[k, 2, 3] = np.sign(y) * t_w / J
            else:  # in the flange Vy acts as on a rectangle and vanishes at the tips; torsion acts along its faces
                stress[k, 1, 1] = 1.5 / (2 * b * t_f) if y == 0 else 0.0
                stress[k, 1, 3] = -(1 if abs(z) == top else -1) * np.sign(z) * t_f / J
        return SectionProperties(
            A=A,
            Iy=Iy,
            Iz=Iz,
            J=J,
            A_sy=5 / 6 * 2 * b * t_f,
            A_sz=i_shear_coefficient(h_m, t_w, b, t_f, nu) * A,
            points=points,
            stress=stress,
            loops=(np.arange(len(points)),),
            cap=triangulate_polygon(points),
        )


@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class GeneralSection:
    """Section with given properties in principal axes.

    Shear stress is not recovered. The outline is drawn, and its vertices show the normal stress.

    Parameters
    ----------
    A
        Area [m²].
    Iy
        Second moment of area, ∫ z² [m⁴].
    Iz
        Second moment of area, ∫ y² [m⁴].
    J
        Torsion constant [m⁴].
    A_sy
        Shear area along y [m²]; infinite: no shear deformation.
    A_sz
        Shear area along z [m²].
    shear_center
        Position (y, z) of the shear centre relative to the centroid [m].
    outline
        Polygon (y, z), anticlockwise, (n, 2) [m]; None: the rectangle with the same A, Iy, Iz.
    """

    A: float
    Iy: float
    Iz: float
    J: float
    A_sy: float = np.inf
    A_sz: float = np.inf
    shear_center: tuple[float, float] = (0.0, 0.0)
    outline: Array | None = None

    def properties(self, nu: float) -> SectionProperties:
        """Return the given properties."""
        if not (self.A > 0 and self.Iy > 0 and self.Iz > 0):
            raise SectionError(
                f"section GeneralSection: expected A, Iy, Iz above zero, got {self.A}, {self.Iy}, {self.Iz}"
            )
        if self.outline is None:
            points = rectangle_points(np.sqrt(12 * self.Iz / self.A), np.sqrt(12 * self.Iy / self.A))
        else:
            points = np.asarray(self.outline, dtype=float)
            if points.ndim != 2 or points.shape[1] != 2 or len(points) < 3 or not np.isfinite(points).all():
                raise SectionError(f"section GeneralSection: outline: expected points (n >= 3, 2), got {points.shape}")
        return SectionProperties(
            A=self.A,
            Iy=self.Iy,
            Iz=self.Iz,
            J=self.J,
            A_sy=self.A_sy,
            A_sz=self.A_sz,
            points=points,
            stress=normal_stress(points, self.A, self.Iy, self.Iz),
            loops=(np.arange(len(points)),),
            cap=triangulate_polygon(points),
            shear_center=self.shear_center,
            shows_shear=False,
            is_outline_known=self.outline is not None,
        )


SECTIONS: dict[str, type] = {
    "circle": Circle,
    "tube": Tube,
    "rectangle": Rectangle,
    "box": BoxSection,
    "i": ISection,
    "general": GeneralSection,
}  #: section class of each shape name in a job file


def require_lengths(section: object) -> None:
    """Raise `SectionError` unless every field is a finite length above zero."""
    for item in fields(section):  # type: ignore[arg-type]
        value = getattr(section, item.name)
        is_number = isinstance(value, int | float | np.number) and not isinstance(value, bool)
        if not is_number or not 0 < value < np.inf:
            raise SectionError(
                f"section {type(section).__name__}: {item.name}: expected a length above zero, got {value!r}"
            )


def round_properties(r_o: float, r_i: float, nu: float) -> SectionProperties:
    """Return the properties of a ring; tau = Mx r / J, and V ∫ y dA / (I 2 t) over the sector beyond the point."""
    A, inertia = np.pi * (r_o**2 - r_i**2), np.pi / 4 * (r_o**4 - r_i**4)
    m2 = (r_i / r_o) ** 2
    kappa = 6 * (1 + nu) * (1 + m2) ** 2 / ((7 + 6 * nu) * (1 + m2) ** 2 + (20 + 12 * nu) * m2)
    radii = (r_o, r_i) if r_i else (r_o,)
    points = np.vstack([circle_points(r, N_CIRCLE) for r in radii])
    stress = normal_stress(points, A, inertia, inertia)
    along = np.stack([-points[:, 1], points[:, 0]], axis=1) / np.linalg.norm(points, axis=1)[:, None]
    flow = (r_o**3 - r_i**3) / (3 * inertia * (r_o - r_i))
    for force, slope in ((1, along[:, 0]), (2, along[:, 1])):
        stress[:, 1:, force] = flow * slope[:, None] * along
    stress[:, 1:, 3] = np.stack([-points[:, 1], points[:, 0]], axis=1) / (2 * inertia)
    return SectionProperties(
        A=A,
        Iy=inertia,
        Iz=inertia,
        J=2 * inertia,
        A_sy=kappa * A,
        A_sz=kappa * A,
        points=points,
        stress=stress,
        loops=tuple(np.arange(N_CIRCLE) + k * N_CIRCLE for k in range(len(radii))),
        cap=ring_cap(N_CIRCLE) if r_i else triangulate_polygon(points),
    )


def rectangle_points(b: float, h: float) -> Array:
    """Return corners and mid-points of the sides, (8, 2), anticlockwise from the corner (b/2, -h/2)."""
    y, z = b / 2, h / 2
    return np.array([(y, -z), (y, 0), (y, z), (0, z), (-y, z), (-y, 0), (-y, -z), (0, -z)])


def i_shear_coefficient(h: float, t_w: float, b: float, t_f: float, nu: float) -> float:
    """Return Cowper's shear coefficient of a thin-walled I section along its web; h is between flange mid-lines."""
    m, n2 = 2 * b * t_f / (h * t_w), (b / h) ** 2
    return (
        10 * (1 + nu) * (1 + 3 * m) ** 2 / (_web_terms(m, nu) + 30 * n2 * (m + m**2) + 5 * nu * n2 * (8 * m + 9 * m**2))
    )


def box_shear_coefficient(h: float, t_webs: float, b: float, t_f: float, nu: float) -> float:
    """Return Cowper's shear coefficient of a thin-walled box along its webs; t_webs is their total thickness."""
    m, n2 = 2 * b * t_f / (h * t_webs), (b / h) ** 2
    return 10 * (1 + nu) * (1 + 3 * m) ** 2 / (_web_terms(m, nu) + 10 * n2 * ((3 + nu) * m + 3 * m**2))


def _web_terms(m: float, nu: float) -> float:
    return (12 + 72 * m + 150 * m**2 + 90 * m**3) + nu * (11 + 66 * m + 135 * m**2 + 90 * m**3)
