"""Tables of the supported fields of cards, keywords and commands of a program, one line of symbols each.

NAME        read
NAME=value  refused unless it is blank or has this value, the default
NAME!       refused unless it is blank
NAME~       without effect on mass, stiffness or damping
NAME^       damping or the like, which is left out and named in the ledger
-           blank in every deck
...         the preceding fields repeat, or the reader handles the remaining fields itself
...^        the reader leaves the remaining fields out and names them in the ledger
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from fe_models.files.nastran.bulk_data.cards import real_of

__all__ = ["TableField", "has_default", "markdown_table", "parse_fields"]

SYMBOLS = re.compile(r"(?P<name>[^=!~^]+)(?P<kind>[=!~^]?)(?P<default>.*)")
USES = {"": "read", "=": "default", "!": "default", "~": "harmless", "^": "left out"}


@dataclass(frozen=True)
class TableField:
    """One field of a card or command, or one parameter of a keyword."""

    number: int  #: number of the field, from 1; 0 for several fields, which `name` describes
    name: str
    use: str  #: "read", "default", "blank", "harmless" or "left out"
    default: str = ""  #: value that means the same as a blank field, if `use` is "default"


def parse_fields(words: Iterable[str]) -> tuple[TableField, ...]:
    """Return the fields in a line of a table, without the repeating fields at its end."""
    found = []
    for number, word in enumerate(words, start=1):
        if word.startswith("..."):
            break
        match = SYMBOLS.fullmatch(word)
        assert match is not None  # the tables are ours
        use = "blank" if word == "-" else USES[match["kind"]]
        found.append(TableField(number, match["name"], use, match["default"]))
    return tuple(found)


def has_default(word: str, default: str) -> bool:
    """Return whether a field has its default value, as text or as a number."""
    if not default:
        return False
    if word.upper() == default:
        return True
    try:
        return real_of(word) == real_of(default)
    except ValueError:
        return False


def markdown_table(what: str, fields: Mapping[str, tuple[TableField, ...]]) -> str:
    """Return a table in Markdown with one row for each name and one column for each use."""
    columns = (("read", "read"), ("default", "refused unless blank or"), ("left out", "left out, named"))
    lines = [
        f"| {what} | {' | '.join(title for _, title in columns)} | no effect on the body |",
        "|---|---|---|---|---|",
    ]
    for name, items in fields.items():
        cells = []
        for use, _ in (*columns, ("harmless", "")):
            cells.append(", ".join(_in_words(each) for each in items if each.use == use))
        lines.append(f"| `{name}` | {' | '.join(cells)} |")
    return "\n".join(lines)


def _in_words(item: TableField) -> str:
    if not item.number:
        return item.name
    return f"`{item.name} = {item.default}`" if item.default else f"`{item.name}`"
