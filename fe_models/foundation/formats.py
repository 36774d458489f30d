"""Record of a file format of another program, used in messages, by `cms formats` and in the docs."""

from dataclasses import dataclass

__all__ = ["FileFormat"]


@dataclass(frozen=True)
class FileFormat:
    """One file format, with what this project reads or writes of it."""

    name: str  #: name of the format in its own program
    program: str
    holds: str  #: content: mesh, deck, matrices, geometry, reduced body, state space or motion unit
    suffixes: tuple[str, ...]
    reads: bool = False
    writes: bool = False
    key: str = ""  #: value for `--to` and `format =`; empty if the suffix or the content identifies the format
    tried: str = ""  #: programs and versions whose files were read here, or which read our files
    lost: str = ""  #: content that the format cannot hold, or that is not read
    extra: str = ""  #: extra of this project that the format needs
