"""Curved beams of Nastran: CBEND with PBEND, by the exact flexibility of a circular arc."""

from dataclasses import dataclass

import numpy as np

from fe_models.elements.beams.sections import round_properties
from fe_models.files.decks.deck import DeckMass, DeckSpring, Vector, as_triad
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.files.nastran.deck.model import ALONG, NastranModel
from fe_models.foundation.arrays import Array

__all__ = ["read_bends"]

N_POINTS = 40  #: number of Gauss points along an arc; the integrand is a product of sines and cosines
LEAST_ANGLE, LARGEST_ANGLE = 1e-3, np.deg2rad(350.0)  #: smallest and largest angle of an arc [rad]
SAME = 1e-3  #: relative difference of DELTAN from its default up to which it is rounding on the card


@dataclass(frozen=True)
class _Arc:
    """Circle through both grid points."""

    center: Array  #: centre of the circle, (3,)
    radius: float
    angle: float  #: angle from GA to GB
    axes: Array  #: rows, (3, 3): x from the centre to the middle of the arc, y along the arc from GA to GB, z normal


@dataclass(frozen=True)
class _Bend:
    """Section of a PBEND."""

    A: float
    I1: float  #: second moment for bending in the plane of the arc
    I2: float  #: second moment for bending out of the plane of the arc
    J: float
    shear: tuple[float, float]  #: shear areas in and out of the plane; infinite: no shear deformation
    offset: float  #: distance of the neutral axis from the centroid, towards the centre of the arc


def read_bends(model: NastranModel) -> None:
    """Convert each CBEND to two springs between its grid points, and two rigid bodies with mass.

    (1) The circle through the grid points is determined as GEOM requires.
    (2) The line of centroids is shifted from it by RC outward and by ZC along z. x points outward, z is normal to the
        plane of the arc, and y = z × x points from GA to GB.
    (3) The flexibility is integrated along the arc (`_flexibility`).
    (4) The arc is symmetric about x. The elastic centre for motion in the plane is the point p = -c_ym/c_mm on x, and
        for motion out of the plane p = c_zm/c_mm. Both flexibilities are diagonal there, so that each is represented by
        one spring with rigid arms.
    (5) The mass of each half of the arc is a rigid body attached to its end.
    """
    for card in model.of("CBEND"):
        why = _curved_beam(model, card)
        if why:
            model.ledger.refuse("CBEND", why)


def _curved_beam(model: NastranModel, card: Card) -> str:
    """Add a curved beam; return a text with the reason if it cannot be converted."""
    known = model.property_of(card, "PBEND")
    if known is None:
        return f"names PBEND {card.text(2) or card.text(1)}, which is not defined"
    name = known.text(2)
    material = model.materials.get(name)
    if material is None or not isinstance(material.young, float) or not isinstance(material.poisson, float):
        return f"material {name} is not known here, or not isotropic"
    RC, ZC = (known.real(k, 0.0) for k in (20, 21))
    arc = _arc(model, card, known, RC)  # (1)
    if isinstance(arc, str):
        return arc
    R = arc.radius + RC  # (2)
    section = _section(known, R, material.poisson)
    if isinstance(section, str):
        return f"PBEND {known.text(1)}: {section}"
    E, G = material.young, model.shear_modulus(name)
    C = _flexibility(section, E, G, R, arc.angle)  # (3)
    middle = arc.center + R * arc.axes[0] + ZC * arc.axes[2]
    nodes = [model.group(card, [card.integer(k)]) for k in (3, 4)]
    p = -C[1, 5] / C[5, 5], C[2, 4] / C[4, 4]  # (4)
    in_plane = (1 / C[0, 0], 1 / (C[1, 1] + p[0] * C[1, 5]), 0.0, 0.0, 0.0, 1 / C[5, 5])
    across = (0.0, 0.0, 1 / (C[2, 2] - p[1] * C[2, 4]), 1 / C[3, 3], 1 / C[4, 4], 0.0)
    for stiffness, place in ((in_plane, p[0]), (across, p[1])):
        at = _vector(middle + place * arc.axes[0])
        model.springs.append(DeckSpring((nodes[0], nodes[1]), stiffness, triad=as_triad(arc.axes), point=at))
    added = (material.density or 0.0) * section.A + known.real(19, 0.0) * model.wtmass
    for k, side in enumerate((-1, 1)):  # (5)
        if added:
            model.masses.append(_half(model, card, arc, middle, R, side, added, nodes[k]))
    why = "two springs with the flexibility of its arc, each half of its mass a rigid piece of its end"
    model.ledger.note("CBEND", why)
    return ""


def _vector(x: Array) -> Vector:
    return float(x[0]), float(x[1]), float(x[2])


def _arc(model: NastranModel, card: Card, known: Card, RC: float) -> _Arc | str:
    """Return the circle of a CBEND, or a text with the reason if there is none.

    d is the chord from GA to GB, v the vector from GA.
    GEOM = 1: v points to the centre, which is equally far from both ends: it is at t v with t = d²/(2 v · d)
    GEOM = 2: v is the tangent at GA, and the arc is on the side of v; the angle from v to d is half of the arc's angle
    GEOM = 3: the radius of the line of centroids is RB; v and the centre are on different sides of the chord
    GEOM = 4: the angle is THETAB; v and the centre are on different sides of the chord
    """
    a, b = (model.point(card, card.integer(k)) for k in (3, 4))
    word, kind = card.text(5), card.text(8)
    is_grid = word.isdigit() and not card.text(6) and not card.text(7)
    v = np.array([card.real(k, 0.0) for k in (5, 6, 7)]) if not is_grid else model.point(card, int(word)) - a
    v = v if is_grid else model.axes(card.integer(3)) @ v
    d = b - a
    L = float(np.linalg.norm(d))
    if not L > 0:
        return "has no length between its ends"
    along = d / L
    beside = v - (v @ along) * along
    if not np.linalg.norm(beside) > ALONG * np.linalg.norm(v):
        return "its vector is along the line of its ends, or missing"
    beside = beside / np.linalg.norm(beside)
    if kind == "1":
        if not abs(v @ d) > ALONG * np.linalg.norm(v) * L:
            return "GEOM = 1: its vector is across the line of its ends, where no centre of curvature lies"
        height = float((d @ d) / (2 * (v @ d)) * (v @ beside))  # of the centre above the chord, signed
        outward, half = -np.sign(height) * beside, float(np.arctan2(L / 2, abs(height)))
    elif kind == "2":
        outward, half = beside, float(np.arctan2(v @ beside, v @ along))
    elif kind == "3":
        radius = known.real(7, 0.0) - RC
        if not radius > L / 2 * (1 - ALONG):
            return f"GEOM = 3: RB - RC = {radius:g} is less than half of the distance of its ends"
        outward, half = beside, float(np.arcsin(min(L / 2 / radius, 1.0)))
    elif kind == "4":
        outward, half = beside, float(np.deg2rad(known.real(8, 0.0))) / 2
        if not 0 < half <= np.pi / 2:
            return f"GEOM = 4: expected THETAB between 0 and 180 degrees, got {known.text(8) or '(blank)'}"
    else:
        return f"GEOM = {kind or '(blank)'}: expected 1, 2, 3 or 4"
    if not LEAST_ANGLE <= 2 * half <= LARGEST_ANGLE:
        return f"its arc has an angle of {np.rad2deg(2 * half):.3g} degrees; expected 0.06 to 350"
    radius = L / 2 / np.sin(half)
    center = (a + b) / 2 - radius * np.cos(half) * outward
    return _Arc(center, float(radius), 2 * half, np.array([outward, along, np.cross(outward, along)]))


def _section(known: Card, R: float, nu: float) -> _Bend | str:
    """Return the section of a PBEND, or a text with the reason if it cannot be converted.

    An integer in the field of A is FSI: the section is a pipe with mean radius RM and thickness T, or a solid circle
    with radius RM if T is missing. For FSI = 1 the flexibility factor is 1.
    """
    if known.text(3).lstrip("+").isdigit():
        return _pipe(known, R, nu)
    A, I1, I2, J = (known.real(k, 0.0) for k in (3, 4, 5, 6))
    if not min(A, I1, I2, J) > 0:
        return f"A, I1, I2 and J must be above zero, got {A:g}, {I1:g}, {I2:g}, {J:g}"
    offset = I1 / (A * R)
    given = known.real(22, 0.0)
    if given and abs(given - offset) > SAME * offset:
        return f"DELTAN = {given:g}: only its default, I1/(A R) = {offset:g}"
    if not R > offset:
        return f"its radius {R:g} is not above the offset of its neutral axis, {offset:g}"
    K1, K2 = (known.real(k, 0.0) for k in (17, 18))
    return _Bend(A, I1, I2, J, (K1 * A or np.inf, K2 * A or np.inf), offset)


def _pipe(known: Card, R: float, nu: float) -> _Bend | str:
    """Return a pipe; its neutral axis is at R - A/∫ dA/r (Winkler's theory), with ∫ dA/r from both of its radii."""
    if known.integer(3) != 1:
        return f"FSI = {known.text(3)}: flexibility factors of pipes that flatten; only FSI = 1"
    RM, T = known.real(4), known.real(5, 0.0)
    outer, inner = (RM + T / 2, RM - T / 2) if T else (RM, 0.0)
    if not 0 <= inner < outer < R:
        return f"expected 0 <= T/2 <= RM and RM + T/2 below its radius {R:g}, got RM = {RM:g}, T = {T:g}"
    made = round_properties(outer, inner, nu)
    by_radius = 2 * np.pi * (np.sqrt(R**2 - inner**2) - np.sqrt(R**2 - outer**2))
    return _Bend(made.A, made.Iz, made.Iy, made.J, (made.A_sy, made.A_sz), float(R - made.A / by_radius))


def _flexibility(section: _Bend, E: float, G: float, R: float, angle: float) -> Array:
    """Return the (6, 6) flexibility: relative motion of the ends due to force and moment, at the middle of the arc.

    (1) At the angle phi, the directions r and t point outward and along the arc, and s is the position of the section.
        Force F and moment M at the middle cause N = t · F, V = r · F, V2 = z · F and
        T, M2, M1 = (t, r, z) · (M - s × F) in this section.
    (2) N and M1 act at the neutral axis of radius R_n = R - offset, where they are not coupled: their energy is
        (N² R_n/(E A) + M1² R/(E I1)) dphi/2. All others act at the centroid, on a length of R dphi.
    """
    x, weights = np.polynomial.legendre.leggauss(N_POINTS)
    C = np.zeros((6, 6))
    z = np.array([0.0, 0.0, 1.0])
    R_n = R - section.offset
    for phi, weight in zip(x * angle / 2, weights * angle / 2, strict=True):
        r, t = np.array([np.cos(phi), np.sin(phi), 0.0]), np.array([-np.sin(phi), np.cos(phi), 0.0])
        at, neutral = R * r - [R, 0.0, 0.0], R_n * r - [R, 0.0, 0.0]
        parts = [
            (np.concatenate([t, np.zeros(3)]), R_n / (E * section.A)),
            (np.concatenate([r, np.zeros(3)]), R / (G * section.shear[0])),
            (np.concatenate([z, np.zeros(3)]), R / (G * section.shear[1])),
            (np.concatenate([np.cross(at, t), t]), R / (G * section.J)),
            (np.concatenate([np.cross(at, r), r]), R / (E * section.I2)),
            (np.concatenate([np.cross(neutral, z), z]), R / (E * section.I1)),
        ]
        for row, flexibility in parts:
            C += weight * flexibility * np.outer(row, row)
    return C


def _half(
    model: NastranModel, card: Card, arc: _Arc, middle: Array, R: float, side: int, added: float, node: str
) -> DeckMass:
    """Return one half of the line of centroids as a rigid body: the half at end A (side -1) or at end B (1).

    The centroid of an arc with radius R and half angle b is at R sin(b)/b. The mean squares of the coordinates along
    its middle direction and normal to it, from the centre, are R² (1/2 ± sin(2 b)/(4 b)).
    """
    b = arc.angle / 4
    x, y, z = arc.axes
    outward, along = np.cos(b) * x + side * np.sin(b) * y, np.cos(b) * y - side * np.sin(b) * x
    place = R * np.sin(b) / b
    squares = R**2 * (0.5 + np.sin(2 * b) / (4 * b)) - place**2, R**2 * (0.5 - np.sin(2 * b) / (4 * b))
    mass = added * R * arc.angle / 2
    axes = np.array([outward, along, z])
    inertia = mass * axes.T @ np.diag([squares[1], squares[0], squares[0] + squares[1]]) @ axes
    at = middle - R * x + place * outward
    offset = at - model.point(card, card.integer(3 if side < 0 else 4))
    rows = tuple(_vector(row) for row in inertia)
    return DeckMass(node, mass, (rows[0], rows[1], rows[2]), _vector(offset))
