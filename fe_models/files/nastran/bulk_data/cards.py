"""Cards of Nastran bulk data: free, small and large fields, with continuations joined and replications expanded."""

import re
from collections.abc import Iterator
from dataclasses import dataclass

from fe_models.errors import MeshError

__all__ = ["Card", "read_cards"]

SMALL, LARGE = (8, 8), (16, 4)  #: width of the data fields, and their number on a line
MOST_REPEATED = 1_000_000  #: largest number of cards that one line may replicate
INCREMENT = re.compile(r"\*\(?([^()]+)\)?$")  #: increment of a replicated field, *(2) or *2
REPEATED = re.compile(r"=\(?(\d+)\)?$")  #: number of further cards in a replication, =(8) or =8
EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")  #: exponent of a real number without letter, as in 1.5-3


@dataclass(frozen=True)
class Card:
    """One card: its name in upper case without '*', and its data fields, which are numbered from 1."""

    name: str
    fields: tuple[str, ...]
    where: str  #: file, line and name of the card, for messages

    def text(self, k: int) -> str:
        """Return the text of field k; an empty text if it is blank or missing."""
        return self.fields[k - 1] if 0 < k <= len(self.fields) else ""

    def integer(self, k: int, default: int | None = None) -> int:
        """Return the integer in field k.

        Raises
        ------
        MeshError
            If it is no number of this kind, or is blank without a default.
        """
        word = self.text(k)
        if not word and default is not None:
            return default
        try:
            return int(word)
        except ValueError:
            raise MeshError(f"{self.where}: field {k + 1}: expected an integer, got {word!r}") from None

    def real(self, k: int, default: float | None = None) -> float:
        """Return the real number in field k; Nastran permits D as exponent letter, or none (1.5-3).

        Raises
        ------
        MeshError
            If it is no number of this kind, or is blank without a default.
        """
        word = self.text(k)
        if not word and default is not None:
            return default
        try:
            return real_of(word)
        except ValueError:
            raise MeshError(f"{self.where}: field {k + 1}: expected a real number, got {word!r}") from None


def real_of(word: str) -> float:
    """Return the real number in a field; raise ValueError if it is not a number."""
    try:
        return float(word)
    except ValueError:  # D, or no letter of the exponent
        word = word.upper().replace("D", "E")
        return float(word if "E" in word else EXPONENT.sub(r"E\1", word))


def read_cards(where: str, text: str) -> Iterator[Card]:
    """Yield the cards after the first BEGIN, or from the first line if there is none, up to ENDDATA.

    Raises
    ------
    MeshError
        If a continuation has no card before it or has another mark than its card requires, a line has too many fields,
        or there is no card before a replication.
    """
    lines = text.splitlines()
    begin = next((k for k, line in enumerate(lines) if line.lstrip()[:5].upper() == "BEGIN"), -1)
    name, here, mark = "", "", ""
    fields: list[str] = []
    steps: list[str] = []  # fields of the last replicated card, which =(n) applies again
    for number, raw in enumerate(lines[begin + 1 :], start=begin + 2):
        line = raw.partition("$")[0].rstrip()
        if not line:
            continue
        if line.lstrip()[:7].upper() == "ENDDATA":
            break
        if line.lstrip()[:6].upper() == "DEQATN" or (name == "DEQATN" and line[0] in " +*,"):  # text, not fields
            if name and name != "DEQATN":
                yield Card(name, tuple(fields), here)
            name, here, fields, mark = "DEQATN", f"{where}, line {number}: DEQATN", [], ""
            continue
        if line[0] == "=":
            here = f"{where}, line {number}"
            first, data, mark, _ = _fields(line)
            again = REPEATED.fullmatch(first) if first != "=" else None
            if not name or (again and not steps) or (again and int(again[1]) > MOST_REPEATED):
                raise MeshError(f"{here}: expected a card before what is replicated, and at most {MOST_REPEATED} of it")
            steps = steps if again else data
            for _ in range(int(again[1]) if again else 1):
                yield Card(name, tuple(fields), here)
                fields = _replicated(here, fields, steps)
            continue
        first, data, following, beyond = _fields(line)
        if beyond:
            raise MeshError(
                f"{where}, line {number}: expected no more than nine fields and a mark, got also {beyond!r}"
            )
        if not first.strip("+* ") or first[0] in "+*":  # a continuation
            if not name:
                raise MeshError(f"{where}, line {number}: a continuation without a card before it: {line[:40]!r}")
            own, asked = first.strip("+* "), mark.strip("+* ")
            if own and asked and own not in (asked, mark[1:]):  # the first letter of a mark does not count
                raise MeshError(
                    f"{here}: asks for the continuation {asked!r}, but line {number} has {own!r}; write continuations "
                    "in sequence"
                )
            fields += data
        else:
            if name:
                yield Card(name, tuple(fields), here)
            name = first.rstrip("* ").upper()
            if name[0].isdigit():
                raise MeshError(f"{where}, line {number}: expected the name of a card, got {first!r}")
            here = f"{where}, line {number}: {name}"
            fields = data
        mark = following
    if name:
        yield Card(name, tuple(fields), here)


def _replicated(here: str, fields: list[str], steps: list[str]) -> list[str]:
    """Return the fields of a replicated card: = repeats a field, == all following fields, *(x) adds x."""
    made: list[str] = []
    for k, word in enumerate(steps):
        before = fields[k] if k < len(fields) else ""
        if word == "==":
            return [*made, *fields[k:]]
        step = INCREMENT.fullmatch(word)
        if word == "=":
            made.append(before)
        elif step is None:
            made.append(word)
        else:
            try:
                before = before or ("0" if step[1].lstrip("+-").isdigit() else "0.")  # blank is zero
                is_whole = before.lstrip("+-").isdigit() and step[1].lstrip("+-").isdigit()
                value = int(before) + int(step[1]) if is_whole else real_of(before) + real_of(step[1])
            except ValueError:
                raise MeshError(f"{here}: {word}: expected a number in the card before, got {before!r}") from None
            made.append(repr(value))
    return made


def _fields(line: str) -> tuple[str, list[str], str, str]:
    """Return first field, data fields, continuation mark and remaining text of a line."""
    if "," in line:
        parts = [part.strip() for part in line.split(",")]
        if line[0] not in " +*=":  # blanks may separate the name from the first field
            parts[:1] = parts[0].split(None, 1) or [""]
        count = (LARGE if "*" in parts[0] else SMALL)[1]
        data = parts[1 : count + 1]
        mark = parts[count + 1] if len(parts) > count + 1 else ""
        return parts[0], data + [""] * (count - len(data)), mark, ",".join(parts[count + 2 :]).strip(",")
    line = line.expandtabs(8)
    first = line[:8].strip()
    width, count = LARGE if "*" in first else SMALL
    data = [line[8 + width * k : 8 + width * (k + 1)].strip() for k in range(count)]
    return first, data, line[72:80].strip(), ""
