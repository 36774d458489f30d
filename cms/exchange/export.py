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
from cms.exchange.exporters.writer import Request, Writer, left_out
from cms.exchange.programs.ext_ptfm import make_ext_ptfm
from cms.exchange.programs.exudyn import make_exudyn
from cms.exchange.programs.matrices import make_abaqus, make_mat5, make_mat73, make_matrix_market, make_simscape
from cms.exchange.programs.mbdyn import make_mbdyn
from cms.exchange.programs.mbsim import make_mbsim
from cms.exchange.programs.nastran import make_dmig, make_op4
from cms.exchange.programs.sid_fem import make_sid_fem
from cms.exchange.programs.vtk import make_vtk
from fe_models.foundation.paths import is_stream, replace_files
from fe_models.foundation.presentation import presented
from fe_models.foundation.seal import reason
from fe_models.foundation.units import Units, unit_system
from fe_models.foundation.words import nearest, quoted

__all__ = ["WRITERS", "Exported", "export_body"]

BEYOND_MASS = "inertia beyond the mass matrix, geometric stiffness, stress"
#: data that all formats with matrices over the interfaces can hold
OVER_INTERFACES = frozenset({"damping", "rotation", "load cases", "axes in B"})
SID_FEM = frozenset({"gyroscopic", "geometric", "damping", "rotation", "axes in the mesh"})
REDUCED = "reduced body"
#: writer of each format by its key
WRITERS = {writer.key: writer for writer in (
    Writer(
        "ExternalFlexibleFfrBody, HDF5", "MBSim", REDUCED, (".h5",), key="mbsim",
        tried="h5py; names and orders of its source",
        lost="geometric stiffness, load cases; rotations beside interfaces",
        make=make_mbsim, needs=("modes",),
        content=frozenset({"gyroscopic", "damping", "rotation", "stress", "surface", "axes in the mesh"}),
    ),
    Writer(
        "ObjectFFRFreducedOrder, npz and script", "Exudyn", REDUCED, (".npz", ".py"), key="exudyn",
        tried="exudyn 1.13.6", lost="geometric stiffness, load cases", make=make_exudyn, needs=("modes", "nodes"),
        content=frozenset(
            {"gyroscopic", "damping", "interfaces", "stress", "surface", "axes in B", "axes in the mesh"}
        ),
    ),
    Writer(
        "modal joint, FEM data", "MBDyn", REDUCED, (".fem",), key="mbdyn",
        tried="record groups of its source (1.7, develop)", lost="load cases, stress; rotations beside interfaces",
        make=make_mbdyn, needs=("modes", "interfaces"),
        content=frozenset({"gyroscopic", "geometric", "damping", "rotation", "axes in the mesh"}),
    ),
    Writer(
        "SID_FEM, m1(row, q, column)", "PY_SID, EMBSlib", REDUCED, (".SID_FEM",), key="sid_fem",
        tried="layout of PY_SID's files", lost="second order of J(q), load cases, stress",
        make=partial(make_sid_fem, dialect="sid_fem"), content=SID_FEM, needs=("modes", "interfaces"),
    ),
    Writer(
        "SID_FEM, m1(row, column, q)", "FEMBeam, welib", REDUCED, (".SID_FEM",), key="sid_fem-fembeam",
        lost="second order of J(q), load cases, stress",
        make=partial(make_sid_fem, dialect="sid_fem-fembeam"), content=SID_FEM, needs=("modes", "interfaces"),
    ),
    Writer(
        "MAT-file of version 5", "MATLAB, Octave", REDUCED, (".mat",), key="mat", tried="scipy 1.17",
        lost=BEYOND_MASS, make=make_mat5, content=OVER_INTERFACES | {"interfaces", "surface"}, takes_held=True,
        needs=("interfaces",),
    ),
    Writer(
        "MAT-file of version 7.3", "MATLAB", REDUCED, (".mat",), key="mat73",
        tried="h5py, by the attributes of MATLAB", lost=BEYOND_MASS, make=make_mat73,
        content=OVER_INTERFACES | {"interfaces", "surface"}, takes_held=True, needs=("interfaces",),
    ),
    Writer(
        "Reduced Order Flexible Solid (P, K, M, C)", "Simscape Multibody", REDUCED, (".mat",), key="simscape",
        tried="scipy 1.17", lost=f"{BEYOND_MASS}, load cases", make=make_simscape,
        content=(OVER_INTERFACES | {"interfaces"}) - {"load cases"}, units="m-kg-s", needs=("interfaces",),
    ),
    Writer(
        "Matrix Market", "many", REDUCED, (".mtx",), key="matrix-market", tried="scipy 1.17", lost=BEYOND_MASS,
        make=make_matrix_market, content=OVER_INTERFACES | {"interfaces"}, takes_held=True, needs=("interfaces",),
    ),
    Writer(
        "OUTPUT4 with .asm, .pch", "Nastran", REDUCED, (".op4", ".asm", ".pch"), key="nastran-op4",
        tried="pyYeti 1.4.7, pyNastran 1.4", lost=BEYOND_MASS, make=make_op4, content=OVER_INTERFACES,
        takes_held=True, needs=("interfaces",),
    ),
    Writer(
        "DMIG", "Nastran", REDUCED, (".pch",), key="nastran-dmig", tried="pyYeti 1.4.7, pyNastran 1.4",
        lost=f"{BEYOND_MASS}, digits beyond the tenth", make=make_dmig, content=OVER_INTERFACES, takes_held=True,
        needs=("interfaces",),
    ),
    Writer(
        "linear *USER ELEMENT", "Abaqus", REDUCED, (".inp",), key="abaqus", tried="our own reader",
        lost=f"{BEYOND_MASS}, load cases", make=make_abaqus, content=OVER_INTERFACES - {"load cases"},
        takes_held=True, needs=("interfaces",),
    ),
    Writer(
        "ExtPtfm, FlexASCII", "OpenFAST", REDUCED, (".dat",), key="ext_ptfm", tried="its documentation",
        lost=f"{BEYOND_MASS}, all interfaces but one", make=make_ext_ptfm, content=OVER_INTERFACES, takes_held=True,
        takes_loads=True, units="m-kg-s", needs=("interfaces",),
    ),
    Writer(
        "VTU, PVD", "ParaView", REDUCED, (".pvd", ".vtu"), key="vtk", tried="pyvista, meshio",
        lost="all but shapes and stress", make=make_vtk,
        content=frozenset({"surface", "stress", "axes in the mesh"}), takes_held=True, needs=("modes", "nodes"),
    ),
)}  # fmt: skip

NEEDS = {
    "modes": (
        lambda body: body.n_q > 0,
        "has no modes, so it is rigid; enter its mass and inertia in the other program",
    ),
    "nodes": (lambda body: len(body.nodes) > 0, "has no nodes with shapes, which the format requires"),
    "interfaces": (lambda body: len(body.interfaces) > 0, "has no interfaces, whose motion the format requires"),
}  #: for each key of `Writer.needs`: test of the body, and text of the error


@presented
@dataclass(frozen=True)
class Exported:
    """Written files, and the data that the format cannot hold."""

    files: tuple[Path, ...]
    left_out: tuple[str, ...]  #: descriptions of body data that the files do not contain
    notes: tuple[str, ...]  #: positions of the interfaces, and other facts for the user of the other program
    units: Units  #: units of the numbers in the files


#: formats that are not documented, by their names and those of their programs (docs/adams_simpack.md)
UNDOCUMENTED = {"mnf": "Adams", "adams": "Adams", "fbi": "Simpack", "simpack": "Simpack"}


def unknown_format(name: str) -> str:
    """Return the message for a format that this project does not write."""
    program = UNDOCUMENTED.get(name.lower())
    if program is None:
        return f"unknown format {quoted(name)}{nearest(name, WRITERS)}"
    near = "nastran-dmig" if program == "Adams" else "sid_fem"
    return (
        f"{quoted(name)}: the file format of {program} is not documented, so it cannot be written; "
        f"{near} may be an alternative, see docs/adams_simpack.md"
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
    request = Request(converted, with_suffix(Path(path), writer), source, nodes, loads or {})
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
    return Exported(tuple(made.files), left_out(converted, writer.content), made.notes, system)


def wanted_units(units: Units | str, to: str, writer: Writer) -> Units:
    """Return the requested unit system; raise `ExportError` if the other program accepts only another one."""
    system = unit_system(units) if isinstance(units, str) else units
    if writer.units and system.name != writer.units:
        raise ExportError(
            f"export: units {system.name}: the program behind {to} accepts only {writer.units}; choose these"
        )
    return system


def with_suffix(path: Path, writer: Writer) -> Path:
    """Return the path, with the suffix of the format if it has none."""
    return path if path.suffix or is_stream(path) else path.with_suffix(writer.suffixes[0])


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
    if "gyroscopic" in writer.content:
        try:
            body.moments.require(*INERTIA_TERMS)
        except CmsError as error:
            raise ExportError(f"{where}: {error}") from error
