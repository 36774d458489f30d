"""Cross-sections of Nastran's bars and beams: PBAR, PBARL, PBEAM, PBEAML.

Element axes of Nastran: y lies in plane 1, z completes it. I1 = ∫ y² bends in plane 1, I2 = ∫ z² in plane 2, and
I12 = ∫ y z.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from fe_models.beams.torsion import rectangle_torsion_constant
from fe_models.importers.bulk_data.cards import Card
from fe_models.importers.decks.nastran.model import NastranModel

__all__ = ["BarShape", "bar_shape"]

Rectangle = tuple[float, float, float, float]  #: width along z, height along y, z and y of its centre


@dataclass(frozen=True)
class BarShape:
    """A cross-section, as a table [sections.NAME] of a job has it."""

    keys: dict[str, Any]  #: shape and its dimensions, in principal axes
    added_mass: float = 0.0  #: per length, without stiffness
    turn: float = 0.0  #: angle from the element's y axis to the first principal axis, about x [rad]
    centroid: tuple[float, float] = (0.0, 0.0)  #: from the line of the ends, along the element's y and z
    notes: tuple[str, ...] = ()


def bar_shape(model: NastranModel, card: Card) -> BarShape | str:
    """Return the cross-section of a property; a text says why it cannot be taken."""
    makers: dict[str, Callable[[NastranModel, Card], BarShape | str]] = {
        "PBAR": _pbar, "PBEAM": _pbeam, "PBARL": _library, "PBEAML": _library,
    }  # fmt: skip
    return makers[card.name](model, card) if card.name in makers else f"is {card.name}"


def _general(
    A: float, I1: float, I2: float, I12: float, J: float, K1: float, K2: float, **keys: Any
) -> tuple[dict[str, Any], float] | str:
    """Return the keys in principal axes and their turn. A shear factor of 0 means no shear deformation in its plane.

    With tan 2a = 2 I12/(I1 - I2), I_a = (I1 + I2)/2 + hypot((I1 - I2)/2, I12) is the largest second moment, of y².
    """
    if not (A > 0 and I1 > 0 and I2 > 0 and I1 * I2 > I12**2):
        return f"A, I1, I2 and I1 I2 - I12² must be above zero, got A = {A:g}, I1 = {I1:g}, I2 = {I2:g}, I12 = {I12:g}"
    if not J > 0:
        return "J = 0: a beam without stiffness in torsion"
    turn = 0.0
    if I12 != 0.0:
        turn = 0.5 * float(np.arctan2(2 * I12, I1 - I2))
        mean, radius = (I1 + I2) / 2, float(np.hypot((I1 - I2) / 2, I12))
        I1, I2, K1, K2 = mean + radius, mean - radius, 0.0, 0.0  # Nastran drops K1 and K2 where I12 is given
    made: dict[str, Any] = {"shape": "general", "area": A, "iy": I2, "iz": I1, "torsion": J, **keys}
    made |= {"shear_area_y": K1 * A} if K1 else {}
    made |= {"shear_area_z": K2 * A} if K2 else {}
    return made, turn


def _pbar(model: NastranModel, card: Card) -> BarShape | str:
    A, I1, I2, J = (card.real(k, 0.0) for k in (3, 4, 5, 6))
    made = _general(A, I1, I2, card.real(19, 0.0), J, card.real(17, 0.0), card.real(18, 0.0))
    return made if isinstance(made, str) else BarShape(made[0], card.real(7, 0.0) * model.wtmass, made[1])


def _pbeam(model: NastranModel, card: Card) -> BarShape | str:
    """A beam of one section along its length.

    (1) A, I1, I2, I12, J, NSM at end A; four stress points, which may be left out
    (2) stations: SO, X/XB, A, ..., NSM, with stress points unless SO is NO or YESA; blanks have the values of end A
    (3) K1, K2 (default 1), shear relief, inertia of the added mass, warping; its offset; offset N1, N2 of the centroid
        from the line of the ends, which is that of the shear centres
    """
    A, I1, I2, I12, J = (card.real(k, 0.0) for k in (3, 4, 5, 6, 7))
    base = [card.real(j, 0.0) for j in (3, 4, 5, 6, 7, 8)]
    at = 9 if card.text(9).upper() in ("YES", "YESA", "NO") else 17
    while card.text(at).upper() in ("YES", "YESA", "NO"):  # (2)
        for j, was in zip(range(2, 8), base, strict=True):
            if card.text(at + j) and card.real(at + j) != was:
                return f"tapers: at X/XB = {card.text(at + 1) or '1.'} its section is another; make it of several beams"
        at += 16 if card.text(at).upper() == "YES" else 8
    tail = [card.real(at + k, 0.0) for k in range(16)]  # (3)
    K1, K2 = (tail[k] if card.text(at + k) else 1.0 for k in (0, 1))
    S1, S2, NSI_A, NSI_B, CW_A, CW_B = tail[2:8]
    M1_A, M2_A, M1_B, M2_B = tail[8:12]
    N_A = (tail[12], tail[13])
    N_B = tuple(tail[14 + k] if card.text(at + 14 + k) else N_A[k] for k in (0, 1))
    has_no_mass = base[5] == 0.0
    if S1 or S2:
        return "shear relief of a taper (S1, S2)"
    if NSI_A or NSI_B or (not has_no_mass and (M1_A or M2_A or M1_B or M2_B)):
        return "added mass off the axis, or with inertia of its own (NSI, M1, M2)"
    if N_A != N_B:
        return "another offset of the neutral axis at end B than at end A (N1, N2)"
    if any(N_A) and I12 != 0.0:
        return "an offset of the neutral axis with I12"
    keys = {"shear_center": [-N_A[0], -N_A[1]]} if any(N_A) else {}
    made = _general(A, I1, I2, I12, J, K1, K2, **keys)
    if isinstance(made, str):
        return made
    notes = ("warping of the section (CW) is left out",) if CW_A or CW_B else ()
    return BarShape(made[0], card.real(8, 0.0) * model.wtmass, made[1], N_A, notes)


def _library(model: NastranModel, card: Card) -> BarShape | str:
    """Sections by name; Nastran's height is along y, its width along z."""
    name = card.text(4).upper()
    if name not in DIMENSIONS:
        return f"shape {name or '(blank)'}: expected one of {', '.join(DIMENSIONS)}"
    n = DIMENSIONS[name]
    d = [card.real(9 + k, 0.0) for k in range(n)]
    if not all(value > 0 for value in d):
        return f"shape {name}: expected {n} dimensions above zero, got {', '.join(f'{value:g}' for value in d)}"
    if card.name == "PBEAML" and any(card.fields[9 + n :]):
        return f"shape {name}: stations (SO, X/XB): it may taper; make it of several beams"
    added = card.real(9 + n, 0.0) * model.wtmass
    if name in PLAIN:
        return BarShape(PLAIN[name](d), added)
    if card.name == "PBEAML" and name not in ("CROSS", "H", "I1", "HEXA"):
        return f"shape {name} of PBEAML: the offset of its shear centre is not known here; give it as PBEAM"
    made = _from_rectangles(*RECTANGLES[name](*d)) if name in RECTANGLES else _hexagon(*d)
    if made is None:
        return f"shape {name}: its dimensions leave walls of no thickness: {', '.join(f'{value:g}' for value in d)}"
    A, I1, I2, J = made
    general = _general(A, I1, I2, 0.0, J, 0.0, 0.0)
    if isinstance(general, str):
        return f"shape {name}: {general}"
    note = f"shape {name}: J as the sum of its rectangles, or of its closed wall; without shear deformation"
    return BarShape(general[0], added, notes=(note,))


def _from_rectangles(
    parts: list[Rectangle], cell: tuple[float, float] | None = None
) -> tuple[float, float, float, float] | None:
    """Return A, I1, I2, J of rectangles that do not overlap.

    cell: of a closed wall, the area that it encloses and ∮ ds/t, both by its middle line; None: an open section.
    """
    if any(b <= 0 or h <= 0 for b, h, _, _ in parts):
        return None
    areas = np.array([b * h for b, h, _, _ in parts])
    z, y = (np.array([part[k] for part in parts]) for k in (2, 3))
    z, y = z - areas @ z / areas.sum(), y - areas @ y / areas.sum()
    I1 = sum(b * h**3 / 12 for b, h, _, _ in parts) + float(areas @ y**2)
    I2 = sum(h * b**3 / 12 for b, h, _, _ in parts) + float(areas @ z**2)
    J = sum(rectangle_torsion_constant(b, h) for b, h, _, _ in parts)
    if cell is not None:
        J = 4 * cell[0] ** 2 / cell[1]  # Bredt
    return float(areas.sum()), I1, I2, J


def _hexagon(d1: float, d2: float, d3: float) -> tuple[float, float, float, float] | None:
    """HEXA: width d2 from tip to tip, height d3, tips d1 deep; J as Saint-Venant's A⁴/(4 pi² I_p)."""
    flat = d2 - 2 * d1
    if flat < 0:
        return None
    A = d3 * (d2 - d1)
    I1 = flat * d3**3 / 12 + 4 * d1 * (d3 / 2) ** 3 / 12
    I2 = d3 * flat**3 / 12 + 4 * (d3 / 2 * d1**3 / 36 + d3 / 2 * d1 / 2 * (flat / 2 + d1 / 3) ** 2)
    return A, I1, I2, A**4 / (4 * np.pi**2 * (I1 + I2))


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
    return parts, (w * d, w / top + w / bottom + d / left + d / right)


DIMENSIONS = {
    "ROD": 1, "TUBE": 2, "TUBE2": 2, "BAR": 2, "BOX": 4, "I": 6, "CHAN": 4, "T": 4, "CROSS": 4, "H": 4, "T1": 4,
    "I1": 4, "CHAN1": 4, "CHAN2": 4, "T2": 4, "BOX1": 6, "HEXA": 3, "HAT": 4,
}  #: shape -> number of its dimensions  # fmt: skip
PLAIN: dict[str, Callable[[list[float]], dict[str, Any]]] = {
    "ROD": lambda d: {"shape": "circle", "radius": d[0]},
    "TUBE": lambda d: {"shape": "tube", "radius": d[0], "thickness": d[0] - d[1]},
    "TUBE2": lambda d: {"shape": "tube", "radius": d[0], "thickness": d[1]},
    "BAR": lambda d: {"shape": "rectangle", "width": d[1], "height": d[0]},
    "BOX": lambda d: {"shape": "box", "width": d[1], "height": d[0], "web": d[2], "flange": d[3]},
}  #: shapes that a job has by name
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
    "BOX1": _box1,
    "HAT": _hat,
}  # fmt: skip
"""Shape -> its rectangles by its dimensions DIM1, DIM2, ..."""
