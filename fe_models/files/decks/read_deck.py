"""Reading of complete decks: the suffix selects the program, and all faults of a file raise the same error."""

from collections.abc import Callable
from pathlib import Path

from fe_models.errors import FeModelsError, MeshError
from fe_models.files.decks.abaqus.whole_deck import read_abaqus_deck
from fe_models.files.decks.ansys.cdb import read_cdb_deck
from fe_models.files.decks.deck import Deck
from fe_models.files.decks.nastran.whole_deck import read_nastran_deck
from fe_models.foundation.paths import near_file
from fe_models.foundation.words import damage, nearest, quoted
from fe_models.meshes.cells.raw_mesh import require_nodes

__all__ = ["DECK_FORMATS", "parse_deck"]

DECK_FORMATS: dict[str, Callable[..., Deck]] = {
    ".inp": read_abaqus_deck,
    ".cdb": read_cdb_deck,
    ".bdf": read_nastran_deck,
    ".nas": read_nastran_deck,
    ".dat": read_nastran_deck,
    ".fem": read_nastran_deck,
    ".blk": read_nastran_deck,
    ".bulk": read_nastran_deck,
    ".asm": read_nastran_deck,
    ".pch": read_nastran_deck,
}  #: reader (path, content, program) for each suffix


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
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MeshError(f"{where}: cannot be read: {error.strerror or error}{near_file(path)}") from error
    reader = DECK_FORMATS[suffix]
    if program is not None and reader is not read_abaqus_deck:
        raise MeshError(f"{where}: program = {program!r} belongs to decks of Abaqus and CalculiX (.inp); leave it out")
    try:
        deck = reader(path, data) if program is None else reader(path, data, program=program)
        require_nodes(where, deck.mesh)
        _note_means_of_followers(deck)
        return deck
    except FeModelsError:
        raise
    except Exception as error:  # whatever a damaged file does to a reader, the user gets one message
        raise MeshError(f"{where}: could not be read: {damage(error)}") from error


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
