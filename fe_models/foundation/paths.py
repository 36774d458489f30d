"""Files: reading with one message for each fault, and atomic replacement, but never of devices and pipes."""

import hashlib
import os
import re
import secrets
import stat
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from difflib import get_close_matches
from glob import escape
from pathlib import Path

from fe_models.foundation.words import damage, did_you_mean

__all__ = [
    "bytes_of", "file_digest", "file_identity", "file_state", "is_stream", "near_file", "reading", "remove_parts",
    "replace_file", "replace_files", "same_file", "sync_folder",
]  # fmt: skip

OWN_DESCRIPTOR = re.compile(r"/(?:dev|proc/self)/fd/(\d{1,6})")
STANDARD = {"/dev/stdout": 1, "/dev/stderr": 2}


def near_file(path: Path) -> str:
    """Return the end of a message about a missing file: the most similar name in its folder.

    A file of TOML, such as the job that names a mesh, is proposed for a suffix like its own (.tmol), or for none.
    """
    if not path.parent.is_dir():
        return f"; the folder {path.parent} does not exist"
    wants_toml = not path.suffix or bool(get_close_matches(path.suffix.lower(), [".toml"]))
    return did_you_mean(path.name, [p.name for p in path.parent.iterdir() if wants_toml or p.suffix != ".toml"])


def bytes_of(
    where: str, path: Path, error: type[Exception], *, n: int = -1, hint: Callable[[Path], str] = near_file
) -> bytes:
    """Return the bytes of a file; raise `error` if it is missing, a folder, unreadable or empty.

    Parameters
    ----------
    where
        Name of the file, for messages.
    n
        Largest number of bytes from the start of the file; -1 for all.
    hint
        Returns the end of the message about a missing file.
    """
    if not path.exists():
        raise error(f"{where}: there is no such file{hint(path)}")
    if path.is_dir():
        raise error(f"{where}: expected a file, got a folder")
    try:
        with path.open("rb") as file:
            content = file.read(n)
    except OSError as failure:
        raise error(f"{where}: cannot be read: {failure.strerror or failure}") from failure
    if not content or content.isspace():
        raise error(f"{where}: the file is empty")
    return content


@contextmanager
def reading(
    where: str, path: Path, known: object, error: type[Exception], own: type[Exception] | tuple[type[Exception], ...]
) -> Iterator[None]:
    """Turn every error of a reader, such as those caused by a damaged file, into one message.

    Parameters
    ----------
    where, path
        Name of the file for messages, and its path.
    known
        Format of the file, for messages.
    error
        Class of the message.
    own
        Errors that already have a message for the user; they are raised unchanged.
    """
    try:
        yield
    except own:
        raise
    except MemoryError as failure:
        size = path.stat().st_size
        raise error(f"{where}: not enough memory to read {size / 1e6:.0f} MB as {known}") from failure
    except (Exception, SystemExit) as failure:
        raise error(f"{where}: could not be read as {known}: {damage(failure)}") from failure


def file_digest(path: str | Path) -> str:
    """Return the sha256 of a file, read in blocks; "" if the file does not exist."""
    if not path or not Path(path).is_file():
        return ""
    with Path(path).open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def file_state(path: str | Path) -> tuple[int, ...] | None:
    """Return numbers that differ after a file has changed: size, times of the changes, inode; None: there is no file.

    A program can set the time of a change of content, as `cp -p` does, but not that of a change of the inode.
    """
    try:
        found = os.stat(path)
    except OSError:
        return None
    return found.st_size, found.st_mtime_ns, found.st_ctime_ns, found.st_ino


def own_descriptor(path: Path) -> int | None:
    """Return the open file descriptor to which a path such as /dev/stdout refers; None for an ordinary path."""
    text = os.path.abspath(path)
    found = OWN_DESCRIPTOR.fullmatch(text)
    return int(found[1]) if found else STANDARD.get(text)


def is_stream(path: Path) -> bool:
    """Whether a path is written directly and never replaced: a device, a pipe, a socket, /dev/stdout."""
    if own_descriptor(path) is not None:
        return True
    try:
        mode = path.stat().st_mode  # follows links
    except OSError:
        return False
    return not (stat.S_ISREG(mode) or stat.S_ISDIR(mode))


def file_identity(path: Path) -> tuple[int, int] | Path:
    """Return an identifier that all paths to one file share, also through links, even if it does not exist yet."""
    try:
        found = path.stat()
    except OSError:
        return path.resolve()
    return found.st_dev, found.st_ino


def same_file(path: Path, other: Path) -> bool:
    """Whether two paths refer to the same file, also through links, or would do so if it existed."""
    return file_identity(path) == file_identity(other)


def replace_file(path: Path, *parts: bytes | memoryview) -> None:
    """Write the parts to a temporary file beside `path`, flush it to disk, and rename it in one step.

    A device or a pipe receives the bytes directly.

    Raises
    ------
    OSError
        If writing fails. An existing file is then unchanged, and no temporary file is left.
    """
    if is_stream(path):
        write_stream(path, *parts)
        return
    path = path.resolve()  # resolve a link, so that it remains a link
    part = part_of(path)
    try:
        write_part(part, *parts)
        os.replace(part, path)
    except BaseException:  # also on an interrupt: remove the half-written file and keep the old one
        part.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)


def replace_files(contents: Mapping[Path, bytes]) -> None:
    """Write files that belong together: all are complete on disk under temporary names before the first is renamed.

    A device or a pipe receives its bytes after the files have been renamed.

    Raises
    ------
    OSError
        If a file cannot be written. No file is then changed, and no temporary file is left.
    """
    files = {path.resolve(): data for path, data in contents.items() if not is_stream(path)}
    parts = {path: part_of(path) for path in files}
    try:
        for path, data in files.items():
            write_part(parts[path], data)
        for path, part in parts.items():
            os.replace(part, path)
    except BaseException:
        for part in parts.values():
            part.unlink(missing_ok=True)
        raise
    for folder in {path.parent for path in files}:
        sync_folder(folder)
    for path, data in contents.items():
        if is_stream(path):
            write_stream(path, data)


def part_of(path: Path) -> Path:
    """Return the temporary name under which new content of a file is written."""
    return path.with_name(f".{path.name}.{secrets.token_hex(4)}.part")


def remove_parts(path: Path) -> None:
    """Remove temporary files that killed processes have left."""
    for part in path.parent.glob(f".{escape(path.name)}.????????.part"):
        part.unlink(missing_ok=True)


def write_part(part: Path, *parts: bytes | memoryview) -> None:
    """Write a new file and flush it to disk."""
    descriptor = os.open(part, os.O_WRONLY | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0), 0o666)
    with open(descriptor, "wb") as file:
        for data in parts:
            file.write(data)
        file.flush()
        os.fsync(file.fileno())


def write_stream(path: Path, *parts: bytes | memoryview) -> None:
    """Write the parts to a device or a pipe; for standard output, after earlier output."""
    own = own_descriptor(path)
    for stream in (sys.stdout, sys.stderr):
        stream.flush()
    descriptor = os.open(path, os.O_WRONLY) if own is None else os.dup(own)
    with open(descriptor, "wb") as file:
        for data in parts:
            file.write(data)


def sync_folder(folder: Path) -> None:
    """Flush the directory entry of a new file to disk where the system supports it (not on Windows)."""
    if os.name == "posix":
        descriptor = os.open(folder, os.O_RDONLY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)
