"""Export of a reduced body to another program: the table of writers, and the function that uses it."""

import os
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from cms.body.invariants import INERTIA_TERMS
from cms.body.modal_file.file import convert_units, digest, read
from cms.body.reduced_body import ReducedBody
from cms.errors import CmsError, ExportError
from cms.exchange.exporters.formats import FORMATS
from cms.exchange.exporters.writer import Request, Writer, left_out
from cms.exchange.programs.ext_ptfm import make_ext_ptfm
from cms.exchange.programs.exudyn import make_exudyn
from cms.exchange.programs.matrices import make_abaqus, make_mat5, make_mat73, make_matrix_market, make_simscape
from cms.exchange.programs.mbdyn import make_mbdyn
from cms.exchange.programs.mbsim import make_mbsim
from cms.exchange.programs.nastran import make_dmig, make_op4
from cms.exchange.programs.sid_fem import DIALECTS, make_sid_fem
from cms.exchange.programs.vtk import make_vtk
from fe_models.foundation.paths import is_stream, replace_files
from fe_models.foundation.seal import reason
from fe_models.foundation.units import Units, unit_system
from fe_models.foundation.words import nearest, quoted

__all__ = ["WRITERS", "Exported", "export_body"]

OVER_INTERFACES = frozenset(
    {"damping", "rotation", "load cases", "axes in B"}
)  #: data that all formats with matrices over the interfaces can hold
WRITERS: dict[str, Writer] = {
    "mbsim": Writer(
        make_mbsim,
        frozenset({"gyroscopic", "damping", "rotation", "stress", "surface", "axes in the mesh"}),
        needs=("modes",),
    ),
    "exudyn": Writer(
        make_exudyn,
        frozenset({"gyroscopic", "damping", "interfaces", "stress", "surface", "axes in B", "axes in the mesh"}),
        needs=("modes", "nodes"),
    ),
    "mbdyn": Writer(
        make_mbdyn,
        frozenset({"gyroscopic", "geometric", "damping", "rotation", "axes in the mesh"}),
        needs=("modes", "interfaces"),
    ),
    **{
        dialect: Writer(
            partial(make_sid_fem, dialect=dialect),
            frozenset({"gyroscopic", "geometric", "damping", "rotation", "axes in the mesh"}),
            needs=("modes", "interfaces"),
        )
        for dialect in DIALECTS
    },
    "mat": Writer(make_mat5, OVER_INTERFACES | {"interfaces", "surface"}, takes_held=True, needs=("interfaces",)),
    "mat73": Writer(make_mat73, OVER_INTERFACES | {"interfaces", "surface"}, takes_held=True, needs=("interfaces",)),
    "matrix-market": Writer(
        make_matrix_market, OVER_INTERFACES | {"interfaces"}, takes_held=True, needs=("interfaces",)
    ),
    "simscape": Writer(
        make_simscape, (OVER_INTERFACES | {"interfaces"}) - {"load cases"}, units="m-kg-s", needs=("interfaces",)
    ),
    "nastran-op4": Writer(make_op4, OVER_INTERFACES, takes_held=True, needs=("interfaces",)),
    "nastran-dmig": Writer(make_dmig, OVER_INTERFACES, takes_held=True, needs=("interfaces",)),
    "abaqus": Writer(make_abaqus, OVER_INTERFACES - {"load cases"}, takes_held=True, needs=("interfaces",)),
    "ext_ptfm": Writer(
        make_ext_ptfm, OVER_INTERFACES, takes_held=True, takes_loads=True, units="m-kg-s", needs=("interfaces",)
    ),
    "vtk": Writer(
        make_vtk, frozenset({"surface", "stress", "axes in the mesh"}), takes_held=True, needs=("modes", "nodes")
    ),
}  #: writer of each format, by key of `cms.exchange.exporters.formats.FORMATS`

NEEDS = {
    "modes": (
        lambda body: body.n_q > 0,
        "has no modes, so it is rigid; enter its mass and inertia in the other program",
    ),
    "nodes": (lambda body: len(body.nodes) > 0, "has no nodes with shapes, which the format requires"),
    "interfaces": (lambda body: len(body.interfaces) > 0, "has no interfaces, whose motion the format requires"),
}  #: for each key of `Writer.needs`: test of the body, and text of the error


@dataclass(frozen=True)
class Exported:
    """Written files, and the data that the format cannot hold."""

    files: tuple[Path, ...]
    left_out: tuple[str, ...]  #: descriptions of body data that the files do not contain
    notes: tuple[str, ...]  #: positions of the interfaces, and other facts for the user of the other program
    units: Units  #: units of the numbers in the files


#: formats that are not documented, by their names and those of their programs (docs/formats.md)
UNDOCUMENTED = {"mnf": "Adams", "adams": "Adams", "fbi": "Simpack", "simpack": "Simpack"}


def unknown_format(name: str) -> str:
    """Return the message for a format that this project does not write."""
    program = UNDOCUMENTED.get(name.lower())
    if program is None:
        return f"unknown format {quoted(name)}{nearest(name, WRITERS)}"
    near = "nastran-dmig" if program == "Adams" else "sid_fem"
    return (
        f"{quoted(name)}: the file format of {program} is not documented, so it cannot be written; "
        f'{near} may be an alternative, see "Adams and Simpack" in docs/formats.md'
    )


def export_body(
    body: ReducedBody | str | os.PathLike[str],
    path: str | os.PathLike[str],
    *,
    to: str,
    units: Units | str | None = None,
    nodes: str = "default",
    loads: Mapping[str, float] | None = None,
) -> Exported:
    """Write a reduced body in the format of another program; files are written completely or not at all.

    Parameters
    ----------
    body
        A reduced body, or its modal file.
    path
        The file to write. A missing suffix is added; formats with several files use its stem for the others.
    to
        Key of the format, as listed by `cms formats`.
    units
        Unit system of the numbers, or its name; default: the system of the body, or the only one that the other program
        accepts. Most formats do not record their units.
    nodes
        Nodes in formats that allow a choice (SID_FEM, MBDyn): "interfaces", "all", or "default" for the usual choice.
    loads
        Amplitudes of load cases that act permanently, by name, for formats with such loads (ext_ptfm).

    Returns
    -------
    exported
        Written files, and a description of the data of this body that the format cannot hold.

    Raises
    ------
    ExportError
        If the format is unknown, the body lacks data that it needs, or the files cannot be written.
    ModalFileError
        If the modal file cannot be read.
    UnitsError
        If the unit system is unknown.
    """
    if to not in WRITERS:
        raise ExportError(f"export: {unknown_format(to)}")
    writer = WRITERS[to]
    source = "" if isinstance(body, ReducedBody) else f"{Path(body).name}, digest {digest(body)}"
    body = body if isinstance(body, ReducedBody) else read(body)
    system = wanted_units(units or writer.units or body.units, to, writer)
    if nodes not in ("default", "interfaces", "all"):
        raise ExportError(f"export: nodes = {quoted(nodes)}: expected 'interfaces' or 'all'")
    if loads and not writer.takes_loads:
        raise ExportError(f"export: loads: {to} cannot hold constant loads; apply them as forces in the other program")
    converted = convert_units(body, system)
    require_content(converted, to, writer)
    request = Request(converted, with_suffix(Path(path), to), source, nodes, loads or {})
    made = writer.make(request)
    if is_stream(request.path) and list(made.files) != [request.path]:
        names = ", ".join(file.name for file in made.files)
        raise ExportError(
            f"{path}: is a device or a pipe, but {to} consists of several files: {names}; expected a file name"
        )
    try:
        replace_files(made.files)
    except OSError as error:
        raise ExportError(f"{path}: cannot be written: {reason(error)}; nothing was written") from error
    return Exported(tuple(made.files), left_out(converted, writer.holds), made.notes, system)


def wanted_units(units: Units | str, to: str, writer: Writer) -> Units:
    """Return the requested unit system; raise `ExportError` if the other program accepts only another one."""
    system = unit_system(units) if isinstance(units, str) else units
    if writer.units and system.name != writer.units:
        raise ExportError(
            f"export: units {system.name}: the program behind {to} accepts only {writer.units}; choose these"
        )
    return system


def with_suffix(path: Path, to: str) -> Path:
    """Return the path, with the suffix of the format if it has none."""
    suffix = next(known.suffixes[0] for known in FORMATS if known.key == to)
    return path if path.suffix or is_stream(path) else path.with_suffix(suffix)


def require_content(body: ReducedBody, to: str, writer: Writer) -> None:
    """Raise `ExportError` unless the body has the data that the format needs."""
    where = f"export to {to}: body {body.name!r}"
    if body.is_held and not writer.takes_held:
        raise ExportError(
            f"{where} is held to the ground, but the format describes a body in a moving frame; reduce the free body, "
            "and fix it by a joint in the other program"
        )
    for need in writer.needs:
        has, words = NEEDS[need]
        if not has(body):
            raise ExportError(f"{where} {words}")
    if "gyroscopic" in writer.holds:
        try:
            body.moments.require(*INERTIA_TERMS)
        except CmsError as error:
            raise ExportError(f"{where}: {error}") from error
