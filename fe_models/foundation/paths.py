"""Paths: words about a missing file, and files that are replaced whole or not at all."""

import os
import secrets
from pathlib import Path

from fe_models.foundation.words import nearest

__all__ = ["near_file", "replace_file"]


def near_file(path: Path) -> str:
    """Return the tail of a message about a missing file: the name in its folder that was probably meant."""
    if not path.parent.is_dir():
        return f"; the folder {path.parent} does not exist"
    hint = nearest(path.name, [p.name for p in path.parent.iterdir()])
    return hint.split("? ")[0] + "?" if "did you mean" in hint else ""


def replace_file(path: Path, *parts: bytes) -> None:
    """Write the parts beside `path`, make them durable, and give them its name in one step.

    Raises
    ------
    OSError
        If that fails; a file that was there is unchanged, and nothing is left beside it.
    """
    path = path.resolve()  # through a link, so that the link stays one
    part = path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")
    descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    try:
        with open(descriptor, "wb") as file:
            for data in parts:
                file.write(data)
            file.flush()
            os.fsync(file.fileno())
        os.replace(part, path)
    except BaseException:  # also an interrupt: the half-written file goes, the old one stays
        part.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)


def sync_folder(folder: Path) -> None:
    """Make the new name durable where the system can (not on Windows)."""
    if os.name == "posix":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
