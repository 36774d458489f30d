"""A short mark of the content of a file."""

import hashlib
from pathlib import Path

__all__ = ["file_digest"]


def file_digest(path: str) -> str:
    """Return the sha256 of a file, "" if it is not there."""
    file = Path(path)
    return hashlib.sha256(file.read_bytes()).hexdigest() if path and file.is_file() else ""
