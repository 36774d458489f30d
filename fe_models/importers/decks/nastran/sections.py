"""Materials, properties and elements of Nastran: solids, shells, bars, beams and rods."""

from collections.abc import Callable
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.importers.bulk_data.cards import Card
from fe_models.importers.decks.deck import DeckMass, DeckMaterial, DeckSpring, LineSection, ShellSection, SolidSection
from fe_models.importers.decks.nastran.layups import layered_shells, sheet_material
from fe_models.importers.decks.nastran.model import NastranModel

__all__ = ["BARS", "SHELLS", "SOLIDS", "read_sections"]

SOLIDS = ("CTETRA", "CHEXA", "CPENTA", "CPYRAM", "CPYRA")
SHELLS = ("CTRIA3", "CTRIAR", "CTRIA6", "CQUAD4", "CQUADR", "CQUAD8")
BARS = ("CBAR", "CBEAM")
_OFFSET_FIELD = {"CTRIA3": 7, "CTRIAR": 7, "CTRIA6": 10, "CQUAD4": 8, "CQUADR": 8, "CQUAD8": 16}
_THICKNESS_FIELDS = (11, 12, 13, 14)  #: T1 to T4


def read_sections(model: NastranModel) -> None:
    """Take materials, then every kind of element with its property."""
    for card in model.of("MAT1"):
        _material(model, card)
    for card in model.of("MAT8"):
        sheet_material(model, card)
    properties = {
        card.integer(1): card for card in model.of("PSOLID", "PSHELL", "PCOMP", "PBAR", "PBARL", "PBEAM", "PBEAML")
    }
    rods = {card.integer(1): card for card in model.of("PROD")}
    by_property: dict[int, list[Card]] = {}
    for card in model.of(*SOLIDS, *SHELLS, *BARS):
        by_property.setdefault(card.integer(2, card.integer(1)), []).append(card)
    for pid, cards in by_property.items():
        known = properties.get(pid)
        for names, maker in ((SOLIDS, _solids), (SHELLS, _shells), (BARS, _bars)):
            mine = [card for card in cards if card.name in names]
            if mine and known is None:
                model.ledger.refuse(mine[0].name, f"property {pid} is not known here", count=len(mine))
            elif mine and known is not None:
                maker(model, known, mine)
    for card in model.of("CROD", "CONROD"):
        _rod(model, card, rods)


def _material(model: NastranModel, card: Card) -> None:
    young, shear, poisson = (card.real(k, 0.0) for k in (2, 3, 4))
    if not card.text(4) and young and shear:
        poisson = young / (2 * shear) - 1
    elif not card.text(2):
        young = 2 * shear * (1 + poisson)
    if card.text(2) and card.text(3) and card.text(4) and abs(young / (2 * (1 + poisson)) / shear - 1) > 0.01:
        model.ledger.note("MAT1", "E, G and nu do not fit together: G is not taken")
    density = card.real(5, 0.0) * model.wtmass
    model.materials[card.text(1)] = DeckMaterial(card.text(1), young, poisson, density or None)


def _cells(model: NastranModel, cards: list[Card], group: str) -> None:
    for card in cards:
        model.elements[card.integer(1)] = (card.name, group)


def _solids(model: NastranModel, known: Card, cards: list[Card]) -> None:
    if known.name != "PSOLID":
        model.ledger.refuse(cards[0].name, f"property {known.text(1)} is {known.name}", count=len(cards))
        return
    group = f"pid_{known.text(1)}"
    _cells(model, cards, group)
    model.solids.append(SolidSection(group, known.text(2), "full", "lumped" if model.is_lumped else "consistent"))
    why = "elements of full integration here; Nastran's own differ in shear and bubble functions"
    model.ledger.note("CHEXA, CPENTA, CPYRAM, CTETRA", why, count=len(cards))


def _shells(model: NastranModel, known: Card, cards: list[Card]) -> None:
    pid = known.text(1)
    if known.name == "PCOMP":
        layered_shells(model, known, cards, _OFFSET_FIELD)
        return
    if known.name != "PSHELL":
        model.ledger.refuse(cards[0].name, f"property {pid} is {known.name}", count=len(cards))
        return
    is_plain = known.text(4) in ("", known.text(2)) and known.real(5, 1.0) == 1.0 and known.text(4) == known.text(2)
    if not is_plain or not known.text(3):
        why = f"PSHELL {pid} is no homogeneous plate of one thickness (MID1 = MID2, 12I/T³ = 1)"
        model.ledger.refuse("PSHELL", why, count=len(cards))
        return
    if isinstance(getattr(model.materials.get(known.text(2)), "young", None), tuple):
        model.ledger.refuse(
            "PSHELL", f"property {pid}: of an orthotropic material; write it as PCOMP", count=len(cards)
        )
        return
    thickness = known.real(3)
    offsets: dict[float, list[Card]] = {}
    for card in cards:
        own = {card.real(k) for k in _THICKNESS_FIELDS if card.text(k)}
        if own - {thickness}:
            model.ledger.refuse(card.name, "thickness of its own at the corners")
        else:
            offsets.setdefault(card.real(_OFFSET_FIELD[card.name], 0.0), []).append(card)
    for offset, mine in offsets.items():
        group = f"pid_{pid}" if len(offsets) == 1 else f"pid_{pid}_offset_{offset:g}"
        _cells(model, mine, group)
        added = known.real(8, 0.0) * model.wtmass
        model.shells.append(ShellSection(group, known.text(2), thickness, offset, added))


def _bars(model: NastranModel, known: Card, cards: list[Card]) -> None:
    """Bars of one property, a group for each orientation and offset."""
    pid = known.text(1)
    shape = _shape(model, known)
    if shape is None:
        model.ledger.refuse(known.name, f"property {pid}: this section is not known here", count=len(cards))
        return
    defaults = model.of("BAROR" if cards[0].name == "CBAR" else "BEAMOR")
    groups: dict[tuple[Any, ...], list[Card]] = {}
    for card in cards:
        if card.text(9) not in ("", "0") or card.text(10) not in ("", "0"):
            model.ledger.refuse(card.name, "released ends (PA, PB)")
            continue
        if set(card.text(8).upper()[1:]) - {"G"} and any(card.text(k) for k in range(11, 17)):
            model.ledger.refuse(card.name, f"offsets along the axes of the element (OFFT {card.text(8)})")
            continue
        ends = [model.point(card, card.integer(k)) for k in (3, 4)]
        v = _orientation(model, card, defaults, ends[0])
        key = _offset(model, card, ends, v)
        if key is None:
            model.ledger.refuse(card.name, "offsets that differ at the ends or are along the axis")
        else:
            groups.setdefault((tuple(np.round(v / np.linalg.norm(v), 12).tolist()), key), []).append(card)
    dimensions, added = shape
    for k, ((v_key, offset), mine) in enumerate(groups.items(), start=1):
        group = f"pid_{pid}" if len(groups) == 1 else f"pid_{pid}_{k}"
        _cells(model, mine, group)
        is_shear = "shear_area_y" in dimensions or dimensions["shape"] != "general"
        model.lines.append(
            LineSection(
                group, known.text(2), dimensions, v_key, offset, shear=is_shear, rotary_inertia=False, added_mass=added
            )
        )
    model.ledger.note(cards[0].name, "inertia of torsion is that of the section; Nastran's has none", count=len(cards))
    if model.is_lumped:
        model.ledger.note(
            cards[0].name, "mass is consistent here, the deck lumps it (no PARAM,COUPMASS)", count=len(cards)
        )


def _orientation(model: NastranModel, card: Card, defaults: list[Card], start: Array) -> Array:
    """Return the vector from end A that spans plane 1 with the axis, (3,), basic axes."""
    source = card if card.text(5) else (defaults[0] if defaults else card)
    word = source.text(5)
    if word.lstrip("+").isdigit() and not source.text(6):
        return model.point(card, int(word)) - start
    v = np.array([source.real(k, 0.0) for k in (5, 6, 7)])
    in_basic = source.text(8).upper()[:1] == "B" if source is card else False
    return v if in_basic else np.asarray(model.axes(card.integer(3)) @ v)


def _offset(model: NastranModel, card: Card, ends: list[Array], v: Array) -> tuple[float, float] | None:
    """Return the offset of the centroid along local y and z; None where it is not the same at both ends."""
    w = [np.array([card.real(first + k, 0.0) for k in range(3)]) for first in (11, 14)]
    w = [model.axes(card.integer(3 + end)) @ w[end] for end in (0, 1)]
    x = ends[1] - ends[0]
    if not np.any(w):
        return 0.0, 0.0
    x = x / np.linalg.norm(x)
    y = v - (v @ x) * x
    y = y / np.linalg.norm(y)
    scale = 1e-9 * np.linalg.norm(ends[1] - ends[0])
    if np.abs(w[0] - w[1]).max() > scale or abs(w[0] @ x) > scale:
        return None
    return float(w[0] @ y), float(w[0] @ np.cross(x, y))


def _shape(model: NastranModel, card: Card) -> tuple[dict[str, Any], float] | None:
    """Return the keys of a section of a job, and its mass per length without stiffness."""
    makers: dict[str, Callable[[NastranModel, Card], tuple[dict[str, Any], float] | None]] = {
        "PBAR": _pbar, "PBEAM": _pbeam, "PBARL": _library, "PBEAML": _library,
    }  # fmt: skip
    return makers[card.name](model, card) if card.name in makers else None


def _general(A: float, I1: float, I2: float, J: float, K1: float, K2: float) -> dict[str, Any]:
    """I1 bends in plane 1, which holds the local y axis."""
    made: dict[str, Any] = {"shape": "general", "area": A, "iy": I2, "iz": I1, "torsion": J}
    if K1 and K2:
        made |= {"shear_area_y": K1 * A, "shear_area_z": K2 * A}
    return made


def _pbar(model: NastranModel, card: Card) -> tuple[dict[str, Any], float] | None:
    if card.real(19, 0.0) != 0.0:
        return None
    A, I1, I2, J = (card.real(k, 0.0) for k in (3, 4, 5, 6))
    if not (A > 0 and I1 > 0 and I2 > 0 and J > 0):
        return None
    return _general(A, I1, I2, J, card.real(17, 0.0), card.real(18, 0.0)), card.real(7, 0.0) * model.wtmass


def _pbeam(model: NastranModel, card: Card) -> tuple[dict[str, Any], float] | None:
    """Only of one section: no further stations, no products of inertia, no offsets of centre and neutral axis."""
    A, I1, I2, I12, J = (card.real(k, 0.0) for k in (3, 4, 5, 6, 7))
    stations = [k for k in range(17, len(card.fields)) if card.text(k).upper() in ("YES", "YESA", "NO")]
    last = 17
    for k in stations:
        own = [card.text(k + j) for j in (2, 3, 4, 5, 6, 7)]
        base = [card.text(j) for j in (3, 4, 5, 6, 7, 8)]
        if any(word and word != was for word, was in zip(own, base, strict=True)):
            return None
        last = k + 16 if card.text(k).upper() == "YES" else k + 8
    tail = [card.real(last + k, 0.0) for k in range(16)]
    if I12 != 0.0 or not (A > 0 and I1 > 0 and I2 > 0 and J > 0) or any(tail[2:]):
        return None
    K1, K2 = (tail[k] if card.text(last + k) else 1.0 for k in (0, 1))
    return _general(A, I1, I2, J, K1, K2), card.real(8, 0.0) * model.wtmass


def _library(model: NastranModel, card: Card) -> tuple[dict[str, Any], float] | None:
    """Sections by name; Nastran's height is along y, its width along z."""
    d = [card.real(k, 0.0) for k in range(9, 15)]
    n = {"ROD": 1, "TUBE": 2, "BAR": 2, "BOX": 4}.get(card.text(4).upper())
    if n is None or not all(value > 0 for value in d[:n]) or (card.name == "PBEAML" and any(card.fields[9 + n :])):
        return None
    shapes: dict[str, dict[str, Any]] = {
        "ROD": {"shape": "circle", "radius": d[0]},
        "TUBE": {"shape": "tube", "radius": d[0], "thickness": d[0] - d[1]},
        "BAR": {"shape": "rectangle", "width": d[1], "height": d[0]},
        "BOX": {"shape": "box", "width": d[1], "height": d[0], "web": d[2], "flange": d[3]},
    }
    added = card.real(9 + n, 0.0) * model.wtmass
    return shapes[card.text(4).upper()], added


def _rod(model: NastranModel, card: Card, rods: dict[int, Card]) -> None:
    """A rod is a spring along and about its axis with half of its mass at each end, as Nastran lumps it."""
    if card.name == "CONROD":
        nodes, mid, A, J, nsm = (2, 3), card.text(4), card.real(5), card.real(6, 0.0), card.real(8, 0.0)
    else:
        known = rods.get(card.integer(2, card.integer(1)))
        if known is None:
            model.ledger.refuse(card.name, "its property is not known here")
            return
        nodes, mid, A, J, nsm = (3, 4), known.text(2), known.real(3), known.real(4, 0.0), known.real(6, 0.0)
    material = model.materials.get(mid)
    E, nu = (None, None) if material is None else (material.young, material.poisson)
    if material is None or not isinstance(E, float) or not isinstance(nu, float):
        model.ledger.refuse(card.name, f"material {mid} is not known here, or not isotropic")
        return
    numbers = [card.integer(k) for k in nodes]
    ends = [model.point(card, number) for number in numbers]
    x = ends[1] - ends[0]
    L = float(np.linalg.norm(x))
    x = x / L
    y = np.cross(x, np.eye(3)[int(np.argmin(np.abs(x)))])
    y = y / np.linalg.norm(y)
    rows = (x, y, np.cross(x, y))
    triad = tuple((float(a[0]), float(a[1]), float(a[2])) for a in rows)
    G = E / (2 * (1 + nu))
    names = [model.group(card, [number]) for number in numbers]
    stiffness = (E * A / L, 0.0, 0.0, G * J / L, 0.0, 0.0)
    model.springs.append(DeckSpring((names[0], names[1]), stiffness, triad=(triad[0], triad[1], triad[2])))
    mass = ((material.density or 0.0) * A + nsm * model.wtmass) * L
    if mass:
        model.masses += [DeckMass(name, mass / 2) for name in names]
    model.ledger.note(card.name, "a spring along and about its axis, half of its mass at each end")
