"""Common parts of all writers of foreign formats: request, result, header, and lists of lost data."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from importlib import metadata
from pathlib import Path
from unicodedata import combining, normalize

import numpy as np

from cms.body.reduced_body import ReducedBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.formats import Format
from fe_models.foundation.words import shortened

__all__ = ["CONTENT", "Request", "Writer", "WrittenFiles", "in_ascii", "left_out"]

OWN_AXES = "axes of the interfaces that are rotated relative to those of the file"
TURNED = 1e-12  #: difference between direction cosines, above which it is more than rounding


def is_turned(axes: Array) -> bool:
    """Return whether the axes of an interface differ from those of the file."""
    return bool(np.abs(axes - np.eye(3)).max() > TURNED)


#: content of a body in addition to masses, stiffness and shapes: description, and whether a body has it
CONTENT: dict[str, tuple[str, Callable[[ReducedBody], bool]]] = {
    "gyroscopic": (
        "inertia of the deformed body beyond its mass matrix (3C, 4C, 5C: Coriolis and centrifugal terms)",
        lambda body: body.n_q > 0 and not body.is_held,
    ),
    "geometric": ("geometric stiffness", lambda body: body.geometric is not None),
    "quadratic": ("displacements of second order", lambda body: body.quadratic is not None),
    "damping": ("modal damping", lambda body: bool(np.any(body.D))),
    "interfaces": ("names of the interfaces", lambda body: bool(body.interfaces)),
    "axes in B": (OWN_AXES, lambda body: any(is_turned(each.triad) for each in body.interfaces)),
    "axes in the mesh": (OWN_AXES, lambda body: any(is_turned(body.frame.axes @ x.triad) for x in body.interfaces)),
    "rotation": ("rotations of the interfaces", lambda body: any(each.has_rotation for each in body.interfaces)),
    "load cases": ("load cases", lambda body: bool(body.load_cases)),
    "stress": ("stress of the modes", lambda body: body.stress is not None),
    "point stress": ("stress at named points", lambda body: body.point_stress is not None),
    "surface": ("surface for drawing", lambda body: len(body.surface) > 0),
}
#: ASCII replacements for characters of formulas and units
IN_ASCII = str.maketrans(
    {"ᵀ": "^T", "²": "^2", "³": "^3", "·": "*", "×": "x", "≤": "<=", "≥": ">=", "−": "-", "–": "-", "ß": "ss", "µ": "u"}
)


@dataclass(frozen=True)
class Request:
    """Export request: a body in the requested units, the path, and the source of the body."""

    body: ReducedBody
    path: Path  #: requested file; additional files use its stem
    source: str = ""  #: name and digest of the modal file
    nodes: str = "default"  #: "interfaces" or "all" kept nodes, in formats that allow a choice
    loads: Mapping[str, float] = field(default_factory=dict)  #: amplitudes of load cases that act permanently

    def header(self) -> tuple[str, ...]:
        """Return ASCII lines with body, source, units, frame and provenance."""
        body = self.body
        origin = " ".join(f"{x:.9g}" for x in body.frame.origin)
        place = f"{body.frame.kind} at {body.frame.at}" if body.frame.at else body.frame.kind
        lines = [
            f"flexible body {body.name!r}, {body.n_q} modes, written by floatframe {own_version()}",
            f"units {body.units.name}: {body.units.length_symbol}, {body.units.mass_symbol}, {body.units.time_symbol}",
            f"frame {place}, its origin in the mesh: {origin}",
        ]
        if self.source:
            lines.insert(1, f"from {self.source}")
        lines += [f"{key}: {value}" for key, value in body.provenance.items()]
        return tuple(in_ascii(line) for line in lines)


@dataclass(frozen=True)
class WrittenFiles:
    """Content of each file as bytes, and notes about the files."""

    files: Mapping[Path, bytes]
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, kw_only=True)
class Writer(Format):
    """Format in which a reduced body is written: its function, and the data that it can hold."""

    reads: bool = False
    writes: bool = True
    make: Callable[[Request], WrittenFiles]
    content: frozenset[str]  #: keys of `CONTENT` that the format can hold
    takes_held: bool = False  #: whether the format can describe a body that is fixed to the ground
    takes_loads: bool = False  #: whether the file can hold constant loads
    units: str = ""  #: the only unit system that the program accepts; empty: all systems
    needs: tuple[str, ...] = ()  #: data that a body must have: "nodes", "interfaces"


def left_out(body: ReducedBody, content: Iterable[str]) -> tuple[str, ...]:
    """Describe the data of a body that a format cannot hold, given the content that it can hold."""
    held = set(content)
    return tuple(words for key, (words, has) in CONTENT.items() if key not in held and has(body))


def in_ascii(text: str) -> str:
    """Return a text as one line of ASCII; letters lose their accents."""
    line = " ".join(text.split()).translate(IN_ASCII)
    line = "".join(letter for letter in normalize("NFKD", line) if not combining(letter)).translate(IN_ASCII)
    line = line.encode("ascii", "replace").decode("ascii")
    return shortened(line, 200)


def own_version() -> str:
    """Return the version of this project."""
    try:
        return metadata.version("floatframe")
    except metadata.PackageNotFoundError:  # the program runs from a checkout that is not installed
        return "(not installed)"
