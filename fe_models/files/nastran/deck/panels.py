"""Shear panels of Nastran (CSHEAR with PSHEAR): Garvey's panel, and rods along its edges."""

import numpy as np

from fe_models.assembly.constraints import weighted_motion
from fe_models.files.decks.deck import DeckMass, DeckSpring, as_triad, axes_along
from fe_models.files.decks.equations import Row
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.files.nastran.deck.model import ALL, NastranModel
from fe_models.foundation.arrays import Array

__all__ = ["read_panels"]

FULL = 1.01  #: effectiveness above which F1 and F2 are widths as multiples of the thickness
N_POINTS = 20  #: number of Gauss points along each side; the integrand is a rational function


def read_panels(model: NastranModel) -> None:
    """Convert each CSHEAR.

    (1) The panel has one state of stress, a shear flow along its edges, with the energy U and the forces f at the
        corners (`shear_flow`). The stiffness is that of this state, K = f fᵀ/(2 U).
    (2) Two massless points are added in the middle of the panel. Both have the mean motion of the corners. The second
        one also moves by n · u along x, with n = f/|f|. A spring of stiffness |f|²/(2 U) acts between them.
    (3) Each edge has a rod with the area F T S/(L + L'), where S is the area of the panel and L, L' are the lengths of
        this edge and the opposite one. If F is above 1.01, the area is F T²/2.
    (4) Each corner has the mass (rho T + NSM) (S_i + S)/6, where S_i is the area of the triangle at the corner, as in
        NASTRAN-95, mis/masstq.f.
    """
    cards = model.of("CSHEAR")
    words = [word.upper() for card in model.of("MDLPRM") for word in card.fields]
    if cards and "HARDER" in words:
        model.ledger.refuse("CSHEAR", "MDLPRM, SHEARP, HARDER: only Garvey's panel", count=len(cards))
        return
    for card in cards:
        why = _panel(model, card)
        if why:
            model.ledger.refuse("CSHEAR", why)


def _panel(model: NastranModel, card: Card) -> str:
    """Add a panel; return a text with the reason if it cannot be converted."""
    known = model.property_of(card, "PSHEAR")
    if known is None:
        return f"names PSHEAR {card.text(2) or card.text(1)}, which is not defined"
    name, T = known.text(2), known.real(3)
    material = model.materials.get(name)
    if material is None or not isinstance(material.young, float) or not isinstance(material.poisson, float):
        return f"material {name} is not known here, or not isotropic"
    factors = [known.real(k, 0.0) for k in (5, 6)]
    if not T > 0 or min(factors) < 0:
        return f"PSHEAR {known.text(1)}: T must be above zero, F1 and F2 must not be below zero"
    grids = [card.integer(k) for k in (3, 4, 5, 6)]
    corners = np.array([model.point(card, grid) for grid in grids])
    flat = _flat(corners)
    if flat is None:
        return "its corners make no convex quadrilateral"
    plane, axes = flat
    forces, energy = shear_flow(plane, material.poisson)
    f = forces @ axes
    size = float(np.linalg.norm(f))
    _strain_spring(model, card, grids, corners, f / size, size**2 * model.shear_modulus(name) * T / (2 * energy))  # (1)
    S = _area(plane)
    lengths = [float(np.linalg.norm(corners[k] - corners[k - 3])) for k in range(4)]  # of edges 12, 23, 34, 41
    for k in range(4):
        F = factors[k % 2]
        A = F * T * S / (lengths[k] + lengths[k - 2]) if F <= FULL else F * T**2 / 2  # (3)
        if A:
            ends = [model.group(card, [grids[k]]), model.group(card, [grids[k - 3]])]
            along = as_triad(axes_along(corners[k - 3] - corners[k]))
            stiffness = (material.young * A / lengths[k], 0.0, 0.0, 0.0, 0.0, 0.0)
            model.springs.append(DeckSpring((ends[0], ends[1]), stiffness, triad=along))
    added = (material.density or 0.0) * T + known.real(4, 0.0) * model.wtmass
    for k in range(4):  # (4); a mass of zero too, so that the corners have dofs
        mass = added * (_area(plane[[k - 1, k, k - 3]]) + S) / 6
        model.masses.append(DeckMass(model.group(card, [grids[k]]), mass))
    why = "Garvey's panel as a spring between two points of its mean motion, rods by F1 and F2, its mass at the corners"
    model.ledger.note("CSHEAR", why)
    return ""


def _flat(corners: Array) -> tuple[Array, Array] | None:
    """Return the corners in their mean plane, (4, 2), and the axes of the plane, (2, 3); None if not convex."""
    normal = np.cross(corners[2] - corners[0], corners[3] - corners[1])
    x = corners[1] - corners[0]
    size = np.linalg.norm(normal)
    if not size > 0:
        return None
    normal = normal / size
    x = x - (x @ normal) * normal
    if not np.linalg.norm(x) > 0:
        return None
    x = x / np.linalg.norm(x)
    axes = np.array([x, np.cross(normal, x)])
    plane = (corners - corners[0]) @ axes.T
    turns = [_cross(plane[k - 3] - plane[k], plane[k - 2] - plane[k - 3]) for k in range(4)]
    return (plane, axes) if min(turns) > 0 else None


def _cross(a: Array, b: Array) -> float:
    return float(a[0] * b[1] - a[1] * b[0])


def _area(points: Array) -> float:
    return sum(_cross(points[k - 1], points[k]) for k in range(len(points))) / 2


def shear_flow(corners: Array, nu: float) -> tuple[Array, float]:
    """Return the corner forces of a flat panel in shear flow, (4, 2), and its energy times G T.

    (1) X = (a + b r + c s)/w, w = 1 + g r + h s, maps the unit square to the panel. Lines of constant r or s are
        straight and meet where opposite edges meet. The tangents are X_r = (b - g X)/w and X_s = (c - h X)/w;
        J = det(X_r, X_s).
    (2) The stress times T is q (X_r ⊗ X_s + X_s ⊗ X_r), without normal stress on all these lines. It is in equilibrium
        if J q = w², because X_rs = -(g X_s + h X_r)/w.
    (3) U = 1/(2 G T) ∫ w⁴ (J + 2 (X_r · X_s)²/((1 + nu) J)) dr ds
    (4) An edge of constant s carries the force ∫ w² X_r dr = b w - g (a + b r + c s), which is the same for all r. Half
        of it acts at each end. U and f are those of NASTRAN-95, mis/kpanel.f, for panels of all shapes, but without its
        tolerance for nearly parallel edges.
    """
    a, d_1, d_2 = corners[0], corners[1] - corners[2], corners[3] - corners[2]
    odd = corners[0] - corners[1] + corners[2] - corners[3]
    g, h = _cross(odd, d_2) / _cross(d_1, d_2), _cross(d_1, odd) / _cross(d_1, d_2)  # (1)
    b, c = corners[1] - a + g * corners[1], corners[3] - a + h * corners[3]
    x, weights = np.polynomial.legendre.leggauss(N_POINTS)
    r, s = np.meshgrid((x + 1) / 2, (x + 1) / 2)
    w = 1 + g * r + h * s
    X = [(a[k] + b[k] * r + c[k] * s) / w for k in (0, 1)]
    X_r, X_s = ([(side[k] - factor * X[k]) / w for k in (0, 1)] for side, factor in ((b, g), (c, h)))
    J = X_r[0] * X_s[1] - X_r[1] * X_s[0]
    product = X_r[0] * X_s[0] + X_r[1] * X_s[1]
    energy = float(weights @ (w**4 * (J + 2 * product**2 / ((1 + nu) * J))) @ weights) / 8  # (3)
    below, above = b - g * a, b * (1 + h) - g * (a + c)  # (4)
    left, right = c - h * a, c * (1 + g) - h * (a + b)
    return np.array([-below - left, right - below, right + above, above - left]) / 2, energy


def _strain_spring(
    model: NastranModel, card: Card, grids: list[int], corners: Array, n: Array, stiffness: float
) -> None:
    """Step (2) of `read_panels`: add two points and the spring between them; n has the shape (4, 3)."""
    middle = corners.mean(axis=0)
    weights = np.tile([1.0, 1.0, 1.0, 0.0, 0.0, 0.0], (4, 1))
    mean = weighted_motion(corners, weights, middle).reshape(6, 4, 6)[:, :, :3]
    points = [model.new_point(middle), model.new_point(middle)]
    for k, point in enumerate(points):
        for component in ALL:
            part = mean[component] + (n if k and component == 0 else 0.0)
            row: Row = {(point, component): 1.0}
            row |= {(grid, i): -float(part[j, i]) for j, grid in enumerate(grids) for i in range(3)}
            model.plain_rows.append(row)
    names = [model.group(card, [point]) for point in points]
    model.springs.append(DeckSpring((names[0], names[1]), (stiffness, 0.0, 0.0, 0.0, 0.0, 0.0)))
