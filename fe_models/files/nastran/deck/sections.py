"""Materials, properties and elements of Nastran: solids, shells, bars, beams and rods."""

from dataclasses import replace

import numpy as np

from fe_models.files.decks.deck import (
    DeckMass,
    DeckMaterial,
    DeckSpring,
    ShellSection,
    SolidSection,
    as_triad,
    axes_along,
)
from fe_models.files.nastran.bulk_data.cards import Card
from fe_models.files.nastran.deck.bars import BARS, read_bars, with_defaults
from fe_models.files.nastran.deck.layups import (
    ANGLE_FIELD,
    layered_shells,
    needs_matrices,
    orthotropic_shells,
    plane_strain_shells,
    sheet_material,
    stiffness_shells,
)
from fe_models.files.nastran.deck.model import PROPERTIES, NastranModel
from fe_models.files.nastran.deck.tapers import cut_tapers

__all__ = ["SHELLS", "SOLIDS", "read_sections"]

SAME_MODULUS = 1e-6  #: relative difference of G from E/(2 (1 + nu)) up to which it is rounding on the card

SOLIDS = ("CTETRA", "CHEXA", "CPENTA", "CPYRAM", "CPYRA")
SHELLS = ("CTRIA3", "CTRIAR", "CTRIA6", "CQUAD4", "CQUADR", "CQUAD8")
#: card -> number of corner grids, and the two corners of the edge of each middle grid, in the order of the card
_MIDDLES: dict[str, tuple[int, tuple[tuple[int, int], ...]]] = {
    "CTETRA": (4, ((0, 1), (1, 2), (2, 0), (0, 3), (1, 3), (2, 3))),
    "CPYRAM": (5, ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 4), (2, 4), (3, 4))),
    "CPENTA": (6, ((0, 1), (1, 2), (2, 0), (0, 3), (1, 4), (2, 5), (3, 4), (4, 5), (5, 3))),
    "CHEXA": (
        8, ((0, 1), (1, 2), (2, 3), (3, 0), (0, 4), (1, 5), (2, 6), (3, 7), (4, 5), (5, 6), (6, 7), (7, 4)),
    ),
}  # fmt: skip
_MIDDLES["CPYRA"] = _MIDDLES["CPYRAM"]
_MIDDLES |= {"CTRIA6": (3, ((0, 1), (1, 2), (2, 0))), "CQUAD8": (4, ((0, 1), (1, 2), (2, 3), (3, 0)))}
_CORNERS = {"CTRIA3": (11, 12, 13), "CTRIAR": (11, 12, 13), "CTRIA6": (11, 12, 13)}
#: field numbers of T1 to T4 for each card
_THICKNESS_FIELDS = {name: _CORNERS.get(name, (11, 12, 13, 14)) for name in SHELLS}


def read_sections(model: NastranModel) -> None:
    """Read materials, then every kind of element with its property."""
    for card in model.of("MAT1"):
        _material(model, card)
    for card in model.of("MAT8"):
        sheet_material(model, card)
    for card in model.of("MATHP"):
        _rubber(model, card)
    with_defaults(model)
    cut_tapers(model)
    _with_middles(model)
    by_property: dict[int, list[Card]] = {}
    for card in model.of(*SOLIDS, *SHELLS, *BARS):
        by_property.setdefault(card.integer(2, card.integer(1)), []).append(card)
    for pid, cards in by_property.items():
        known = model.property_of(cards[0], *PROPERTIES)
        for names, read in ((SOLIDS, _solids), (SHELLS, _shells), (BARS, read_bars)):
            mine = [card for card in cards if card.name in names]
            if mine and known is None:
                model.ledger.refuse(mine[0].name, f"property {pid} is not known here", count=len(mine))
            elif mine and known is not None:
                read(model, known, mine)
    for card in model.of("CROD", "CONROD", "CTUBE"):
        _rod(model, card)


def _material(model: NastranModel, card: Card) -> None:
    """Read MAT1; a blank E, G or NU follows from the other two by E = 2 G (1 + NU).

    If all three are given and inconsistent, bars and rods use E and G, solids E and NU, and shells E and NU in their
    plane and G for transverse shear, as in Nastran. If only E or only G is given, the other two are zero in Nastran.
    """
    young, shear, poisson = (card.real(k, 0.0) for k in (2, 3, 4))
    name, given = card.text(1), [bool(card.text(k)) for k in (2, 3, 4)]
    if given == [False, True, False]:
        model.ledger.refuse("MAT1", f"material {name}: G alone: E and NU would be zero")
    if not given[2] and young and shear:
        poisson = young / (2 * shear) - 1
    elif not given[0]:
        young = 2 * shear * (1 + poisson)
    if given == [True, False, False]:
        model.ledger.note("MAT1", f"material {name}: E alone: NU = 0 and G = E/2 here, G = 0 in Nastran")
    elif all(given) and abs(young - 2 * (1 + poisson) * shear) > SAME_MODULUS * young:
        model.shear_moduli[name] = shear
        why = f"material {name}: E, G and NU disagree: bars and rods have E and G, shells G across their plane"
        model.ledger.note("MAT1", f"{why}, solids E and NU")
    density = card.real(5, 0.0) * model.wtmass
    model.materials[name] = DeckMaterial(name, young, poisson, density or None)


def _rubber(model: NastranModel, card: Card) -> None:
    """Read the elastic constants of MATHP for small strain.

    The energy A10 (I1 - 3) + A01 (I2 - 3) + D1 (J - 1)² + terms of higher order gives G = 2 (A10 + A01) and K = 2 D1.
    """
    if any(card.text(k) for k in range(49, 57)):
        model.ledger.refuse("MATHP", f"material {card.text(1)}: constants fitted to measured curves (TAB1 to TABD)")
        return
    A = card.real(2, 0.0) + card.real(3, 0.0)
    G, K = 2 * A, 2 * card.real(4, 1000 * A)
    if not G > 0 or not K > 0:
        model.ledger.refuse("MATHP", f"material {card.text(1)}: A10 + A01 and D1 must be above zero")
        return
    E, nu = 9 * K * G / (3 * K + G), (3 * K - 2 * G) / (6 * K + 2 * G)
    density = card.real(5, 0.0) * model.wtmass
    model.materials[card.text(1)] = DeckMaterial(card.text(1), E, nu, density or None)
    why = f"rubber: its constants at small strain, Poisson's ratio {nu:.4g}; cells of first order may be too stiff"
    model.ledger.note("MATHP", why)


def _cells(model: NastranModel, cards: list[Card], group: str) -> None:
    for card in cards:
        model.elements[card.integer(1)] = (card.name, group)


def _with_middles(model: NastranModel) -> None:
    """Add points to cells with some but not all middle grids; each is the mean of the corners of its edge.

    The edge is then straight and its displacement linear, as in Nastran. Cells without middle grids are of first order.
    """
    made: dict[tuple[int, int], int] = {}
    for name, (n, edges) in _MIDDLES.items():
        cards = model.cards.get(name, [])
        for k, card in enumerate(cards):
            middles = [card.text(2 + n + j) for j in range(1, len(edges) + 1)]
            if not any(middles) or all(middles):
                continue
            corners = [card.integer(3 + j) for j in range(n)]
            for j, (a, b) in enumerate(edges):
                if middles[j]:
                    continue
                edge = (min(corners[a], corners[b]), max(corners[a], corners[b]))
                if edge not in made:
                    made[edge] = model.new_point((model.point(card, edge[0]) + model.point(card, edge[1])) / 2)
                    for c in range(6 if name in SHELLS else 3):
                        row = {(made[edge], c): 1.0, (edge[0], c): -0.5, (edge[1], c): -0.5}
                        model.plain_rows.append(row)
                middles[j] = str(made[edge])
            fields = (*card.fields[: 2 + n], *middles, *card.fields[2 + n + len(edges) :])
            cards[k] = Card(card.name, fields, card.where)


def _solids(model: NastranModel, known: Card, cards: list[Card]) -> None:
    if known.name not in ("PSOLID", "PLSOLID"):
        model.ledger.refuse(cards[0].name, f"property {known.text(1)} is {known.name}", count=len(cards))
        return
    group = f"pid_{known.text(1)}"
    _cells(model, cards, group)
    model.solids.append(SolidSection(group, known.text(2), "full", "lumped" if model.is_lumped else "consistent"))
    why = "elements of full integration here; Nastran's own differ in shear and bubble functions"
    model.ledger.note("CHEXA, CPENTA, CPYRAM, CTETRA", why, count=len(cards))


def _shells(model: NastranModel, known: Card, cards: list[Card]) -> None:
    pid = known.text(1)
    if known.name in ("PCOMP", "PCOMPG"):
        layered_shells(model, known, cards)
        return
    if known.name == "PLPLANE":
        plane_strain_shells(model, known, cards)
        return
    if known.name != "PSHELL":
        model.ledger.refuse(cards[0].name, f"property {pid} is {known.name}", count=len(cards))
        return
    missing = _missing_parts(model, known)
    if missing:
        model.ledger.refuse("PSHELL", f"property {pid}: {missing}", count=len(cards))
        return
    thickness = known.real(3)
    cards = [card for card in cards if _has_thickness(model, card, thickness)]
    if known.text(4) == "-1":
        plane_strain_shells(model, known, cards)
        return
    added = known.real(8, 0.0) * model.wtmass
    if not known.text(6):
        why = "MID3 is blank, rigid in transverse shear there: here 5/6 G t"
        model.ledger.note("PSHELL", why, count=len(cards))
    if needs_matrices(model, known):
        stiffness_shells(model, known, cards)
        return
    ratios = _ratios(model, known)
    if isinstance(ratios, str):
        model.ledger.refuse("PSHELL", f"property {pid}: {ratios}", count=len(cards))
        return
    if isinstance(model.materials[known.text(2)].young, tuple):
        section = ShellSection("", known.text(2), thickness, 0.0, added)
        section = replace(section, bending_ratio=ratios[0], shear_ratio=ratios[1])
        orthotropic_shells(model, known, cards, section)
        return
    offsets: dict[float, list[Card]] = {}
    for card in cards:
        offsets.setdefault(card.real(ANGLE_FIELD[card.name] + 1, 0.0), []).append(card)
    for offset, mine in offsets.items():
        group = f"pid_{pid}" if len(offsets) == 1 else f"pid_{pid}_offset_{offset:g}"
        _cells(model, mine, group)
        section = ShellSection(group, known.text(2), thickness, offset, added)
        section = replace(section, bending_ratio=ratios[0], shear_ratio=ratios[1])
        model.shells.append(section)


def _has_thickness(model: NastranModel, card: Card, thickness: float) -> bool:
    """Return whether a shell has the thickness of its property at all corners; otherwise add it to the ledger."""
    own = {card.real(k) for k in _THICKNESS_FIELDS[card.name] if card.text(k)}
    if own - {thickness}:
        model.ledger.refuse(card.name, "thickness of its own at the corners")
    return not own - {thickness}


def _missing_parts(model: NastranModel, known: Card) -> str:
    """Return why a PSHELL is not a shell; empty if it is."""
    if not known.text(2) or not known.text(3):
        return "without MID1 or T: a plate that only bends"
    if not known.text(4) and model.plane is None:
        return "without MID2: a membrane, without stiffness in bending; only where the deck is planar"
    return ""


def _ratios(model: NastranModel, known: Card) -> tuple[float, float] | str:
    """Return bending and transverse shear stiffness of a PSHELL divided by those of a plate of MID1, or a reason.

    In Nastran they are E_2 I with I = (12I/T**3) T³/12, and G_3 T_S with T_S = (TS/T) T, or 5/6 T if TS/T is blank.
    """
    materials = [model.materials.get(known.text(k) or known.text(2)) for k in (2, 4)]
    third = model.materials.get(known.text(6) or known.text(2))
    first, second = materials
    if first is None or second is None or third is None:
        return "a material that is not known here (MAT1, MAT2, MAT8)"
    bending, shear = known.real(5, 1.0), known.real(7, 5 / 6) / (5 / 6)
    if first is not second:
        assert isinstance(first.young, float)
        assert isinstance(second.young, float)
        bending *= second.young / first.young
    if isinstance(third.young, float):
        shear *= model.shear_modulus(third.name) / model.shear_modulus(first.name) * model.shear_factor(first.name)
    if not bending > 0 or not shear > 0:
        return f"12I/T**3 and TS/T must be above zero, got {known.text(5)} and {known.text(7)}"
    return bending, shear


def _rod(model: NastranModel, card: Card) -> None:
    """Convert a rod to a spring along and about its axis, and half of its mass at each end as in Nastran."""
    if card.name == "CONROD":
        nodes, mid, A, J, nsm = (2, 3), card.text(4), card.real(5), card.real(6, 0.0), card.real(8, 0.0)
    else:
        known = model.property_of(card, "PTUBE" if card.name == "CTUBE" else "PROD")
        if known is None:
            model.ledger.refuse(card.name, "its property is not known here")
            return
        nodes, mid = (3, 4), known.text(2)
        if card.name == "CTUBE":
            outer, wall, nsm = known.real(3), known.real(4, 0.0), known.real(5, 0.0)
            if known.text(6) and known.real(6) != outer:
                model.ledger.refuse("CTUBE", "tapers (OD2)")
                return
            inner = outer - 2 * wall if wall else 0.0
            A, J = np.pi / 4 * (outer**2 - inner**2), np.pi / 32 * (outer**4 - inner**4)
        else:
            A, J, nsm = known.real(3), known.real(4, 0.0), known.real(6, 0.0)
    material = model.materials.get(mid)
    if material is None or not isinstance(material.young, float):
        model.ledger.refuse(card.name, f"material {mid} is not known here, or not isotropic")
        return
    numbers = [card.integer(k) for k in nodes]
    ends = [model.point(card, number) for number in numbers]
    x = ends[1] - ends[0]
    L = float(np.linalg.norm(x))
    if not L > 0:
        model.ledger.refuse(card.name, "has no length between its ends")
        return
    E, G = material.young, model.shear_modulus(mid)
    names = [model.group(card, [number]) for number in numbers]
    stiffness = (E * A / L, 0.0, 0.0, G * J / L, 0.0, 0.0)
    model.springs.append(DeckSpring((names[0], names[1]), stiffness, triad=as_triad(axes_along(x))))
    mass = ((material.density or 0.0) * A + nsm * model.wtmass) * L
    if mass:
        model.masses += [DeckMass(name, mass / 2) for name in names]
    model.ledger.note(card.name, "a spring along and about its axis, half of its mass at each end")
