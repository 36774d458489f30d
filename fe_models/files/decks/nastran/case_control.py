"""Case control and parameters of a Nastran deck: they select the sets and matrices of the body."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from fe_models.errors import MeshError
from fe_models.files.bulk_data.cards import Card
from fe_models.files.decks.ledger import Ledger
from fe_models.files.decks.nastran.model import NastranModel

__all__ = ["CaseControl", "case_control", "read_parameters"]

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
        Those of the case control. They override those of the bulk data, as users of MSC Nastran describe it
        (eng-tips.com, thread 484390); we know no manual that says so.

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
