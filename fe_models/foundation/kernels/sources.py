"""The sources of compiled kernels: a module and all modules of the project that it imports.

Kernels use codes and constants of modules outside their folder, and must be compiled again if these change. Only the
syntax of the sources decides whether kernels are compiled again; comments, docstrings and line breaks do not matter.
"""

import ast
import gc
import hashlib
import os
import re
import sys
from functools import cache
from pathlib import Path
from types import CodeType

__all__ = ["PACKAGES", "ROOT", "digests", "imported_modules", "names_of", "source_files"]

ROOT = Path(__file__).parents[3]  #: folder of the packages
PACKAGES = ("cms", "fe_models", "floatframe")
#: an import statement: module and names after `from`, or the imported modules
STATEMENT = re.compile(
    r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]*(\([^)]*\)|[^\n#]*)|import[ \t]+([^\n#]*))", re.MULTILINE
)


def imported_modules(text: str) -> set[str]:
    """Return the names in the import statements of a source; a name imported from a module may itself be a module."""
    found = set()
    for module, names, plain in STATEMENT.findall(text):
        words = re.findall(r"[\w.]+", re.sub(r"#[^\n]*|\bas[ \t]+\w+", "", names or plain))
        found |= {module, *(f"{module}.{word}" for word in words)} if module else set(words)
    return {name for name in found if name.split(".")[0] in PACKAGES}


def source_files(module: str, root: Path = ROOT) -> list[Path]:
    """Return the files of a project module and of all modules that it imports, in a fixed order."""
    known: set[Path] = set()
    left = [module]
    while left:
        place = root.joinpath(*left.pop().split("."))
        for path in (place.with_suffix(".py"), place / "__init__.py"):
            if path.is_file() and path not in known:
                known.add(path)
                left += imported_modules(path.read_text(encoding="utf-8"))
    return sorted(known)


def digests(module: str, root: Path = ROOT) -> tuple[int, int]:
    """Return two positive keys of a module and of all that it imports: of their syntax, and of their texts.

    Syntax trees take a few tenths of a second. Therefore a file stores the last key of the syntax together with that of
    the texts. If no file can be written, as in an installation of another user, both are that of the texts.
    """
    texts = {path.relative_to(root).as_posix(): path.read_bytes() for path in source_files(module, root)}
    whole = digest_of(texts)
    record = record_of(root, module)
    try:
        read, key = record.read_text(encoding="ascii").split()
        if read == f"{whole:x}":
            return int(key, 16), whole
    except (OSError, ValueError):  # there is no record yet, or it is incomplete
        pass
    key_of_syntax = digest_of({name: syntax_of(text) for name, text in texts.items()})
    return key_of_syntax if keep(record, f"{whole:x} {key_of_syntax:x}") else whole, whole


def digest_of(texts: dict[str, bytes]) -> int:
    """Return a positive hash of 56 bits."""
    digest = hashlib.sha256()
    for name, text in texts.items():
        digest.update(repr((name, len(text))).encode() + text)
    return int.from_bytes(digest.digest()[:7], "big") + 1


@cache
def syntax_of(text: bytes) -> bytes:
    """Return a digest of the syntax tree of a source without comments, docstrings and numbers of lines."""
    was_enabled = gc.isenabled()
    gc.disable()  # otherwise half of the time is spent on garbage collection among the nodes
    try:
        tree = ast.parse(text)
        for node in ast.walk(tree):
            if isinstance(node, DOCUMENTED) and ast.get_docstring(node, clean=False) is not None:
                node.body = node.body[1:]
        return hashlib.sha256(ast.dump(tree, annotate_fields=False).encode()).digest()
    finally:
        if was_enabled:
            gc.enable()


DOCUMENTED = (ast.Module, ast.ClassDef, ast.FunctionDef, ast.AsyncFunctionDef)


def record_of(root: Path, module: str) -> Path:
    """Return the file that stores the key of a module, one for each Python version because syntax trees differ."""
    return root / PACKAGES[-1] / "__pycache__" / f"{module}-{sys.implementation.cache_tag}.key"


def keep(record: Path, words: str) -> bool:
    """Write a record completely or not at all; return whether it was written."""
    part = record.with_name(f"{record.name}.{os.getpid()}")
    try:
        record.parent.mkdir(exist_ok=True)
        part.write_text(words, encoding="ascii")
        part.replace(record)
    except OSError:
        return False
    return True


def names_of(code: CodeType) -> list[str]:
    """Return the names used in a code object and in the code objects inside it, in a fixed order."""
    found = list(code.co_names)
    for each in code.co_consts:
        if isinstance(each, CodeType):
            found += names_of(each)
    return list(dict.fromkeys(found))
