"""ExtPtfm of OpenFAST: a superelement with one interface node and its fixed-interface modes, read and written."""

import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np

from cms.errors import ExportError, ForeignBodyError
from cms.exchange.exporters.writer import Request, WrittenFiles
from cms.exchange.importers.superelement import LARGEST, Superelement
from cms.reduction.interface_model import InterfaceModel, interface_model
from fe_models.files.matrices.foreign_matrices import SCALAR
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted

__all__ = ["is_ext_ptfm", "make_ext_ptfm", "read_ext_ptfm"]


# ext ptfm -------------------------------------------------------------------------------------------------------------
# OpenFAST's ExtPtfm: a superelement with one interface node and its fixed-interface modes (format FlexASCII).


LAST_TIME = 10000.0  #: end of the time range in which the loads are constant, from zero [s]


def make_ext_ptfm(request: Request) -> WrittenFiles:
    """Return the file: mass, stiffness and damping (x, y, z, rotations about them, modes), and constant loads.

    Raises
    ------
    ExportError
        If the body does not have exactly one interface with six dofs, or a load case is unknown.
    """
    body = request.body
    if len(body.interfaces) != 1:
        names = ", ".join(interface.name for interface in body.interfaces)
        raise ExportError(
            f"export to ext_ptfm: the format has one interface node, body {body.name!r} has {len(body.interfaces)} "
            f"({names}); reduce it only with the interface that carries the tower"
        )
    model = interface_model(body)
    if model.n_boundary != 6:
        raise ExportError(
            f"export to ext_ptfm: interface {body.interfaces[0].name!r} has {model.n_boundary} dofs, the format has "
            "six; make it rigid or distributing"
        )
    place = " ".join(f"{x:.9g}" for x in model.nodes[0].position)
    notes = [f"interface {body.interfaces[0].name}: platform reference point, at {place} in the mesh"]
    if not body.is_held:
        notes.append("the body is free: its stiffness includes no foundation; reduce it with `held` at its supports")
    f = load_of(model, request.loads)
    amplitudes = {case.name: request.loads.get(case.name, 0.0) for case in body.load_cases}
    notes += [f"static load {name}, amplitude {amplitude:g}" for name, amplitude in amplitudes.items()]
    text = "\n".join(lines_of(model, f, request)) + "\n"
    return WrittenFiles({request.path: text.encode("ascii")}, tuple(notes))


def load_of(model: InterfaceModel, wanted: Mapping[str, float]) -> Array:
    """Return the sum of the load cases, each multiplied by its amplitude, (n,)."""
    f = np.zeros(len(model.K))
    names = [case.name for case in model.body.load_cases]
    for name, amplitude in wanted.items():
        if name not in names:
            raise ExportError(f"export to ext_ptfm: load: no load case {quoted(name)}{nearest(name, names)}")
        f += amplitude * model.loads[:, names.index(name)]
    return f


def lines_of(model: InterfaceModel, f: Array, request: Request) -> Iterator[str]:
    """Yield the lines of the file."""
    n = len(model.K)
    header = request.header()
    yield f"!{'; '.join(header)}"
    yield "!Flex 5 format"
    yield f"!Dimension: {n}"
    yield f"!Time increment in simulation: {LAST_TIME:.1f}"
    yield f"!Total simulation time in file: {LAST_TIME:.1f}"
    for name, unit, matrix in (
        ("Mass", "kg,m", model.M),
        ("Stiffness", "N,m", model.K),
        ("Damping", "N,m,kg", model.D),
    ):
        yield f"!{name} Matrix (Units ({unit}))"
        yield f"!Dimension: {n}"
        yield from (row_of(row) for row in matrix)
    yield "!Loading and Wave Elevation (Units (N,m))"
    yield f"!Dimension: 1 time column -  {n} force columns - 1 wave elevation column"
    for time in (0.0, LAST_TIME):
        yield row_of(np.concatenate([[time], f, [0.0]]))


def row_of(values: Array) -> str:
    """Return a line with numbers in full precision."""
    return " ".join(f"{value:24.16e}" for value in np.asarray(values).tolist())


# ext ptfm -------------------------------------------------------------------------------------------------------------
# Superelements of OpenFAST's ExtPtfm: mass, stiffness, damping over one interface node and modes, and loads.


NODE = 1  #: number of the interface node, which the format does not number
MATRICES = {"M": "Mass", "K": "Stiffness", "D": "Damping"}


def is_ext_ptfm(path: Path, head: bytes) -> bool:
    """Return whether a file is text in the format FlexASCII."""
    return b"!Mass Matrix" in head or b"!Flex 5 format" in head


def read_ext_ptfm(files: Sequence[Path], name: str, places: Mapping[int, Array]) -> Superelement:
    """Read a superelement: six dofs of interface node 1, then modes; constant loads form the load case "static".

    The file does not contain the position of the node; it is taken from node 1 in `places`, otherwise the origin.

    Raises
    ------
    ForeignBodyError
        If a matrix is missing, not square, or of another size than the others.
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
    """Return the matrix below its heading; None if the heading is missing."""
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
        raise ForeignBodyError(f"{path}, line {starts[0] + 2}: {n} rows are too many for a reduced body")
    rows = [numbers_of(path, starts[0] + 3 + k, line) for k, line in enumerate(lines[starts[0] + 2 :][:n])]
    if len(rows) != n or any(len(row) != n for row in rows):
        got = f"{len(rows)} rows" if len(rows) != n else f"a row of {next(len(r) for r in rows if len(r) != n)}"
        raise ForeignBodyError(f"{path}: {word.lower()} matrix: expected {n} rows of {n} numbers, got {got}")
    return np.array(rows)


def static_load(path: Path, lines: list[str], n: int) -> tuple[dict[str, Array], list[str]]:
    """Return the loads as a load case if they are constant in time, otherwise a note."""
    starts = [k for k, line in enumerate(lines) if line.startswith("!Loading")]
    if not starts:
        return {}, []
    first = starts[0] + 1
    rows = [numbers_of(path, first + k + 1, x) for k, x in enumerate(lines[first:]) if x.strip() and x[0] != "!"]
    if not rows or any(len(row) < n + 1 for row in rows):
        raise ForeignBodyError(f"{path}: loading: expected a time and {n} forces in each row")
    forces = np.array([row[1 : n + 1] for row in rows])
    if np.ptp(forces, axis=0).max() > 1e-12 * np.abs(forces).max(initial=1e-300):
        return {}, [f"loads over {len(rows)} times are left out, because load cases are constant"]
    return ({"static": forces[0]} if forces.any() else {}), []


def numbers_of(path: Path, line: int, text: str) -> list[float]:
    """Return the numbers in a line."""
    try:
        return [float(word.replace("D", "E")) for word in text.split()]
    except ValueError as error:
        raise ForeignBodyError(f"{path}, line {line}: {error}") from None
