"""Files that differ from a given text in a few places."""

from pathlib import Path

__all__ = ["changed_file"]


def changed_file(path: Path, text: str, *changes: tuple[str, str]) -> Path:
    """Write the text with the first place of each old part replaced by the new part; every old part must be there."""
    for old, new in changes:
        assert old in text, old
        text = text.replace(old, new, 1)
    path.write_text(text)
    return path
