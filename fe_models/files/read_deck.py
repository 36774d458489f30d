"""Reading of complete decks: the suffix selects the program, and all faults of a file raise the same error."""

from collections.abc import Callable
from pathlib import Path

from fe_models.errors import FeModelsError, MeshError
from fe_models.files.abaqus.whole_deck import read_abaqus_deck
from fe_models.files.ansys.cdb import read_cdb_deck
from fe_models.files.decks.deck import Deck
from fe_models.files.nastran.deck.whole_deck import read_nastran_deck
from fe_models.foundation.formats import ReadFormat, by_suffix
from fe_models.foundation.paths import bytes_of, reading
from fe_models.foundation.words import nearest, quoted
from fe_models.meshes.cells.raw_mesh import require_nodes

__all__ = ["DECKS", "DECK_FORMATS", "parse_deck"]

#: reads the content of a file: path, bytes, and the program if several have the same suffix
DeckReader = Callable[..., Deck]

DECKS: tuple[ReadFormat[DeckReader], ...] = (
    ReadFormat(
        "bulk data", "Nastran", "deck", (".bdf", ".nas", ".dat", ".fem", ".blk", ".bulk", ".asm", ".pch"),
        tried="decks of MSC Nastran 2020",
        lost="smeared layers, RBE1, scalar points that grid points move, contact, external superelements, fluids: each "
        "listed with its count",
        read=read_nastran_deck,
    ),
    ReadFormat(
        "CDB", "ANSYS", "deck", (".cdb",), tried="ANSYS 2019 R2",
        lost="all but SOLID185, 186, 187, SHELL181, 281, materials, components, supports, forces: each listed with "
        "its count",
        read=read_cdb_deck,
    ),
    ReadFormat(
        "input deck", "Abaqus, CalculiX", "deck", (".inp",), tried="decks of ccx 2.20",
        lost="contact, nonlinear materials, steps: each listed with its count",
        read=read_abaqus_deck,
    ),
)  # fmt: skip
DECK_FORMATS = by_suffix(DECKS)  #: format of each suffix


def parse_deck(path: str | Path, *, program: str | None = None) -> Deck:
    """Read a complete deck: mesh, materials, sections, couplings, supports, loads, and the ledger of other data.

    Parameters
    ----------
    path
        Path of the file; its suffix determines the program (`DECK_FORMATS`).
    program
        "calculix" (the default) or "abaqus" for decks (.inp), because the two programs integrate elements differently.

    Raises
    ------
    MeshError
        If the file is missing, of another kind, or damaged. Content that is not converted is in the ledger.
    """
    path = Path(path)
    where = f"deck {path}"
    suffix = path.suffix.lower()
    if suffix not in DECK_FORMATS:
        raise MeshError(f"{where}: unknown suffix {quoted(suffix)}{nearest(suffix, DECK_FORMATS)}")
    data = bytes_of(where, path, MeshError)
    known = DECK_FORMATS[suffix]
    if program is not None and known.read is not read_abaqus_deck:
        raise MeshError(f"{where}: program = {program!r} belongs to decks of Abaqus and CalculiX (.inp); leave it out")
    with reading(where, path, known, MeshError, FeModelsError):
        deck = known.read(path, data) if program is None else known.read(path, data, program=program)
        require_nodes(where, deck.mesh)
        _note_means_of_followers(deck)
        return deck


def _note_means_of_followers(deck: Deck) -> None:
    """Note mean motions whose members follow another mean, because their second order is only approximate."""
    sets = deck.mesh.node_sets
    followers = {int(node) for coupling in deck.couplings for node in sets[coupling.node]}
    n_found = -1
    while n_found < len(followers):  # rigid links pass a mean on
        n_found = len(followers)
        for link in deck.rigid:
            if followers.intersection(sets[link.node].tolist()):
                followers.update(sets[link.followers].tolist())
    for coupling in deck.couplings:
        if any(followers.intersection(sets[group].tolist()) for group, _ in coupling.members):
            why = "its members follow another mean: the geometric stiffness takes their mean as linear in part"
            deck.ledger.note(coupling.name, why)
