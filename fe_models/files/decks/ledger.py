"""Ledger of a deck: every card or keyword that is not converted, how often it occurs, and the consequence."""

from collections.abc import Iterable
from dataclasses import dataclass, field

from fe_models.errors import MeshError
from fe_models.foundation.words import nearest, quoted

__all__ = ["Entry", "Ledger"]


@dataclass
class Entry:
    """Ledger entry for one kind of card."""

    name: str
    consequence: str
    count: int = 0
    is_body: bool = False  #: whether the card has mass or stiffness; it is then omitted only on request
    first_line: int = 0


@dataclass
class Ledger:
    """All entries of a deck by name and consequence, in order of their first appearance."""

    where: str
    entries: dict[tuple[str, str], Entry] = field(default_factory=dict)

    def note(self, name: str, consequence: str, *, count: int = 1, line: int = 0) -> None:
        """Record data that change neither mass nor stiffness."""
        self._add(name, consequence, count, line, False)

    def refuse(self, name: str, consequence: str, *, count: int = 1, line: int = 0) -> None:
        """Record data with mass or stiffness that cannot be converted."""
        self._add(name, consequence, count, line, True)

    def _add(self, name: str, consequence: str, count: int, line: int, is_body: bool) -> None:
        entry = self.entries.setdefault((name, consequence), Entry(name, consequence, 0, is_body, line))
        entry.count += count

    def rows(self) -> list[tuple[str, str, str]]:
        """Return name, count and consequence of each entry."""
        return [(entry.name, str(entry.count), entry.consequence) for entry in self.entries.values()]

    def require_whole(self, leave_out: Iterable[str] = ()) -> None:
        """Raise an error unless all mass and stiffness is converted, or omitted by name on request.

        Raises
        ------
        MeshError
            If something is missing, with name and count of each; or if a name to leave out is not in the ledger.
        """
        body = [entry for entry in self.entries.values() if entry.is_body]
        names = {entry.name.upper(): entry.name for entry in body}
        wanted = {word.upper().lstrip("*") for word in leave_out}
        for word in wanted - {name.lstrip("*") for name in names}:
            raise MeshError(
                f"{self.where}: --leave-out {quoted(word)}: the deck has no such thing to be left out"
                f"{nearest(word, names.values())}"
            )
        missing = [entry for entry in body if entry.name.upper().lstrip("*") not in wanted]
        if missing:
            listed = "; ".join(
                f"{entry.count} {entry.name}{f' (first: line {entry.first_line})' if entry.first_line else ''}: "
                f"{entry.consequence}"
                for entry in missing
            )
            names_missing = list(dict.fromkeys(entry.name.lstrip("*") for entry in missing))
            options = " ".join(
                f'--leave-out "{name}"' if " " in name else f"--leave-out {name}" for name in names_missing
            )
            raise MeshError(
                f"{self.where}: these carry mass or stiffness and cannot be taken over: {listed}. Change the deck, or "
                f"leave them out knowingly: {options}"
            )
