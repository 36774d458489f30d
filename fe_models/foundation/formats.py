"""What is known about a file format of a neighbouring program: one record, for messages, `cms formats` and the docs."""

from dataclasses import dataclass

__all__ = ["FileFormat"]


@dataclass(frozen=True)
class FileFormat:
    """One format of files, as far as it is read or written here."""

    name: str  #: as its program names it
    program: str
    holds: str  #: mesh, deck, matrices, geometry, reduced body, state space, motion unit
    suffixes: tuple[str, ...]
    reads: bool = False
    writes: bool = False
    key: str = ""  #: its name in `--to` and `format =`; empty where the suffix or the content says it
    tried: str = ""  #: programs and versions whose files were read, or that read ours
    lost: str = ""  #: what it cannot hold, or what is not taken over
    extra: str = ""  #: the extra of this project that it needs
