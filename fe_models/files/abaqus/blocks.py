"""Blocks of an Abaqus or CalculiX deck, and keywords that cannot be read correctly."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from fe_models.errors import MeshError
from fe_models.files.included import included_text

__all__ = ["DeckBlock", "deck_blocks", "refuse_unread"]

_REFUSED = {
    "SYSTEM": "write the nodes in global coordinates",
    "NGEN": "write the generated nodes out",
    "NFILL": "write the generated nodes out",
    "NCOPY": "write the copied nodes out",
    "NMAP": "write the mapped nodes out",
    "ELGEN": "write the generated elements out",
    "ELCOPY": "write the copied elements out",
    "REFLECTION": "write the elements out",
    "MANIFEST": "write one input file without references to others",
}  # keyword -> remedy; each creates or moves nodes or elements


@dataclass(frozen=True)
class DeckBlock:
    """Keyword line with its parameters and data lines."""

    keyword: str
    parameters: dict[str, str]  #: value of each parameter, by upper-case name; "" for a parameter without value
    lines: list[str]
    line_number: int
    file: str = ""  #: included file that contains the block; empty: the deck itself

    @property
    def place(self) -> str:
        """Position of the block in the files, for messages."""
        return f"{self.file}, line {self.line_number}" if self.file else f"line {self.line_number}"

    @property
    def tokens(self) -> list[str]:
        """All data fields of the block in sequence."""
        return [word for line in self.lines for word in (w.strip() for w in line.split(",")) if word]


def deck_blocks(where: str, text: str, path: Path, included: dict[str, str] | None = None) -> list[DeckBlock]:
    """Return all blocks of a deck, including those of files referred to by *INCLUDE or INPUT=.

    Parameters
    ----------
    where
        Name of the deck, for messages.
    text
        Text of the deck.
    path
        The deck; names of included files are relative to its folder.
    included
        Dictionary that receives the sha256 of each included file, by path.

    Raises
    ------
    MeshError
        If the text is no deck, or an included file is missing or includes itself.
    """
    files = _Files(path.parent, {} if included is None else included)
    blocks = list(_blocks(where, _lines(where, text, files, (path,))))
    if not blocks:
        raise MeshError(f"{where}: expected an Abaqus deck (keyword lines such as *NODE), got {text[:30]!r}")
    return blocks


@dataclass(frozen=True)
class _Line:
    text: str
    number: int
    file: str


@dataclass(frozen=True)
class _Files:
    folder: Path
    included: dict[str, str]  #: sha256 of each included file, by path


def _lines(where: str, text: str, of: _Files, files: tuple[Path, ...]) -> Iterator[_Line]:
    """Yield the non-empty lines of a deck, with the lines of included files at their place."""
    name = files[-1].name if len(files) > 1 else ""
    pending = ""
    for number, raw in enumerate(text.splitlines(), start=1):
        line = raw.strip()
        if not line or line.startswith("**"):
            continue
        if line.startswith("*") or pending:
            head = pending + line
            if head.endswith(","):  # the keyword line continues
                pending = head
                continue
            pending = ""
            yield from _with_input(where, _Line(head, number, name), of, files)
        else:
            yield _Line(line, number, name)
    if pending:
        yield from _with_input(where, _Line(pending, number, name), of, files)


def _with_input(where: str, line: _Line, of: _Files, files: tuple[Path, ...]) -> Iterator[_Line]:
    """Yield a keyword line and, if it refers to an input file, the lines of this file."""
    keyword, parameters = _head(line.text)
    if keyword != "INCLUDE":
        yield line
    given = parameters.get("INPUT", "")
    if not given or keyword not in (*_WITH_INPUT, "INCLUDE"):
        if keyword == "INCLUDE":
            raise MeshError(f"{where}, line {line.number}: *INCLUDE: expected INPUT=file, got none")
        return
    path = of.folder / given
    text = included_text(f"{where}, line {line.number}: *{keyword}, INPUT={given}", path, files, of.included)
    yield from _lines(where, text, of, (*files, path))


_WITH_INPUT = ("NODE", "ELEMENT", "NSET", "ELSET", "AMPLITUDE", "BOUNDARY", "CLOAD", "DLOAD", "SURFACE", "EQUATION")


def _blocks(where: str, lines: Iterator[_Line]) -> Iterator[DeckBlock]:
    """Yield the blocks of a deck."""
    head: _Line | None = None
    data: list[str] = []
    for line in lines:
        if line.text.startswith("*"):
            if head is not None:
                yield _block(head, data)
            head, data = line, []
        elif head is not None:
            data.append(line.text)
        elif _is_remark(line.text):
            continue
        else:
            raise MeshError(f"{where}, line {line.number}: expected a keyword line (*...), got {line.text[:40]!r}")
    if head is not None:
        yield _block(head, data)


def _is_remark(text: str) -> bool:
    """Return whether a line before the first keyword is a comment behind a stray character, such as >**."""
    return text[1:].strip("* ") == "" and "**" in text


def _head(text: str) -> tuple[str, dict[str, str]]:
    """Return keyword and parameters of a keyword line."""
    keyword, *parts = (part.strip() for part in text[1:].split(","))
    parameters = {}
    for part in parts:
        if part:
            key, _, value = part.partition("=")
            parameters[" ".join(key.upper().split())] = value.strip().strip('"')
    return " ".join(keyword.upper().split()), parameters


def _block(head: _Line, lines: list[str]) -> DeckBlock:
    return DeckBlock(*_head(head.text), lines, head.number, head.file)


def refuse_unread(where: str, blocks: list[DeckBlock]) -> None:
    """Raise `MeshError` if keywords that are not supported create or move nodes or elements."""
    for block in blocks:
        if block.keyword in _REFUSED:
            raise MeshError(f"{where}, {block.place}: *{block.keyword} is not read: {_REFUSED[block.keyword]}")
        if block.keyword == "NODE" and block.parameters.get("SYSTEM", "R").upper() != "R":
            raise MeshError(
                f"{where}, {block.place}: *NODE in a cylindrical or spherical system is not "
                f"read: write the nodes in global coordinates"
            )
