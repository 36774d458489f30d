"""Text of files that a deck includes."""

from hashlib import sha256
from pathlib import Path

from fe_models.errors import MeshError
from fe_models.foundation.paths import near_file

__all__ = ["included_text"]

DEEPEST = 10  #: largest depth of nested include files


def included_text(where: str, path: Path, files: tuple[Path, ...], included: dict[str, str]) -> str:
    """Return the text of an included file, and record its sha256.

    Parameters
    ----------
    where
        Deck and statement, for messages.
    path
        The included file.
    files
        Files that include it, from the deck on.
    included
        Dictionary that receives the sha256 of each included file, by path.

    Raises
    ------
    MeshError
        If the file is missing or includes itself.
    """
    if path in files or len(files) > DEEPEST:
        raise MeshError(f"{where}: {path} includes itself, or files nest too deeply")
    try:
        data = path.read_bytes()
    except OSError as error:
        raise MeshError(f"{where}: {path} cannot be read: {error.strerror or error}{near_file(path)}") from error
    included[str(path)] = sha256(data).hexdigest()
    return data.decode("utf-8", "replace")
