"""Cross-sections of Nastran bars and beams: PBAR, PBARL, PBEAM, PBEAML.

Element axes of Nastran: y lies in plane 1, z is normal to x and y. I1 = ∫ y² belongs to bending in plane 1, I2 = ∫ z²
to bending in plane 2, and I12 = ∫ y z.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.elements.beams.torsion import rectangle_torsion_constant
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.files.nastran.deck.model import NastranModel

__all__ = ["BarShape", "bar_shape"]

Rectangle = tuple[float, float, float, float]  #: width along z, height along y, and z and y of the centre
Cells = tuple[list[float], list[list[float]]]  #: enclosed areas of closed walls, and ∮ ds/t between them


@dataclass(frozen=True)
class BarShape:
    """Cross-section in the form of a table [sections.NAME] of a job."""

    keys: dict[str, Any]  #: shape and dimensions in principal axes
    added_mass: float = 0.0  #: additional mass per length without stiffness
    turn: float = 0.0  #: angle about x from the y axis of the element to the first principal axis [rad]
    #: position relative to the line of the ends, along y and z of the element
    centroid: tuple[float, float] = (0.0, 0.0)
    notes: tuple[str, ...] = ()
    has_torsion: bool = True  #: False: J = 0, and the torsion constant in `keys` is meaningless


def bar_shape(model: NastranModel, card: Card) -> BarShape | str:
    """Return the cross-section of a property, or a text with the reason if it cannot be converted."""
    makers: dict[str, Callable[[NastranModel, Card], BarShape | str]] = {
        "PBAR": _pbar, "PBEAM": _pbeam, "PBARL": _library, "PBEAML": _library,
    }  # fmt: skip
    return makers[card.name](model, card) if card.name in makers else f"is {card.name}"


def _general(
    A: float, I1: float, I2: float, I12: float, J: float, K1: float, K2: float, N: tuple[float, float] = (0.0, 0.0)
) -> tuple[dict[str, Any], float] | str:
    """Return the keys in principal axes, and their angle. A shear factor of 0 means no shear deformation.

    N is the position of the centroid relative to the shear centre, along y and z of the element. With
    tan 2a = 2 I12/(I1 - I2), I_a = (I1 + I2)/2 + hypot((I1 - I2)/2, I12) is the largest second moment.
    """
    if not (A > 0 and I1 > 0 and I2 > 0 and I1 * I2 > I12**2):
        return f"A, I1, I2 and I1 I2 - I12² must be above zero, got A = {A:g}, I1 = {I1:g}, I2 = {I2:g}, I12 = {I12:g}"
    if not J > 0:
        return f"J = {J:g}: below zero"
    turn = 0.0
    if I12 != 0.0:
        turn = 0.5 * float(np.arctan2(2 * I12, I1 - I2))
        mean, radius = (I1 + I2) / 2, float(np.hypot((I1 - I2) / 2, I12))
        I1, I2, K1, K2 = mean + radius, mean - radius, 0.0, 0.0  # Nastran drops K1 and K2 where I12 is given
    made: dict[str, Any] = {"shape": "general", "area": A, "iy": I2, "iz": I1, "torsion": J}
    if any(N):  # the shear centre from the centroid, in principal axes
        c, s = float(np.cos(turn)), float(np.sin(turn))
        made["shear_center"] = [-c * N[0] - s * N[1], s * N[0] - c * N[1]]
    made |= {"shear_area_y": K1 * A} if K1 else {}
    made |= {"shear_area_z": K2 * A} if K2 else {}
    return made, turn


def _pbar(model: NastranModel, card: Card) -> BarShape | str:
    A, I1, I2, J = (card.real(k, 0.0) for k in (3, 4, 5, 6))
    made = _general(A, I1, I2, card.real(19, 0.0), J or I1 + I2, card.real(17, 0.0), card.real(18, 0.0))
    if isinstance(made, str):
        return made
    return BarShape(made[0], card.real(7, 0.0) * model.wtmass, made[1], has_torsion=J != 0)


def _pbeam(model: NastranModel, card: Card) -> BarShape | str:
    """Read a PBEAM with one section along its length; `cut_tapers` has removed its stations.

    (1) A, I1, I2, I12, J, NSM; four stress points
    (2) K1, K2 (default 1), shear relief, inertia of the added mass, warping; offset of the added mass; offset N1, N2 of
        the centroid from the line of the ends, on which the shear centres lie
    """
    A, I1, I2, I12, J = (card.real(k, 0.0) for k in (3, 4, 5, 6, 7))
    at = 17
    tail = [card.real(at + k, 0.0) for k in range(16)]  # (2)
    K1, K2 = (tail[k] if card.text(at + k) else 1.0 for k in (0, 1))
    S1, S2, NSI_A, NSI_B, CW_A, CW_B = tail[2:8]
    M1_A, M2_A, M1_B, M2_B = tail[8:12]
    N_A = (tail[12], tail[13])
    N_B = tuple(tail[14 + k] if card.text(at + 14 + k) else N_A[k] for k in (0, 1))
    has_no_mass = card.real(8, 0.0) == 0.0
    if S1 or S2:
        return "shear relief of a taper (S1, S2)"
    if NSI_A or NSI_B or (not has_no_mass and (M1_A or M2_A or M1_B or M2_B)):
        return "added mass off the axis, or with inertia of its own (NSI, M1, M2)"
    if N_A != N_B:
        return "another offset of the neutral axis at end B than at end A (N1, N2)"
    made = _general(A, I1, I2, I12, J or I1 + I2, K1, K2, N_A)
    if isinstance(made, str):
        return made
    notes = ("warping of the section (CW) is left out",) if CW_A or CW_B else ()
    return BarShape(made[0], card.real(8, 0.0) * model.wtmass, made[1], N_A, notes, has_torsion=J != 0)


def _library(model: NastranModel, card: Card) -> BarShape | str:
    """Read a section by name; in Nastran its height is along y, and its width along z."""
    name = card.text(4).upper()
    if name not in DIMENSIONS:
        return f"shape {name or '(blank)'}: expected one of {', '.join(DIMENSIONS)}"
    n = DIMENSIONS[name]
    d = [card.real(9 + k, 0.0) for k in range(n)]
    if not all(value > 0 for value in d):
        return f"shape {name}: expected {n} dimensions above zero, got {', '.join(f'{value:g}' for value in d)}"
    if card.name == "PBEAML" and any(card.fields[9 + n :]):
        return f"shape {name}: stations that cannot be understood (SO, X/XB)"
    added = card.real(9 + n, 0.0) * model.wtmass
    if name in PLAIN:
        return BarShape(PLAIN[name](d), added)
    N = (0.0, 0.0)
    if card.name == "PBEAML" and name not in ("CROSS", "H", "I1", "HEXA", "Z"):
        if name not in SHEAR_CENTRES:
            return f"shape {name} of PBEAML: the offset of its shear centre is not known here; give it as PBEAM"
        N = SHEAR_CENTRES[name](*d)
    made = _from_rectangles(*RECTANGLES[name](*d)) if name in RECTANGLES else _hexagon(*d)
    if made is None:
        return f"shape {name}: its dimensions leave walls of no thickness: {', '.join(f'{value:g}' for value in d)}"
    A, I1, I2, I12, J = made
    general = _general(A, I1, I2, I12, J, 0.0, 0.0, N)
    if isinstance(general, str):
        return f"shape {name}: {general}"
    note = f"shape {name}: J as the sum of its rectangles, or of its closed walls; without shear deformation"
    return BarShape(general[0], added, general[1], N, (note,))


def _from_rectangles(
    parts: list[Rectangle], cells: Cells | None = None
) -> tuple[float, float, float, float, float] | None:
    """Return A, I1, I2, I12, J of rectangles that do not overlap.

    `cells` contains, for closed walls, the areas A_k that their middle lines enclose, and the matrix F: F_kk = ∮ ds/t
    of a cell, F_kl = -∫ ds/t of the wall between two cells. Bredt's flows q = 2 F⁻¹ A give J = 2 A · q. For an open
    section, `cells` is None.
    """
    if any(b <= 0 or h <= 0 for b, h, _, _ in parts):
        return None
    areas = np.array([b * h for b, h, _, _ in parts])
    z, y = (np.array([part[k] for part in parts]) for k in (2, 3))
    z, y = z - areas @ z / areas.sum(), y - areas @ y / areas.sum()
    I1 = sum(b * h**3 / 12 for b, h, _, _ in parts) + float(areas @ y**2)
    I2 = sum(h * b**3 / 12 for b, h, _, _ in parts) + float(areas @ z**2)
    I12 = float(areas @ (y * z))
    J = sum(rectangle_torsion_constant(b, h) for b, h, _, _ in parts)
    if cells is not None:
        enclosed = np.array(cells[0])
        J = float(4 * enclosed @ np.linalg.solve(np.array(cells[1]), enclosed))
    has_product = abs(I12) > 1e-12 * (I1 + I2)  # else the rounding of a symmetric shape
    return float(areas.sum()), I1, I2, I12 if has_product else 0.0, J


def _hexagon(d1: float, d2: float, d3: float) -> tuple[float, float, float, float, float] | None:
    """Return HEXA: width d2 from tip to tip, height d3, tips d1 deep; J = A⁴/(4 pi² I_p) by Saint-Venant."""
    flat = d2 - 2 * d1
    if flat < 0:
        return None
    A = d3 * (d2 - d1)
    I1 = flat * d3**3 / 12 + 4 * d1 * (d3 / 2) ** 3 / 12
    I2 = d3 * flat**3 / 12 + 4 * (d3 / 2 * d1**3 / 36 + d3 / 2 * d1 / 2 * (flat / 2 + d1 / 3) ** 2)
    return A, I1, I2, 0.0, A**4 / (4 * np.pi**2 * (I1 + I2))


def _i(h: float, b1: float, b2: float, t_w: float, t1: float, t2: float) -> tuple[list[Rectangle]]:
    return ([(b1, t1, 0, t1 / 2), (t_w, h - t1 - t2, 0, t1 + (h - t1 - t2) / 2), (b2, t2, 0, h - t2 / 2)],)


def _hat(h: float, t: float, b: float, brim: float) -> tuple[list[Rectangle]]:
    walls = [(t, h - t, side * (b - t) / 2, (h - t) / 2) for side in (-1, 1)]
    brims = [(brim, t, side * (b + brim) / 2, t / 2) for side in (-1, 1)]
    return ([(b, t, 0, h - t / 2), *walls, *brims],)


def _box1(b: float, h: float, top: float, bottom: float, left: float, right: float) -> tuple[list[Rectangle], Any]:
    high = h - top - bottom
    parts = [
        (b, top, 0, h - top / 2), (b, bottom, 0, bottom / 2),
        (left, high, (left - b) / 2, bottom + high / 2), (right, high, (b - right) / 2, bottom + high / 2),
    ]  # fmt: skip
    w, d = b - (left + right) / 2, h - (top + bottom) / 2
    return parts, ([w * d], [[w / top + w / bottom + d / left + d / right]])


def _dbox(
    b: float, h: float, middle: float, left: float, web: float, right: float, t1: float, t2: float, t3: float, t4: float
) -> tuple[list[Rectangle], Any]:
    """Return two adjacent cells with a web between them, tops t1 and t3, bottoms t2 and t4."""
    w1, w2 = middle - web / 2 - left, b - middle - web / 2 - right
    z1, z2 = left + w1 / 2, b - right - w2 / 2
    parts = [
        (left, h, left / 2, h / 2), (web, h, middle, h / 2), (right, h, b - right / 2, h / 2),
        (w1, t1, z1, h - t1 / 2), (w1, t2, z1, t2 / 2), (w2, t3, z2, h - t3 / 2), (w2, t4, z2, t4 / 2),
    ]  # fmt: skip
    if min(w1, w2) <= 0:
        return parts, None
    c1, c2 = middle - left / 2, b - middle - right / 2  # by the middle lines of the upright walls
    d1, d2 = h - (t1 + t2) / 2, h - (t3 + t4) / 2
    shared = (d1 + d2) / 2 / web
    F = [
        [c1 / t1 + c1 / t2 + d1 / left + shared, -shared],
        [-shared, c2 / t3 + c2 / t4 + d2 / right + shared],
    ]
    return parts, ([c1 * d1, c2 * d2], F)


def _hat1(b: float, h: float, top: float, t: float, t_plate: float) -> tuple[list[Rectangle], Any]:
    """Return a hat section that is closed by a plate below."""
    brim, high = (b - top) / 2, h - t_plate - t
    parts: list[Rectangle] = [(b, t_plate, 0, t_plate / 2), (top, t, 0, h - t / 2)]
    parts += [(t, high, side * (top - t) / 2, t_plate + high / 2) for side in (-1, 1)]
    parts += [(brim, t, side * (top + brim) / 2, t_plate + t / 2) for side in (-1, 1) if brim > 0]
    w, d = top - t, h - t / 2 - t_plate / 2
    return parts, ([w * d], [[w / t + w / t_plate + 2 * d / t]])


def _channel_centre(b: float, h: float, t_w: float, t_f: float) -> float:
    """Return the distance of the centroid of a channel from its shear centre, towards its flanges.

    With the lengths b and h of the middle lines, the shear centre lies 3 b² t_f/(6 b t_f + h t_w) behind the web.
    """
    b, h_w, h = b - t_w / 2, h - 2 * t_f, h - t_f
    width = b - t_w / 2  # width of a flange without the web
    area = 2 * width * t_f + (h_w + 2 * t_f) * t_w
    return 2 * width * t_f * (width + t_w) / 2 / area + 3 * b**2 * t_f / (6 * b * t_f + h * t_w)


def _tee_centre(b: float, h: float, t_f: float, t_w: float) -> float:
    """Return the distance of the centroid of a T from its shear centre (middle of the flange), towards the web."""
    web = (h - t_f) * t_w
    return web * h / 2 / (web + b * t_f)


def _i_centre(h: float, b1: float, b2: float, t_w: float, t1: float, t2: float) -> float:
    """Return the distance of the centroid of an I above its shear centre.

    The flanges share the shear force in proportion to their second moments I_1 (below) and I_2.
    """
    web, between = h - t1 - t2, h - (t1 + t2) / 2
    centroid = (web * t_w * (web + t1) / 2 + between * t2 * b2) / (web * t_w + t1 * b1 + t2 * b2)
    return centroid - between * t2 * b2**3 / (t1 * b1**3 + t2 * b2**3)


def _angle_centre(b: float, h: float, t1: float, t2: float) -> tuple[float, float]:
    """Return the centroid of an L relative to its shear centre (crossing of middle lines), along y and z."""
    upright, level = (h - t1) * t2, (b - t2) * t1
    area = upright + level + t1 * t2
    return upright * h / 2 / area, level * b / 2 / area


DIMENSIONS = {
    "ROD": 1, "TUBE": 2, "TUBE2": 2, "BAR": 2, "BOX": 4, "I": 6, "CHAN": 4, "T": 4, "CROSS": 4, "H": 4, "T1": 4,
    "I1": 4, "CHAN1": 4, "CHAN2": 4, "T2": 4, "BOX1": 6, "HEXA": 3, "HAT": 4, "Z": 4, "L": 4, "HAT1": 5, "DBOX": 10,
}  #: number of dimensions of each shape  # fmt: skip
PLAIN: dict[str, Callable[[list[float]], dict[str, Any]]] = {
    "ROD": lambda d: {"shape": "circle", "radius": d[0]},
    "TUBE": lambda d: {"shape": "tube", "radius": d[0], "thickness": d[0] - d[1]},
    "TUBE2": lambda d: {"shape": "tube", "radius": d[0], "thickness": d[1]},
    "BAR": lambda d: {"shape": "rectangle", "width": d[1], "height": d[0]},
    "BOX": lambda d: {"shape": "box", "width": d[1], "height": d[0], "web": d[2], "flange": d[3]},
}  #: shapes with a name in job files
RECTANGLES: dict[str, Callable[..., Any]] = {
    "I": _i,
    "I1": lambda d1, d2, d3, d4: _i(d4, d1 + d2, d1 + d2, d2, (d4 - d3) / 2, (d4 - d3) / 2),
    "CHAN": lambda b, h, t_w, t_f: (
        [(t_w, h, t_w / 2, h / 2), *((b - t_w, t_f, (b + t_w) / 2, y) for y in (t_f / 2, h - t_f / 2))],
    ),
    "CHAN1": lambda d1, d2, d3, d4: (
        [
            (d2, d4, d2 / 2, d4 / 2),
            *((d1, (d4 - d3) / 2, d2 + d1 / 2, side * (d4 + d3) / 4 + d4 / 2) for side in (-1, 1)),
        ],
    ),
    "CHAN2": lambda t, bottom, h, b: (
        [(b - 2 * t, bottom, 0, bottom / 2), *((t, h, side * (b - t) / 2, h / 2) for side in (-1, 1))],
    ),
    "T": lambda b, h, t_f, t_w: ([(b, t_f, 0, h - t_f / 2), (t_w, h - t_f, 0, (h - t_f) / 2)],),
    "T2": lambda b, h, t_f, t_w: ([(b, t_f, 0, t_f / 2), (t_w, h - t_f, 0, t_f + (h - t_f) / 2)],),
    "T1": lambda h, b, t_f, t_w: ([(t_f, h, 0, 0), (b, t_w, -(b + t_f) / 2, 0)],),
    "CROSS": lambda arms, t_w, h, t_arm: (
        [(t_w, h, 0, 0), *((arms / 2, t_arm, side * (t_w + arms / 2) / 2, 0) for side in (-1, 1))],
    ),
    "H": lambda web, flanges, h, t_w: (
        [(web, t_w, 0, 0), *((flanges / 2, h, side * (web + flanges / 2) / 2, 0) for side in (-1, 1))],
    ),
    "Z": lambda b, t_w, inner, h: (
        [
            (t_w, h, 0, h / 2),
            *((b, (h - inner) / 2, side * (b + t_w) / 2, h / 2 - side * (h + inner) / 4) for side in (-1, 1)),
        ],
    ),
    "L": lambda b, h, t1, t2: ([(b, t1, b / 2, t1 / 2), (t2, h - t1, t2 / 2, (h + t1) / 2)],),
    "BOX1": _box1,
    "HAT": _hat,
    "HAT1": _hat1,
    "DBOX": _dbox,
}  # fmt: skip
"""Shape -> its rectangles by its dimensions DIM1, DIM2, ..."""
SHEAR_CENTRES: dict[str, Callable[..., tuple[float, float]]] = {
    "I": lambda *d: (_i_centre(*d), 0.0),
    "T": lambda *d: (-_tee_centre(*d), 0.0),
    "T2": lambda *d: (_tee_centre(*d), 0.0),
    "T1": lambda h, b, t_f, t_w: (0.0, -_tee_centre(h, b + t_f, t_f, t_w)),
    "CHAN": lambda *d: (0.0, _channel_centre(*d)),
    "CHAN1": lambda d1, d2, d3, d4: (0.0, _channel_centre(d1 + d2, d4, d2, (d4 - d3) / 2)),
    "CHAN2": lambda t, bottom, h, b: (_channel_centre(h, b, bottom, t), 0.0),
    "L": _angle_centre,
}
"""Shape -> position of the centroid relative to the shear centre along y and z, for thin walls (ends of PBEAML)"""
