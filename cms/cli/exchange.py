"""The commands `cms formats`, `export`, `import` and `recovery`: reduced bodies of other programs."""

import json
from dataclasses import dataclass, replace
from math import isfinite
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import typer

from cms.cli.console import output_path, print_table, say, say_written, stages
from cms.errors import ExportError, ForeignBodyError, JobError, ModalFileError, RecoveryError
from cms.exchange.export import WRITERS, export_body, unknown_format
from cms.exchange.import_body import BODY_FORMATS, REDUCED_MATRICES
from fe_models.door import package_of
from fe_models.files.cad.cad_units import GEOMETRIES
from fe_models.files.read_deck import DECKS
from fe_models.files.read_matrices import MATRIX_FORMATS
from fe_models.files.read_mesh import MESH_FORMATS, MESHES
from fe_models.foundation.formats import Format
from fe_models.foundation.number_pairs import read_pairs
from fe_models.foundation.units import UNIT_SYSTEMS

if TYPE_CHECKING:
    from cms.body.reduced_body import ReducedBody
    from cms.exchange.importers.inertia import Inertia
    from cms.reduction.basis.damping import Damping
    from cms.reduction.basis.frames import Frame

__all__ = [
    "FORMATS",
    "ExportRequest",
    "ImportRequest",
    "RecoveryCommand",
    "list_formats",
    "markdown_tables",
    "run_export",
    "run_import",
    "run_recovery",
]


# the command `cms formats`: formats of other programs that are read and written ---------------------------------------


#: all formats, from the part to the body
FORMATS: tuple[Format, ...] = (
    *MESHES, *GEOMETRIES, *DECKS, *MATRIX_FORMATS, *BODY_FORMATS.values(), *REDUCED_MATRICES, *WRITERS.values(),
)  # fmt: skip
IN = ("program", "format", "holds", "what is lost", "tried")
OUT = ("program", "format", "--to", "what is lost", "tried")


def list_formats(*, as_json: bool) -> None:
    """Print the formats that are read and those that are written, as tables or as JSON."""
    if as_json:
        typer.echo(json.dumps([known.record() for known in (*FORMATS, *formats_of_packages())], indent=2))
    else:
        print_table("What comes in", IN, rows_in(*formats_of_packages()))
        print_table("What goes out", OUT, rows_out())


def markdown_tables() -> str:
    """Return both tables in Markdown, for the page of all formats."""
    parts = (("What comes in", IN, rows_in()), ("What goes out", OUT, rows_out()))
    return "\n\n".join(f"**{title}**\n\n{markdown(head, rows)}" for title, head, rows in parts)


def markdown(head: tuple[str, ...], rows: list[tuple[str, ...]]) -> str:
    """Return a table in Markdown, with the stars of keywords escaped."""
    cells = [head, ("---",) * len(head), *(tuple(cell.replace("*", "\\*") for cell in row) for row in rows)]
    return "\n".join(f"| {' | '.join(row)} |" for row in cells)


def formats_of_packages() -> tuple[Format, ...]:
    """Return the formats of meshes that other installed packages read; the packages are not imported."""
    return tuple(
        Format("mesh", package_of(point), "mesh", (suffix,)) for suffix, point in MESH_FORMATS.not_loaded.items()
    )


def rows_in(*others: Format) -> list[tuple[str, ...]]:
    """Return the cells of the formats that are read, of this project and others."""
    return [(f.program, format_words(f), f.holds, f.lost, f.tried) for f in (*FORMATS, *others) if f.reads]


def rows_out() -> list[tuple[str, ...]]:
    """Return the cells of the formats that are written."""
    return [(f.program, format_words(f), f.key, f.lost, f.tried) for f in FORMATS if f.writes]


def format_words(known: Format) -> str:
    """Return the name of a format with its file suffixes, and the extra that it needs."""
    extra = f"; extra {known.extra}" if known.extra else ""
    return f"{known.name} ({' '.join(known.suffixes)}{extra})"


# `cms export`: a modal file in the format of another program ----------------------------------------------------------


@dataclass(frozen=True)
class ExportRequest:
    """Arguments of `cms export`."""

    file: Path
    to: str
    units: str | None
    nodes: str
    output: Path | None
    loads: tuple[str, ...] = ()  #: texts "NAME=AMPLITUDE"


def run_export(request: ExportRequest) -> None:
    """Write the files, and report data that the format cannot hold.

    Raises
    ------
    CmsError
        If the format or the units are unknown or missing, the body does not fit, or the files cannot be written.
    """
    if request.to not in WRITERS:
        raise ExportError(f"--to: {unknown_format(request.to)}")
    default = request.file.with_name(f"{request.file.stem}_{request.to}{WRITERS[request.to].suffixes[0]}")
    path = output_path(request.output, default, ExportError, overwrite_of=(request.file,))
    exported = export_body(
        request.file, path, to=request.to, units=request.units, nodes=request.nodes, loads=loads_of(request)
    )
    units = exported.units
    for written in exported.files:
        if written.is_file():
            say_written(written)
        else:
            say(f"wrote {written}")
    say(f"units: {units.name} ({units.length_symbol}, {units.mass_symbol}, {units.time_symbol})")
    for note in exported.notes:
        say(note)
    if exported.left_out:
        say(f"not held by this format: {'; '.join(exported.left_out)}")


def loads_of(request: ExportRequest) -> dict[str, float]:
    """Return the requested amplitude of each load case."""
    loads = {}
    for text in request.loads:
        name, _, amplitude = text.rpartition("=")
        try:
            loads[name] = float(amplitude)
        except ValueError:
            name = ""
        if not name or not isfinite(loads[name]):
            raise ExportError(f"--load {text}: expected NAME=AMPLITUDE, such as weight=1")
    return loads


# `cms import`: a body that another program has reduced becomes a modal file -------------------------------------------


@dataclass(frozen=True)
class ImportRequest:
    """Arguments of `cms import`."""

    files: tuple[str, ...]  #: paths, or ROLE=path
    units: str | None
    output: Path | None = None
    name: str | None = None
    form: str | None = None
    nodes: Path | None = None
    boundary: str | None = None  #: boundary node numbers, such as "3,11,19"
    interfaces: tuple[str, ...] = ()  #: interfaces, such as "NAME=3,11"
    full_mass: tuple[str, ...] = ()  #: files of the full model
    nodal_masses: Path | None = None
    mesh: Path | None = None
    density: float | None = None
    to: str = "tisserand"
    at: str | None = None
    damping: float | None = None
    repair_mass: bool = False
    accept: tuple[str, ...] = ()
    heavy: bool = False  #: whether a damping ratio above 0.2 is intended


def run_import(request: ImportRequest) -> "ReducedBody":
    """Import, write the modal file, and return the body.

    Raises
    ------
    CmsError
        If no units are given, a file cannot be read, or the files do not make a body.
    """
    from cms.body.modal_file.file import write
    from cms.exchange.import_body import import_body

    if request.units is None:
        raise ForeignBodyError(
            "--units: missing; none of these formats says its units, and nothing is guessed: name the unit system of "
            f"the files, one of {', '.join(UNIT_SYSTEMS)}"
        )
    files = named_files(request.files)
    first = next(iter(files.values())) if isinstance(files, dict) else files[0]
    path = output_path(request.output, first.with_suffix(".h5"), ModalFileError, overwrite_of=tuple(
        files.values() if isinstance(files, dict) else files
    ))  # fmt: skip
    with stages() as clock:
        with clock("read and reduce"):
            body = import_body(
                files,
                units=request.units,
                name=request.name,
                form=request.form,
                nodes=request.nodes,
                boundary=None if request.boundary is None else numbers_of("--boundary", request.boundary),
                interfaces=interfaces_of(request.interfaces),
                inertia=inertia_of(request),
                frame=frame_of(request),
                damping=damping_of(request),
                repair_mass=request.repair_mass,
                accept=request.accept,
            )
        with clock("write"):
            write(body, path)
    say_written(path)
    return body


def named_files(words: tuple[str, ...]) -> "list[Path] | dict[str, Path]":
    """Return the paths, by role if files are given as ROLE=path."""
    roles = [word.partition("=") for word in words]
    with_role = [role in ("K", "M", "D", "dofs") and bool(mark) for role, mark, _ in roles]
    if not any(with_role):
        return [Path(word) for word in words]
    if not all(with_role) or len({role for role, _, _ in roles}) < len(roles):
        raise ForeignBodyError(
            f"{' '.join(words)}: expected K=FILE M=FILE (D=FILE, dofs=FILE), each once, or plain files"
        )
    return {role: Path(path) for role, _, path in roles}


def numbers_of(option: str, text: str) -> list[int]:
    """Return integers separated by commas."""
    try:
        return [int(word) for word in text.split(",")]
    except ValueError:
        raise ForeignBodyError(f"{option} {text}: expected node numbers with commas between, 3,11,19") from None


def interfaces_of(words: tuple[str, ...]) -> dict[str, list[int]] | None:
    """Return the node numbers of each interface, given as NAME=3,11; None if there are none."""
    found: dict[str, list[int]] = {}
    for word in words:
        name, mark, numbers = word.partition("=")
        if not mark or not name or name in found:
            raise ForeignBodyError(f"--interface {word}: expected NAME=3,11,19, each name once")
        found[name] = numbers_of(f"--interface {name}", numbers)
    return found or None


def inertia_of(request: ImportRequest) -> "Inertia | None":
    """Return the additional inertia data: one of full mass, nodal masses, or mesh and density."""
    from cms.exchange.importers.inertia import MeshMass, NodalMasses, full_mass_of
    from fe_models.files.read_matrices import read_matrices
    from fe_models.files.read_mesh import read_mesh

    given = [bool(request.full_mass), request.nodal_masses is not None, request.mesh is not None]
    if sum(given) > 1:
        raise ForeignBodyError("expected one of --full-mass, --nodal-masses and --mesh, got several")
    if (request.mesh is None) != (request.density is None):
        raise ForeignBodyError("--mesh and --density belong together: expected both or none")
    if request.full_mass:
        files = named_files(request.full_mass)
        return full_mass_of(read_matrices(files))
    if request.nodal_masses is not None:
        return NodalMasses(*table_of_masses(request.nodal_masses))
    if request.mesh is not None and request.density is not None:
        return MeshMass(read_mesh(request.mesh), request.density)
    return None


def table_of_masses(path: Path) -> tuple[np.ndarray, np.ndarray]:
    """Return node numbers and their masses from lines "node, mass" with an optional header."""
    table, lines = read_pairs(path, "node and mass", ForeignBodyError, "--nodal-masses")
    numbers = table[:, 0].astype(np.int64)
    if (numbers != table[:, 0]).any():
        k = int(np.argmax(numbers != table[:, 0]))
        raise ForeignBodyError(f"{path}, line {lines[k]}: expected the number of a node, got {table[k, 0]:g}")
    return numbers, table[:, 1]


def frame_of(request: ImportRequest) -> "Frame | None":
    """Return the requested frame; None for the default."""
    from cms.cli.frame import FrameRequest
    from cms.cli.frame import frame_of as frame_of_request

    if request.to == "tisserand" and request.at is None:
        return None
    return frame_of_request(FrameRequest(Path(request.files[0]), request.to, request.at))


def damping_of(request: ImportRequest) -> "Damping | None":
    """Return the requested damping, which is added to that of the files."""
    from cms.reduction.basis.damping import ModalDamping

    return None if request.damping is None else ModalDamping(request.damping, heavy=request.heavy)


# `cms recovery`: recovery tables of a modal file, listed or written for other programs --------------------------------


@dataclass(frozen=True)
class RecoveryCommand:
    """Arguments of `cms recovery`."""

    file: Path
    table: str | None
    rows: Path | None
    over: str
    units: str | None
    output: Path | None


def run_recovery(request: RecoveryCommand) -> None:
    """List the rows of a body, or write one table; if a file `rows` is given, compute its tables first.

    Raises
    ------
    CmsError
        If there is no such table, a row is unknown, or the file cannot be written.
    """
    from cms.body.modal_file.file import read, write
    from cms.reduction.recovery.files import chosen, write_recovery

    body = read(request.file, units=request.units)
    if request.rows is not None:
        body = with_rows(body, request.rows)
    if request.output is None:
        names = [chosen(body, request.table).name] if request.table or not body.recovery else list(body.recovery)
        for name in names:
            table = body.recovery[name]
            print_table(
                f"Recovery table {name}: {table.n_rows} rows, {len(table.loads)} loads",
                ("row>", "label", "unit"),
                [(k + 1, label, unit) for k, (label, unit) in enumerate(zip(table.labels, table.units, strict=True))],
            )
            say(f"left out: {table.truncated}\n")
        return
    path = output_path(request.output, request.output, RecoveryError, overwrite_of=(request.file,))
    if path.suffix.lower() == ".h5":
        write(body, path)
        say(f"wrote {path}: recovery tables {', '.join(body.recovery) or 'none'}")
        return
    written = write_recovery(body, path, table=request.table, over=request.over)
    for file in written.files:
        say(f"wrote {file}")
    say(f"units: {body.units.name} ({body.units.length_symbol}, {body.units.mass_symbol}, {body.units.time_symbol})")
    for note in written.notes:
        say(note)


def with_rows(body: "ReducedBody", path: Path) -> "ReducedBody":
    """Return the body with the tables requested in a file, as far as it can compute them without its model."""
    from cms.jobs.tables.recovery_section import RecoveryFile, requests_of
    from cms.reduction.recovery.matrices import recovery_matrices
    from fe_models.foundation.toml_file import read_toml, validated

    sections = validated(RecoveryFile, read_toml(path, JobError), path, JobError).recovery
    made = recovery_matrices(body, requests_of(sections))
    twice = sorted(set(made) & set(body.recovery))
    if twice:
        raise RecoveryError(f"{path}: body {body.name!r} has a table {twice[0]!r} already; choose another name")
    return replace(body, recovery={**body.recovery, **made})
