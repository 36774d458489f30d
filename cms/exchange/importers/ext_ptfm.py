"""Superelements of OpenFAST's ExtPtfm: mass, stiffness, damping over one interface node and modes, and loads."""

import re
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from cms.errors import ForeignBodyError
from cms.exchange.importers.superelement import LARGEST, Superelement
from fe_models.files.matrices.foreign_matrices import SCALAR
from fe_models.foundation.arrays import Array

__all__ = ["is_ext_ptfm", "read_ext_ptfm"]

NODE = 1  #: number of the interface node, which the format does not number
MATRICES = {"M": "Mass", "K": "Stiffness", "D": "Damping"}


def is_ext_ptfm(path: Path, head: bytes) -> bool:
    """Whether a file is text of the format FlexASCII."""
    return b"!Mass Matrix" in head or b"!Flex 5 format" in head


def read_ext_ptfm(files: Sequence[Path], name: str, places: Mapping[int, Array]) -> Superelement:
    """Read a superelement: six dofs of its interface node, number 1, then modes; loads that do not change as "static".

    The place of the node is not in the file: it is that of node 1 in `places`, the origin where none is given.

    Raises
    ------
    ForeignBodyError
        If a matrix is missing, is not square or of another size than the others.
    """
    path = files[0]
    if len(files) > 1:
        raise ForeignBodyError(f"{path}: expected one file of ExtPtfm, got {len(files)}")
    lines = path.read_text(encoding="latin-1").splitlines()
    found = {role: matrix_after(path, lines, word) for role, word in MATRICES.items()}
    K, M = found["K"], found["M"]
    if K is None or M is None:
        raise ForeignBodyError(f"{path}: the {'mass' if M is None else 'stiffness'} matrix is missing")
    n = len(K)
    if n < 6:
        raise ForeignBodyError(f"{path}: expected six dofs of the interface node at least, got {n}")
    dofs = [(NODE, c) for c in range(6)] + [(k + 1, SCALAR) for k in range(n - 6)]
    place = np.asarray(places.get(NODE, np.zeros(3)), dtype=float)
    notes = [] if NODE in places else ["the interface node is placed at the origin: the file does not say where it is"]
    loads, note = static_load(path, lines, n)
    return Superelement(
        name=name,
        K=K,
        M=M,
        D=found["D"],
        dofs=np.array(dofs),
        node_numbers=np.array([NODE]),
        nodes=place[None],
        loads=loads,
        program="OpenFAST",
        provenance={
            "source": "OpenFAST, ExtPtfm",
            **{f"note {k + 1}": text for k, text in enumerate([*notes, *note])},
        },
    )


def matrix_after(path: Path, lines: list[str], word: str) -> Array | None:
    """Return the matrix behind its heading, None where there is none."""
    starts = [k for k, line in enumerate(lines) if line.startswith(f"!{word} Matrix")]
    if not starts:
        return None
    if len(starts) > 1:
        raise ForeignBodyError(f"{path}: there are two {word.lower()} matrices")
    size = re.search(r"\d+", lines[starts[0] + 1]) if starts[0] + 1 < len(lines) else None
    if size is None:
        raise ForeignBodyError(f"{path}, line {starts[0] + 2}: expected the dimension of the {word.lower()} matrix")
    n = int(size[0])
    if n > LARGEST:
        raise ForeignBodyError(f"{path}, line {starts[0] + 2}: {n} rows are no reduced body")
    rows = [numbers_of(path, starts[0] + 3 + k, line) for k, line in enumerate(lines[starts[0] + 2 :][:n])]
    if len(rows) != n or any(len(row) != n for row in rows):
        got = f"{len(rows)} rows" if len(rows) != n else f"a row of {next(len(r) for r in rows if len(r) != n)}"
        raise ForeignBodyError(f"{path}: {word.lower()} matrix: expected {n} rows of {n} numbers, got {got}")
    return np.array(rows)


def static_load(path: Path, lines: list[str], n: int) -> tuple[dict[str, Array], list[str]]:
    """Return the loads as a load case where they do not change with time, and a note where they do."""
    starts = [k for k, line in enumerate(lines) if line.startswith("!Loading")]
    if not starts:
        return {}, []
    first = starts[0] + 1
    rows = [numbers_of(path, first + k + 1, x) for k, x in enumerate(lines[first:]) if x.strip() and x[0] != "!"]
    if not rows or any(len(row) < n + 1 for row in rows):
        raise ForeignBodyError(f"{path}: loading: expected a time and {n} forces in each row")
    forces = np.array([row[1 : n + 1] for row in rows])
    if np.ptp(forces, axis=0).max() > 1e-12 * np.abs(forces).max(initial=1e-300):
        return {}, [f"loads over {len(rows)} times are not taken over: load cases here are constant"]
    return ({"static": forces[0]} if forces.any() else {}), []


def numbers_of(path: Path, line: int, text: str) -> list[float]:
    """Return the numbers of a line."""
    try:
        return [float(word.replace("D", "E")) for word in text.split()]
    except ValueError as error:
        raise ForeignBodyError(f"{path}, line {line}: {error}") from None
