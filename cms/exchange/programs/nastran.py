"""Nastran: an external superelement as OUTPUT4 matrices with bulk data, or as DMIG cards; read and written."""

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

import numpy as np

from cms.errors import ExportError
from cms.exchange.exporters.nodes import all_nodes, user_numbers
from cms.exchange.exporters.writer import Request, WrittenFiles
from cms.exchange.importers.element_rows import ForeignRows, force_rows, motion_rows, stress_rows
from cms.exchange.importers.superelement import RecoveryRows, Superelement
from cms.reduction.interface_model import InterfaceModel, interface_model
from fe_models.files.nastran.matrices.superelement import SCALAR, TEXTS, NastranSuperelement, read_superelement
from fe_models.files.nastran.matrices.write_op4 import op4_parts
from fe_models.foundation.arrays import Array, IntArray

__all__ = ["is_nastran", "make_dmig", "make_op4", "nastran_superelement", "read_nastran"]


# Nastran: a superelement as OUTPUT4 matrices with bulk data, or as DMIG cards -----------------------------------------


FIRST_SCALAR = 1000001  #: number of the SPOINT for the coordinate of the first mode
FIRST_NODE = 2000001  #: number of the first kept node, for the recovery
SYMMETRIC, RECTANGULAR, DOUBLE = 6, 9, 2  #: codes IFO and TIN of DMIG


def make_op4(request: Request) -> WrittenFiles:
    """Return FILE.op4 (KXX, MXX, BXX, PX, MUG1), and FILE.asm and FILE.pch with the order of its rows.

    The rows are six (or three) dofs of each interface node, then the modes as SPOINTs, in the order of EXTRN in the
    .pch; all in the basic system. MUG1 has six rows for each kept node, in the order of table TUG1 in the .pch. Unknown
    rotations, such as at nodes of solid elements, are zero.
    """
    model = interface_model(request.body)
    matrices = {"KXX": model.K, "MXX": model.M}
    if np.any(model.D):
        matrices["BXX"] = model.D
    if model.body.load_cases:
        matrices["PX"] = model.loads
    if len(model.body.nodes):
        matrices["MUG1"] = six_rows(model)
    path = request.path.with_suffix(".op4")
    asm, pch = (
        "\n".join([*comments(request), *lines]) + "\n" for lines in (assembly_lines(model), superelement_lines(model))
    )
    files = {
        path: b"".join(op4_parts(f"OP4 file {path}", matrices)),
        path.with_suffix(".asm"): asm.encode("ascii"),
        path.with_suffix(".pch"): pch.encode("ascii"),
    }
    notes = [f"interface {node.interface}: GRID {k + 1}" for k, node in enumerate(model.nodes)]
    notes += recovery_numbers(model)[1] if len(model.body.nodes) else ()
    return WrittenFiles(files, (*notes, *load_notes(model, "PX")))


def make_dmig(request: Request) -> WrittenFiles:
    """Return bulk data: GRIDs, SPOINTs, DMIG KAAX, MAAX, BAAX (one triangle) and PAX, for K2GG = KAAX and so on.

    A field of 16 characters holds 10 digits; the notes say so.
    """
    model = interface_model(request.body)
    lines = [*comments(request), "$ case control: K2GG = KAAX, M2GG = MAAX, B2GG = BAAX, P2G = PAX"]
    lines += [*grid_lines(model), *spoint_lines(model)]
    named = dofs_of(model)
    for name, matrix in (("KAAX", model.K), ("MAAX", model.M), ("BAAX", model.D)):
        if np.any(matrix):
            lines += dmig_lines(name, matrix, named, named, SYMMETRIC)
    if model.body.load_cases:
        lines += dmig_lines("PAX", model.loads, named, [(k + 1, 0) for k in range(model.loads.shape[1])], RECTANGULAR)
    notes = [f"interface {node.interface}: GRID {k + 1}" for k, node in enumerate(model.nodes)]
    notes.append("numbers have 10 digits, because a field has 16 characters; op4 has all digits")
    return WrittenFiles({request.path: ("\n".join(lines) + "\n").encode("ascii")}, (*notes, *load_notes(model, "PAX")))


def comments(request: Request) -> list[str]:
    """Return the header as comments of at most 72 columns."""
    return [f"$ {line[k : k + 70]}" for line in request.header() for k in range(0, len(line), 70)]


def load_notes(model: InterfaceModel, name: str) -> list[str]:
    """Return notes that name the load case of each column."""
    return [f"load case {case.name}: column {k + 1} of {name}" for k, case in enumerate(model.body.load_cases)]


def dofs_of(model: InterfaceModel) -> list[tuple[int, int]]:
    """Return (grid, component counted from 1) of each row; (scalar point, 0) for modes."""
    nodes = [(k + 1, int(c) + 1) for k, node in enumerate(model.nodes) for c in node.components]
    return nodes + [(FIRST_SCALAR + k, 0) for k in range(model.n_modes)]


def grid_lines(model: InterfaceModel) -> Iterator[str]:
    """Yield the GRIDs of the interfaces in basic axes; missing dofs become permanent constraints."""
    for k, node in enumerate(model.nodes):
        held = "".join(str(c + 1) for c in range(6) if c not in node.components)
        yield from grid(k + 1, node.position, held)


def grid(number: int, position: Array, held: str = "") -> Iterator[str]:
    """Yield a GRID card in large-field format."""
    x, y, z = (real(value) for value in position)
    yield f"{'GRID*':8}{number:16d}{'':16}{x}{y}"
    yield f"{'*':8}{z}{'':16}{held:>16}" if held else f"{'*':8}{z}"


def spoint_lines(model: InterfaceModel) -> Iterator[str]:
    """Yield the scalar points of the modes, eight on a line."""
    numbers = [FIRST_SCALAR + k for k in range(model.n_modes)]
    for k in range(0, len(numbers), 8):
        yield f"{'SPOINT':8}" + "".join(f"{number:8d}" for number in numbers[k : k + 8])


def superelement_lines(model: InterfaceModel) -> Iterator[str]:
    """Yield the bulk data of the superelement: order of rows (EXTRN), grids, analysis set, scalar points."""
    nodes = [(k + 1, "".join(str(c + 1) for c in node.components)) for k, node in enumerate(model.nodes)]
    pairs = nodes + [(FIRST_SCALAR + k, "0") for k in range(model.n_modes)]
    yield "BEGIN SUPER        1"
    yield from continued("EXTRN", [f"{word:>8}" for pair in pairs for word in pair])
    yield from grid_lines(model)
    yield from aset_lines(pairs)
    yield from spoint_lines(model)
    if len(model.body.nodes):
        numbers, _ = recovery_numbers(model)
        for number, position in zip(numbers, model.mesh_positions(), strict=True):
            yield from grid(int(number), position)
        yield from recovery_table(numbers, len(model.K))


def recovery_numbers(model: InterfaceModel) -> tuple[IntArray, tuple[str, ...]]:
    """Return GRID numbers of the kept nodes, and a note: they are mesh numbers, or begin at `FIRST_NODE`.

    They must differ from the numbers of the interfaces, 1, 2, ..., and from the SPOINTs of the modes.
    """
    numbers, words = user_numbers(model.body)
    plain = FIRST_NODE + np.arange(len(numbers))
    if model.body.numbering.nodes.size and words[0].startswith("numbers of nodes are"):
        taken = np.concatenate([np.arange(len(model.nodes)) + 1, FIRST_SCALAR + np.arange(model.n_modes)])
        if not np.isin(numbers, taken).any():
            return numbers, ("GRIDs of the kept nodes are those of the mesh",)
        words = ("numbers of the mesh coincide with those of interfaces, 1, 2, ..., or of SPOINTs of the modes",)
    return plain, (*words, f"GRIDs of the kept nodes: {FIRST_NODE} and so on")


def six_rows(model: InterfaceModel) -> Array:
    """Return translations and rotations of the kept nodes in mesh axes for a unit value of each row, (6 n_kept, n)."""
    body = model.body
    n = len(body.nodes)
    nodes = all_nodes(body)
    rotation = nodes.Psi[:n]
    if not body.is_held:  # a rigid rotation rotates every node that has rotations
        rigid = np.zeros((n, 3, 6))
        rigid[nodes.has_rotation[:n], :, 3:] = np.eye(3)
        rotation = np.concatenate([rigid, rotation], axis=2)
    turned = body.frame.axes @ rotation @ model.T
    return np.concatenate([model.recovery(), turned], axis=1).reshape(6 * n, -1)


def recovery_table(numbers: IntArray, n_columns: int) -> Iterator[str]:
    """Yield the table TUG1: head, columns, and for each kept node the first of its six rows in MUG1."""
    n_nodes = len(numbers)
    yield from continued("DTI", [f"{word:<8}" for word in ("TUG1", 0, 6 * n_nodes, n_columns, 32767, 0, 7, 0)])
    yield from continued("", [f"{word:<8}" for word in ("", "PHIP", 7, "", "", "REAL", "", 1, "ENDREC")][1:])
    columns = [f"{word:<8}" for k in range(n_columns) for word in (k + 1, "0.00000")]
    yield from continued("DTI", [f"{'TUG1':8}", f"{1:<8}", *columns, "ENDREC"])
    entries = [f"{word:<8}" for k, number in enumerate(numbers) for word in (1, int(number), 6, 6 * k + 1)]
    yield from continued("DTI", [f"{'TUG1':8}", f"{2:<8}", *[" " * 8] * 6])
    yield from continued("", [f"{word:<8}" for word in ("TYPE", "ID", "COMP", "ROW") * 2] + [*entries, "ENDREC"])


def assembly_lines(model: InterfaceModel) -> Iterator[str]:
    """Yield the bulk data of the assembly run: the superelement, and the numbers of its points in the assembly."""
    numbers = [k + 1 for k in range(len(model.nodes))] + [FIRST_SCALAR + k for k in range(model.n_modes)]
    yield "SEBULK         1  EXTOP4          MANUAL                       1"
    yield "SECONCT        1       0              NO"
    twice = [f"{number:8d}" for number in numbers for _ in range(2)]
    for k in range(0, len(twice), 8):
        yield f"{'':8}" + "".join(twice[k : k + 8])
    yield from grid_lines(model)
    yield from spoint_lines(model)


def continued(card: str, words: list[str]) -> Iterator[str]:
    """Yield a card with fields of 8 characters, eight fields per line."""
    for k in range(0, len(words), 8):
        yield f"{card if not k else '':8}" + "".join(words[k : k + 8])


def aset_lines(pairs: Iterable[tuple[int, str]]) -> Iterator[str]:
    """Yield the cards of the analysis set, with four points on each card."""
    words = [f"{number:8d}{components:>8}" for number, components in pairs]
    for k in range(0, len(words), 4):
        yield f"{'ASET':8}" + "".join(words[k : k + 4])


def dmig_lines(
    name: str, matrix: Array, rows: list[tuple[int, int]], columns: list[tuple[int, int]], form: int
) -> Iterator[str]:
    """Yield a DMIG matrix: one triangle if it is symmetric; columns of a rectangular matrix are (number, 0)."""
    n_col = f"{len(columns):8d}" if form == RECTANGULAR else f"{'':8}"
    yield f"{'DMIG':8}{name:8}{0:8d}{form:8d}{DOUBLE:8d}{0:8d}{'':16}{n_col}".rstrip()
    for j, (point, component) in enumerate(columns):
        filled = [i for i in np.flatnonzero(matrix[:, j]) if form == RECTANGULAR or i >= j]
        if not filled:
            continue
        yield f"{'DMIG*':8}{name:16}{point:16d}{component:16d}"
        for i in filled:
            yield f"{'*':8}{rows[i][0]:16d}{rows[i][1]:16d}{real(matrix[i, j], letter='D')}"


def real(value: float, letter: str = "E") -> str:
    """Return a number in a field of 16 columns, with as many digits as fit.

    Raises
    ------
    ExportError
        If the number does not fit, because its exponent is outside 1e-99 to 1e99.
    """
    if value != 0 and not 1e-99 < abs(value) < 1e99:
        raise ExportError(
            f"export to nastran: {value:.3e} is out of the range of a field of 16 characters; check the units"
        )
    return f"{value:16.9E}".replace("E", letter)


# external superelements of Nastran: the record of their files as a superelement of ours -------------------------------


def is_nastran(path: Path, head: bytes) -> bool:
    """Return whether a file belongs to an external superelement: by its cards, or by cards in the same folder."""
    suffix = path.suffix.lower()
    if suffix in TEXTS:
        return any(word in head.upper() for word in (b"EXT. SUPERELEMENT", b"EXTRN", b"SEBULK", b"BEGIN SUPER"))
    if suffix != ".op4":
        return False
    beside = [path.with_suffix(other) for other in (*TEXTS, *(text.upper() for text in TEXTS))]
    return any(other.is_file() for other in beside)


def read_nastran(files: Iterable[Path], name: str, places: Mapping[int, Array] | None = None) -> Superelement:
    """Read an external superelement of Nastran: .op4 with .pch or .asm, and bulk data for recovered nodes."""
    return nastran_superelement(read_superelement(list(files)), name, places)


def nastran_superelement(
    raw: NastranSuperelement, name: str, places: Mapping[int, Array] | None = None
) -> Superelement:
    """Return the superelement in the files; grid points without position are omitted from the recovery, with a note."""
    positions = {**{int(k): np.asarray(x, dtype=float) for k, x in (places or {}).items()}, **raw.positions}
    notes = list(raw.notes)
    recovery = None
    numbers = set(raw.grid_ids)
    if raw.displacement is not None:
        rows = raw.displacement.rows
        usable = (rows[:, 1] != SCALAR) & ~np.isin(rows[:, 0], raw.displacement.unplaced)
        recovery = RecoveryRows(rows[usable], raw.displacement.matrix[usable])
        numbers |= {int(number) for number in rows[usable, 0]}
    tables: dict[str, ForeignRows] = {}
    if recovery is not None:
        tables["displacements"] = motion_rows(recovery.dofs, recovery.matrix)
    if raw.forces is not None:
        of_elements, lost = force_rows(raw.forces.elements, raw.forces.matrix)
        notes += lost
        if of_elements.names:
            tables["element forces"] = of_elements
    if raw.stresses is not None:
        tables["element stresses"] = stress_rows(raw.stresses.elements, raw.stresses.matrix)
    kept = np.array(sorted(numbers), dtype=np.int64)
    n_loads = raw.loads.shape[1]
    return Superelement(
        name=name,
        K=raw.K.toarray(),
        M=raw.M.toarray(),
        D=None if raw.D is None else raw.D.toarray(),
        dofs=raw.dofs,
        node_numbers=kept,
        nodes=np.array([positions[int(number)] for number in kept]).reshape(-1, 3),
        recovery=recovery,
        tables=tables,
        loads={f"load {k + 1}": raw.loads[:, k] for k in range(n_loads) if raw.loads[:, k].any()},
        program="Nastran",
        provenance={
            "source": "Nastran external superelement",
            **{f"file {path}": digest for path, digest in raw.files.items()},
            **{f"note {k + 1}": note for k, note in enumerate(notes)},
        },
    )
