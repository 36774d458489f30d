"""File formats of other programs: one record each, which dispatch, messages, `cms formats` and the docs read."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Generic, TypeVar

from fe_models.foundation.words import nearest, quoted

__all__ = ["HEAD", "Format", "ReadFormat", "by_suffix", "format_of"]

HEAD = 4096  #: number of first bytes that identify the format of a file


@dataclass(frozen=True)
class Format:
    """One file format, with what this project reads or writes of it."""

    name: str  #: name of the format in its own program
    program: str
    holds: str  #: content: mesh, deck, matrices, geometry or reduced body
    suffixes: tuple[str, ...]  #: usual suffixes; the first one is added to file names without suffix
    reads: bool = True
    writes: bool = False
    key: str = ""  #: value for `--to` and `--format`; empty if the suffix or the content identifies the format
    tried: str = ""  #: programs and versions whose files were read here, or which read our files
    lost: str = ""  #: content that the format cannot hold, or that is not read
    extra: str = ""  #: extra of this project that the format needs

    def __str__(self) -> str:
        return f"{self.name} ({self.program})"

    def record(self) -> dict[str, Any]:
        """Return the fields of every format, without functions, for JSON."""
        return {each.name: getattr(self, each.name) for each in fields(Format)}


def anything(head: bytes) -> bool:
    """Return True, for formats whose suffix identifies them."""
    return True


Reader = TypeVar("Reader")


@dataclass(frozen=True)
class ReadFormat(Format, Generic[Reader]):
    """A format with its reader, and the test of the first bytes of a file of this format."""

    read: Reader = field(kw_only=True)
    is_it: Callable[[bytes], bool] = field(default=anything, kw_only=True)


AnyFormat = TypeVar("AnyFormat", bound=Format)


def by_suffix(formats: Iterable[AnyFormat]) -> dict[str, AnyFormat]:
    """Return the format of each suffix."""
    return {suffix: known for known in formats for suffix in known.suffixes}


def format_of(
    where: str, path: Path, head: bytes, formats: Iterable[ReadFormat[Reader]], error: type[Exception]
) -> ReadFormat[Reader]:
    """Return the first format that has the suffix of a file and recognises its first bytes; raise `error` otherwise."""
    formats = list(formats)
    suffix = path.suffix.lower()
    mine = [known for known in formats if suffix in known.suffixes]
    if not mine:
        raise error(f"{where}: unknown suffix {quoted(suffix)}{nearest(suffix, by_suffix(formats))}")
    for known in mine:
        if known.is_it(head):
            return known
    expected = " or ".join(str(known) for known in mine)
    raise error(f"{where}: expected {expected}, got a file that begins with {quoted(head[:30])}")
