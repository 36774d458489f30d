"""The text of a deck of Nastran with the files that it includes."""

from hashlib import sha256
from pathlib import Path

from fe_models.errors import MeshError
from fe_models.foundation.paths import near_file

__all__ = ["bulk_text"]

DEEPEST = 10  #: levels of files that include files


def bulk_text(where: str, path: Path, text: str, included: dict[str, str], files: tuple[Path, ...] = ()) -> str:
    """Return a deck with its includes put in, and without the BEGIN BULK and ENDDATA of these.

    Parameters
    ----------
    where, path, text
        For messages; of the deck.
    included
        Is filled: path of each included file -> its sha256.
    files
        The files that this one is included in.

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
            while statement.count("'") % 2 and k + 1 < len(lines):  # names may go on over lines
                k += 1
                statement += lines[k].partition("$")[0].strip()
            name = statement[7:].strip().strip("'\" =")
            other = path.parent / name
            if other in files or other == path or len(files) >= DEEPEST:
                raise MeshError(f"{where}: INCLUDE {name}: includes itself, or files nest too deeply")
            try:
                inner = other.read_bytes()
            except OSError as error:
                if is_first and any(each.lstrip().upper().startswith("CEND") for each in lines[k:]):
                    k += 1  # statements above CEND run the program: what they include is no part of a body
                    continue
                raise MeshError(
                    f"{where}: INCLUDE {name}: {other} cannot be read: {error.strerror or error}{near_file(other)}"
                ) from error
            included[str(other)] = sha256(inner).hexdigest()
            out.append(bulk_text(where, other, inner.decode("utf-8", "replace"), included, (*files, path)))
        elif head.startswith("ENDDATA") and not is_first:
            break
        elif head.startswith("BEGIN") and "SUPER" in head:
            raise MeshError(f"{where}: {line.strip()}: a deck of several superelements; expected one body")
        elif head.startswith("BEGIN") and (not is_first or any(_is_begin(each) for each in out)):
            pass  # a second BEGIN BULK says nothing
        else:
            out.append(line)
        k += 1
    return "\n".join(out)


def _is_begin(line: str) -> bool:
    return any(each.lstrip().upper().startswith("BEGIN") for each in line.splitlines())
