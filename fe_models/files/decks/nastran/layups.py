"""Shells of layers of Nastran: PCOMP and its materials MAT8."""

from dataclasses import replace

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.bulk_data.cards import Card
from fe_models.files.decks.deck import DeckLayer, DeckMaterial, ShellSection
from fe_models.files.decks.nastran.model import NastranModel
from fe_models.foundation.arrays import Array

__all__ = ["layered_shells", "layers_of_card", "orthotropic_shells", "sheet_material"]

ANGLE_FIELD = {"CTRIA3": 6, "CTRIAR": 6, "CTRIA6": 9, "CQUAD4": 7, "CQUADR": 7, "CQUAD8": 15}  #: THETA or MCID
MOST_DIRECTIONS = 200  #: of one property, each a table of the job
DIGITS = 6  #: to which directions are the same


def sheet_material(model: NastranModel, card: Card) -> None:
    """Take MAT8: E1, E2, NU12, G12, G1Z, G2Z, RHO; what a sheet in plane stress does not have is filled in.

    E_3 = E_2 and nu_13 = nu_23 = 0 have no part in shells.
    """
    E_1, E_2, nu, G = (card.real(k) for k in (2, 3, 4, 5))
    across = [card.real(k, 0.0) for k in (6, 7)]
    if not all(across):
        model.ledger.note("MAT8", "no transverse shear modulus (G1Z, G2Z), rigid there: here that of the plane, G12")
    shear = (G, across[0] or G, across[1] or G)
    density = card.real(8, 0.0) * model.wtmass
    name = card.text(1)
    model.materials[name] = DeckMaterial(name, (E_1, E_2, E_2), (nu, 0.0, 0.0), density or None, shear)


def layers_of_card(card: Card) -> tuple[DeckLayer, ...] | str:
    """Return the layers of a PCOMP or PCOMPG, bottom to top; a text says why they cannot be taken."""
    kind = card.text(8).upper()
    if card.name == "PCOMPG":  # a number and four fields for each ply, in lines of eight
        first, step = 10, 8
    else:
        first, step = 9, 4
    if kind not in ("", "SYM"):
        return f"LAM = {kind}: only layers as they lie, or SYM"
    layers: list[DeckLayer] = []
    material, thickness = "", 0.0
    for k in range(first, len(card.fields) + 1, step):
        if not any(card.text(k + j) for j in range(4)):
            continue
        material = card.text(k) or material
        thickness = card.real(k + 1, thickness)
        if not material or not thickness > 0:
            return "a layer without material or thickness"
        layers.append(DeckLayer(material, thickness, card.real(k + 2, 0.0)))
    if not layers:
        return "no layers"
    return tuple(layers + layers[::-1] if kind == "SYM" else layers)


def layered_shells(model: NastranModel, known: Card, cards: list[Card], offset_field: dict[str, int]) -> None:
    """Take shells of one PCOMP: a section for each offset and direction of angle 0.

    The direction is the side from G1 to G2 turned by THETA about the normal, or axis x of the system MCID. Z0 is the
    bottom of the layers from the grid points; ZOFFS moves them up.
    """
    pid = known.text(1)
    layers = layers_of_card(known)
    if isinstance(layers, str):
        model.ledger.refuse(known.name, f"property {pid}: {layers}", count=len(cards))
        return
    thickness = sum(layer.thickness for layer in layers)
    bottom = known.real(2, -thickness / 2)
    section = ShellSection("", "", thickness, bottom + thickness / 2, known.real(3, 0.0) * model.wtmass, layers=layers)
    _laid_shells(model, known, cards, offset_field, section)


def orthotropic_shells(
    model: NastranModel, known: Card, cards: list[Card], offset_field: dict[str, int], section: ShellSection
) -> None:
    """Take shells of a PSHELL of MAT8: one layer of its material, laid as that of a PCOMP."""
    layers = (DeckLayer(section.material, section.thickness),)
    _laid_shells(model, known, cards, offset_field, replace(section, material="", layers=layers))


def _laid_shells(
    model: NastranModel, known: Card, cards: list[Card], offset_field: dict[str, int], section: ShellSection
) -> None:
    pid = known.text(1)
    groups: dict[tuple[float, tuple[float, ...]], list[Card]] = {}
    for card in cards:
        direction = _direction(model, card)
        key = tuple((np.round(direction / np.linalg.norm(direction), DIGITS) + 0.0).tolist())
        groups.setdefault((card.real(offset_field[card.name], 0.0), key), []).append(card)
    if len(groups) > MOST_DIRECTIONS:
        why = f"property {pid}: more than {MOST_DIRECTIONS} directions of angle 0; give them by MCID"
        model.ledger.refuse(known.name, why, count=len(cards))
        return
    for k, ((offset, _), mine) in enumerate(groups.items(), start=1):
        x, y, z = (float(v) for v in _direction(model, mine[0]))
        group = f"pid_{pid}" if len(groups) == 1 else f"pid_{pid}_{k}"
        for card in mine:
            model.elements[card.integer(1)] = (card.name, group)
        model.shells.append(replace(section, group=group, offset=section.offset + offset, direction=(x, y, z)))


def _direction(model: NastranModel, card: Card) -> Array:
    """Return the direction of angle 0 of an element, (3,), basic axes."""
    word = card.text(ANGLE_FIELD[card.name])
    corners = [
        model.point(card, card.integer(k)) for k in ((3, 4, 5) if card.name.startswith("CTRI") else (3, 4, 5, 6))
    ]
    if word.lstrip("+").isdigit():
        if int(word) == 0:
            return np.array([1.0, 0.0, 0.0])
        return np.asarray(model.system(card, int(word), np.mean(corners, axis=0))[:, 0])
    side = corners[1] - corners[0]
    normal = np.cross(corners[2] - corners[0], corners[-1] - corners[1])
    if not np.linalg.norm(normal) > 0:
        raise MeshError(f"{card.where} {card.text(1)}: its corners span no area")
    normal = normal / np.linalg.norm(normal)
    side = side - normal * (normal @ side)
    angle = np.deg2rad(card.real(ANGLE_FIELD[card.name], 0.0))
    return np.asarray(np.cos(angle) * side + np.sin(angle) * np.cross(normal, side))
