"""The sources of compiled kernels: a module and all modules of the project that it imports.

Kernels take codes and constants from modules outside their folder, whose change must reach them as well.
"""

import hashlib
import re
from pathlib import Path

__all__ = ["imported_modules", "source_digest", "source_files"]

ROOT = Path(__file__).parents[4]  #: folder of the packages
PACKAGES = ("cms", "fe_models", "floatframe")
#: an import statement: the module and the names of `from`, or the modules
STATEMENT = re.compile(
    r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]*(\([^)]*\)|[^\n#]*)|import[ \t]+([^\n#]*))", re.MULTILINE
)


def imported_modules(text: str) -> set[str]:
    """Return the names in the import statements of a source: modules, and names in them, which may be modules too."""
    found = set()
    for module, names, plain in STATEMENT.findall(text):
        words = re.findall(r"[\w.]+", re.sub(r"#[^\n]*|\bas[ \t]+\w+", "", names or plain))
        found |= {module, *(f"{module}.{word}" for word in words)} if module else set(words)
    return {name for name in found if name.split(".")[0] in PACKAGES}


def source_files(module: str, root: Path = ROOT) -> list[Path]:
    """Return the files of a module of the project and of all that it imports, in a fixed order."""
    known: set[Path] = set()
    left = [module]
    while left:
        place = root.joinpath(*left.pop().split("."))
        for path in (place.with_suffix(".py"), place / "__init__.py"):
            if path.is_file() and path not in known:
                known.add(path)
                left += imported_modules(path.read_text(encoding="utf-8"))
    return sorted(known)


def source_digest(module: str, *extra: str, root: Path = ROOT) -> int:
    """Return a positive key that changes with the source of a module, of all that it imports, and with `extra`."""
    digest = hashlib.sha256(repr(extra).encode())
    for path in source_files(module, root):
        text = path.read_bytes()
        digest.update(repr((path.relative_to(root).as_posix(), len(text))).encode() + text)
    return int.from_bytes(digest.digest()[:7], "big") + 1
