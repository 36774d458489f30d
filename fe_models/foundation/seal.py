"""The seal of a file: 512 bytes of text before its HDF5 part, by which every change of a later byte is detected.

HDF5 readers skip these bytes (the "user block"). They contain the length of the file and the sha256 of all following
bytes. Both are compared before HDF5 opens the file, because HDF5 may hang, crash or use all memory on damaged
structures.
"""

import hashlib
import re
from dataclasses import dataclass
from pathlib import Path
from typing import IO

from fe_models.foundation.paths import near_file

__all__ = ["SEAL_SIZE", "Kind", "altered", "check_seal", "newer", "reason", "seal_of", "truncated"]

SEAL_SIZE = 512  #: bytes of the seal; the smallest user block of HDF5
BLOCK = 1 << 20  #: number of bytes that are hashed at a time


@dataclass(frozen=True)
class Kind:
    """A kind of sealed file, and the error that reports its faults."""

    format: str  #: name of the format in the seal and in messages, one word
    version: int  #: version of the format; a reader rejects later versions
    error: type[Exception]  #: error class; its text is written for the user
    writer: str  #: command or function that writes such files; messages name it
    stored: str = ""  #: root attribute `format` of the HDF5 part; "": that of the seal


def seal_of(file: IO[bytes], kind: Kind) -> bytes:
    """Return the seal of an open file that has 512 free bytes before its HDF5 part."""
    file.seek(SEAL_SIZE)
    digest, n_bytes = hashlib.sha256(), SEAL_SIZE
    while block := file.read(BLOCK):
        digest.update(block)
        n_bytes += len(block)
    return seal_text(kind.format, kind.version, n_bytes, digest.hexdigest())


def seal_text(format: str, version: int, n_bytes: int, sha256: str) -> bytes:
    """Return the seal: four lines of ASCII, padded with spaces to 512 bytes."""
    text = (
        f"floatframe {format} {version}\n"
        f"bytes {n_bytes}\n"
        f"sha256 {sha256}\n"
        f"HDF5 begins at byte {SEAL_SIZE}; sha256 is that of all bytes from there to the end.\n"
    )
    return text.encode("ascii").ljust(SEAL_SIZE - 1) + b"\n"


def check_seal(path: Path, kind: Kind) -> bool:
    """Compare the file with its seal, and raise an error if they differ; return False if the file has no seal.

    Raises
    ------
    Exception
        The error of the kind, if the file is missing, of a later version, truncated or altered.
    """
    try:
        if path.exists() and not path.is_file():  # a pipe would block, and a device may have no end
            what = "a folder" if path.is_dir() else "a device or a pipe"
            raise kind.error(f"{path}: cannot be read: expected a {kind.format}, got {what}")
        with open(path, "rb") as file:
            head = file.read(SEAL_SIZE)
            sha256 = hashlib.file_digest(file, "sha256").hexdigest()
            n_bytes = file.tell()
    except FileNotFoundError:
        raise kind.error(f"{path}: no such file{near_file(path)}") from None
    except OSError as error:
        raise kind.error(f"{path}: cannot be read: {reason(error)}") from error
    magic = f"floatframe {kind.format} ".encode("ascii")
    if not head.startswith(magic):
        if head and magic.startswith(head):
            raise truncated(path, kind, f"at least {SEAL_SIZE} bytes", n_bytes)
        other = re.match(rb"floatframe ([a-z-]{3,30}) \d{1,9}\nbytes ", head)
        if other and other[1].decode() != kind.format:
            raise kind.error(
                f"{path}: expected a {kind.format}, got a {other[1].decode()}; a {kind.format} is written by "
                f"{kind.writer}"
            )
        return False  # a repacked file or a damaged seal; the check of the HDF5 part decides
    stated = re.match(rb"(\d{1,9})\nbytes (\d{1,18})\n", head[len(magic) :])
    if stated and int(stated[1]) > kind.version:
        raise newer(path, kind, int(stated[1]))
    if len(head) < SEAL_SIZE:
        raise truncated(path, kind, f"at least {SEAL_SIZE} bytes", n_bytes)
    if stated is None:
        raise altered(path, kind, "its seal cannot be read")
    if n_bytes < int(stated[2]):
        raise truncated(path, kind, f"{int(stated[2])} bytes", n_bytes)
    if head != seal_text(kind.format, int(stated[1]), n_bytes, sha256):
        raise altered(path, kind, "its bytes do not have the sha256 of its seal")
    return True


def truncated(path: Path, kind: Kind, expected: str, n_bytes: int) -> Exception:
    """Return the error of a file that is too short."""
    return kind.error(
        f"{path}: this {kind.format} is truncated: expected {expected}, got {n_bytes}; copy it again or write it again"
    )


def altered(path: Path, kind: Kind, detail: str) -> Exception:
    """Return the error of a file that was changed after it was written."""
    return kind.error(
        f"{path}: this {kind.format} was altered since it was written: {detail}; copy it again or write it again"
    )


def newer(path: Path, kind: Kind, got: int) -> Exception:
    """Return the error of a file from a later version of this program."""
    return kind.error(
        f"{path}: this {kind.format} has format version {got}, this program reads versions up to {kind.version}; "
        "update the program (pip install -U floatframe)"
    )


def reason(error: BaseException) -> str:
    """Return the first line of the text of an error."""
    text = str(getattr(error, "strerror", None) or error or type(error).__name__)
    return text.splitlines()[0][:200]
