"""Text of a Nastran deck including its include files, and its sections: main bulk data and superelements."""

import re
from pathlib import Path

from fe_models.errors import MeshError
from fe_models.files.included import included_text

__all__ = ["bulk_parts", "bulk_text"]

SECTION = re.compile(r"(?i)\s*BEGIN(?:\s+BULK)?(?:\s+SUPER\s*=?\s*(\d+))?\s*")


def bulk_text(where: str, path: Path, text: str, included: dict[str, str], files: tuple[Path, ...] = ()) -> str:
    """Return a deck with its include files inserted, without their BEGIN BULK and ENDDATA lines.

    Parameters
    ----------
    where, path, text
        Name (for messages), path and text of the deck.
    included
        Dictionary that receives the sha256 of each included file, by path.
    files
        Files that include this one.

    Raises
    ------
    MeshError
        If a file is missing or includes itself.
    """
    out, is_first = [], not files
    lines = text.splitlines()
    k = 0
    while k < len(lines):
        line = lines[k]
        head = line.lstrip().upper()
        if head.startswith("INCLUDE"):
            statement = line.partition("$")[0].strip()
            while statement.count("'") % 2 and k + 1 < len(lines):  # names may continue on the next lines
                k += 1
                statement += lines[k].partition("$")[0].strip()
            name = statement[7:].strip().strip("'\" =")
            other = path.parent / name
            if is_first and not other.is_file() and any(each.lstrip().upper().startswith("CEND") for each in lines[k:]):
                k += 1  # statements above CEND control the program; their include files are not part of a body
                continue
            around = (*files, path)
            inner = included_text(f"{where}: INCLUDE {name}", other, around, included)
            out.append(bulk_text(where, other, inner, included, around))
        elif head.startswith("ENDDATA") and not is_first:
            break
        elif head.split()[:1] == ["BEGIN"]:
            if is_first or _section(where, line):  # BEGIN BULK of an included file has no meaning
                out.append(line)
        else:
            out.append(line)
        k += 1
    return "\n".join(out)


def bulk_parts(where: str, text: str) -> dict[int, str]:
    """Return the text of each section: 0 for the main bulk data, otherwise the number of the superelement.

    Each text has as many lines as the deck, so that messages name the right line.

    Raises
    ------
    MeshError
        If a section is of another kind.
    """
    lines = text.splitlines()
    begins = [k for k, line in enumerate(lines) if line.split()[:1] and line.split()[0].upper() == "BEGIN"]
    if len(begins) < 2:
        return {0: text}
    made: dict[int, list[str]] = {0: [""] * len(lines)}
    end = next((k for k, line in enumerate(lines) if line.lstrip()[:7].upper() == "ENDDATA"), len(lines))
    for first, last in zip(begins, [*begins[1:], end], strict=True):
        mine = made.setdefault(_section(where, lines[first]), [""] * len(lines))
        mine[first:last] = lines[first:last] if not any(mine) else ["", *lines[first + 1 : last]]
    return {number: "\n".join(mine) for number, mine in made.items()}


def _section(where: str, line: str) -> int:
    """Return the superelement number in a BEGIN line; 0 for the main bulk data."""
    match = SECTION.fullmatch(line.partition("$")[0])
    if match is None:
        raise MeshError(f"{where}: {line.strip()}: expected BEGIN BULK or BEGIN SUPER = n; other sections are not read")
    return int(match[1] or 0)
