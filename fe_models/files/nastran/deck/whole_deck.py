"""Complete decks of Nastran: case control, and bulk data with include files."""

import re
from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.decks.deck import Deck
from fe_models.files.decks.ledger import Ledger
from fe_models.files.nastran.bulk_data.cards import Card, read_cards
from fe_models.files.nastran.bulk_data.coordinate_systems import read_grid_points
from fe_models.files.nastran.bulk_data.includes import bulk_parts, bulk_text
from fe_models.files.nastran.deck.attached import read_attached
from fe_models.files.nastran.deck.bars import BARS
from fe_models.files.nastran.deck.card_fields import check_cards
from fe_models.files.nastran.deck.model import NastranModel
from fe_models.files.nastran.deck.sections import SHELLS, SOLIDS, read_sections
from fe_models.files.nastran.deck.superelements import (
    MAIN_CARDS,
    connect_superelements,
    join_superelements,
    place_superelements,
)
from fe_models.files.nastran.deck.supports import hold_points
from fe_models.files.nastran.mesh import element_of, mesh_of_elements
from fe_models.meshes.cells.raw_mesh import RawBlock, RawMesh

__all__ = ["CaseControl", "case_control", "read_nastran_deck", "read_parameters"]

# case control and parameters: they select the sets and matrices of the body -------------------------------------------


#: commands that add mass, stiffness or damping to the body
ADDING = ("K2GG", "M2GG", "B2GG", "K42GG", "K2PP", "M2PP", "B2PP", "TFL", "MFLUID", "NSM", "A2GG", "BGSET", "BCSET")
PARAMETER = re.compile(r"(?im)^[ \t]*PARAM[ \t]*,[ \t]*([A-Z0-9_]+)[ \t]*,[ \t]*([^,\s$]+)")


@dataclass(frozen=True)
class CaseControl:
    """Content between CEND and BEGIN BULK."""

    chosen: dict[str, set[int]]  #: selected sets of all subcases for "SPC" and "MPC"; 0 for a subcase without one
    has_temperature: bool  #: whether a temperature for materials is selected
    adding: tuple[str, ...]  #: commands of `ADDING`, as written
    parameters: tuple[Card, ...]

    def check(self, ledger: Ledger) -> None:
        """Record commands that add mass, stiffness or damping in the ledger; modal damping is omitted with a note."""
        for line in self.adding:
            if line.upper().startswith("SDAMP"):
                ledger.note("SDAMPING", f"modal damping ({line}) is left out: give the job a table [damping]")
            else:
                ledger.refuse(line.split("=")[0].strip().upper(), f"the case control says {line}: it adds to the body")


def case_control(text: str) -> CaseControl | None:
    """Return the case control of a deck; None if the deck contains bulk data only.

    A command above the first SUBCASE applies to all subcases without their own.
    """
    head = re.split(r"(?im)^[ \t]*BEGIN", text, maxsplit=1)
    if len(head) < 2 or not re.search(r"(?im)^[ \t]*(CEND|SUBCASE|SPC|MPC|LOAD|METHOD|DISP|ECHO|TITLE)", head[0]):
        return None
    control = re.split(r"(?im)^[ \t]*CEND", head[0], maxsplit=1)[-1]
    parts = re.split(r"(?im)^[ \t]*(?:SUBCASE|SUBCOM|SYM)\b[^\n]*", control)
    chosen: dict[str, set[int]] = {}
    for kind in ("SPC", "MPC"):
        numbers = [re.findall(rf"(?im)^[ \t]*{kind}[ \t]*=[ \t]*(\d+)", part) for part in parts]
        above = int(numbers[0][-1]) if numbers[0] else 0
        own = [int(found[-1]) if found else above for found in numbers[1:]]
        chosen[kind] = set(own) if own else {above}
    words = "|".join(ADDING)
    adding = re.findall(rf"(?im)^[ \t]*((?:{words}|SDAMP[A-Z]*)(?:\([^)]*\))?[ \t]*=[^\n$]*)", control)
    parameters = [
        Card("PARAM", (name.upper(), value), f"case control: PARAM,{name}")
        for name, value in PARAMETER.findall(head[0])
    ]
    has_temperature = bool(re.search(r"(?im)^[ \t]*TEMP[A-Z]*[ \t]*(\((MAT|INIT|BOTH)[A-Z]*\))?[ \t]*=", control))
    lines = tuple(line.strip() for line in dict.fromkeys(adding))
    return CaseControl(chosen, has_temperature, lines, tuple(parameters))


def read_parameters(model: NastranModel, above: Iterable[Card]) -> None:
    """Read PARAM WTMASS and COUPMASS; record G and other damping in the ledger.

    Parameters
    ----------
    above
        PARAM cards of the case control. They override those of the bulk data, as users of MSC Nastran report
        (eng-tips.com, thread 484390); we know no manual that states this.

    Raises
    ------
    MeshError
        If WTMASS or COUPMASS has two values in the bulk data, or in the case control.
    """
    given: dict[str, Card] = {}
    for cards in (list(above), model.cards.get("PARAM", ())):
        here: dict[str, Card] = {}
        for card in cards:
            name = card.text(1).upper()
            old = here.setdefault(name, card)
            if name in ("WTMASS", "COUPMASS") and old.text(2) != card.text(2):
                raise MeshError(f"{card.where}: {name} = {card.text(2)}, but {old.where} says {old.text(2)}; keep one")
        for name in ("WTMASS", "COUPMASS"):
            if name in given and name in here and given[name].text(2) != here[name].text(2):
                why = f"of the case control counts, not {here[name].text(2)} of the bulk data"
                model.ledger.note("PARAM", f"{name} = {given[name].text(2)} {why}")
        given = here | given
    model.wtmass = given["WTMASS"].real(2) if "WTMASS" in given else 1.0
    model.is_lumped = (given["COUPMASS"].text(2) if "COUPMASS" in given else "-1").startswith("-")
    for name in ("G", "GFL", "ALPHA1", "ALPHA2"):
        if name in given and given[name].real(2, 0.0):
            model.ledger.note(
                "PARAM", f"damping {name} = {given[name].text(2)} is left out: give the job a table [damping]"
            )
    for name in ("K6ROT", "SNORM"):
        if name in given and given[name].text(2).strip("0."):
            why = f"{name} = {given[name].text(2)}: shells here have a drilling stiffness of their own"
            model.ledger.note("PARAM", why)


# whole deck -----------------------------------------------------------------------------------------------------------


def read_nastran_deck(path: Path, data: bytes) -> Deck:
    """Return the content of a deck of Nastran.

    Raises
    ------
    MeshError
        If the deck is damaged. Content that cannot be converted is in the ledger.
    """
    where = f"deck {path}"
    included: dict[str, str] = {}
    text = bulk_text(where, path, data.decode("utf-8", "replace"), included)
    head = case_control(text)
    ledger = Ledger(where)
    sections = bulk_parts(where, text)
    models = {number: _model(where, section, head, ledger) for number, section in sections.items()}
    if not any(model.points.positions for model in models.values()):
        raise MeshError(f"{where}: expected grid points (GRID), got none; is this a Nastran bulk data file?")
    for model in models.values():
        hold_points(model, find_plane=len(models) == 1)
    if len(models) == 1:
        deck = _deck(path, models[0], included)
    else:
        placed = place_superelements(models)
        connected = connect_superelements(models, placed)
        decks = {
            number: _deck(path, model, included)
            for number, model in models.items()
            if model.points.positions or not number
        }
        deck = join_superelements(models, decks, placed, connected)
    for name in MAIN_CARDS if len(models) == 1 else ():
        if name in models[0].cards:
            ledger.refuse(name, "there is no superelement (BEGIN SUPER) that it could name")
    if head is not None:
        head.check(ledger)
    return deck


def _model(where: str, text: str, head: CaseControl | None, ledger: Ledger) -> NastranModel:
    """Return the cards of a section with its grid points and parameters."""
    cards: dict[str, list[Card]] = {}
    for card in read_cards(where, text):
        cards.setdefault(card.name, []).append(card)
    points = read_grid_points([card for found in cards.values() for card in found])
    model = NastranModel(where, cards, points, ledger, None if head is None else head.chosen)
    model.has_temperature = None if head is None else head.has_temperature
    read_parameters(model, () if head is None else head.parameters)
    return model


def _deck(path: Path, model: NastranModel, included: dict[str, str]) -> Deck:
    """Return the deck of one section."""
    read_sections(model)
    read_attached(model)
    check_cards(model)
    mesh = replace(_mesh(model), included=included)
    return Deck(
        path, "nastran", mesh, model.ledger, model.materials, tuple(model.solids), tuple(model.shells),
        tuple(model.lines), tuple(model.masses), tuple(model.springs), tuple(model.rigid), tuple(model.couplings),
        tuple(model.equations), tuple(model.supports), tuple(model.loads), plane=model.plane,
        lumped=frozenset(("lines", "shells") if model.is_lumped else ()),
    )  # fmt: skip


def _mesh(model: NastranModel) -> RawMesh:
    """Return the grid points, the elements with a section, and the groups."""
    cards = [card for name in (*SOLIDS, *SHELLS, *BARS) for card in model.cards.get(name, ())]
    elements = []
    for card in cards:
        number = card.integer(1)
        ends = {end: str(model.ends[number, end]) for end in (0, 1) if (number, end) in model.ends}
        elements.append(element_of(card, model.elements.get(number, (card.name, ""))[1], ends))
    mesh = mesh_of_elements(model.where, model.points.positions, elements)
    place = {int(number): row for row, number in enumerate(model.points.positions)}
    blocks = list(mesh.blocks)
    for name, faces in model.faces.items():
        for kind, n in (("triangle", 3), ("quad", 4)):
            table = np.array([[place[node] for node in face] for face in faces if len(face) == n], dtype=np.int64)
            if len(table):
                blocks.append(RawBlock(kind, table, {name: np.arange(len(table))}))
    sets = {name: np.array([place[node] for node in nodes], dtype=np.int64) for name, nodes in model.groups.items()}
    return replace(mesh, blocks=tuple(blocks), node_sets=sets)
