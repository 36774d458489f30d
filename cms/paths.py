"""Words about paths for messages."""

from pathlib import Path

from cms.words import nearest

__all__ = ["near_file"]


def near_file(path: Path) -> str:
    """Return the tail of a message about a missing file: the name in its folder that was probably meant."""
    if not path.parent.is_dir():
        return f"; the folder {path.parent} does not exist"
    hint = nearest(path.name, [p.name for p in path.parent.iterdir()])
    return hint.split("? ")[0] + "?" if "did you mean" in hint else ""
