"""Import of bodies that another program has reduced: formats by suffix and content, the same checks for all."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from cms.body.reduced_body import ReducedBody
from cms.errors import CmsError, ForeignBodyError
from cms.exchange.importers.inertia import Inertia
from cms.exchange.importers.modal_body import ModalBody, body_of_modes
from cms.exchange.importers.superelement import Superelement, superelement_of_matrices
from cms.exchange.importers.superelement_body import ImportOptions, body_of_superelement
from cms.exchange.programs.ext_ptfm import is_ext_ptfm, read_ext_ptfm
from cms.exchange.programs.exudyn import is_exudyn, read_exudyn
from cms.exchange.programs.mbdyn import is_mbdyn, read_mbdyn
from cms.exchange.programs.mbsim import is_mbsim, read_mbsim
from cms.exchange.programs.nastran import is_nastran, read_nastran
from cms.exchange.programs.sid_fem_reader import is_sid_fem, read_sid_fem, read_sid_fem_fembeam
from cms.reduction.basis.damping import Damping
from cms.reduction.basis.frames import Frame
from fe_models.body.fe_body import dofs_of
from fe_models.errors import FeModelsError
from fe_models.files.matrices.body import numbers_of
from fe_models.files.matrices.foreign_matrices import SCALAR, ForeignMatrices
from fe_models.files.read_matrices import read_matrices
from fe_models.files.read_mesh import read_geometry
from fe_models.foundation.arrays import Array
from fe_models.foundation.formats import HEAD, Format
from fe_models.foundation.paths import bytes_of, file_digest, reading
from fe_models.foundation.units import Units, unit_system
from fe_models.foundation.words import nearest, quoted

__all__ = ["BODY_FORMATS", "REDUCED_MATRICES", "BodyFormat", "ForeignFiles", "import_body"]


# the formats of bodies that another program has reduced ---------------------------------------------------------------


Places = Mapping[int, Array]  #: position of each node, by node number
REDUCED = "reduced body"


def never(path: Path, head: bytes) -> bool:
    """Return False, for formats that the content of a file cannot identify and that must be named."""
    return False


@dataclass(frozen=True, kw_only=True)
class BodyFormat(Format):
    """Format of reduced bodies: recognition of its files, and its reader."""

    is_it: Callable[[Path, bytes], bool]  #: recognises a file by its path and its first bytes
    #: reads a body from files, body name, and additional node positions
    read: Callable[[Sequence[Path], str, Places], Superelement | ModalBody]


#: format by key; the first that recognises a file reads it, unrecognised files are matrices (`read_matrices`)
BODY_FORMATS = {known.key: known for known in (
    BodyFormat(
        "external superelement (EXTSEOUT)", "Nastran", REDUCED, (".op4", ".pch", ".asm"),
        key="nastran", tried="NX Nastran (sample of pyYeti)",
        lost="3C, 4C, 5C unless masses are beside; forces of elements of unknown items; structural damping",
        is_it=is_nastran, read=read_nastran,
    ),
    BodyFormat(
        "ExternalFlexibleFfrBody, HDF5", "MBSim", REDUCED, (".h5",), key="mbsim",
        tried="files of our writer; names and orders of its source", is_it=is_mbsim, read=read_mbsim,
    ),
    BodyFormat(
        "ObjectFFRFreducedOrder, npz", "Exudyn", REDUCED, (".npz",), key="exudyn",
        tried="files of our writer, which exudyn 1.13.6 runs", lost="stress (a pickled object, which is never opened)",
        is_it=is_exudyn, read=read_exudyn,
    ),
    BodyFormat(
        "modal joint, FEM data", "MBDyn", REDUCED, (".fem",), key="mbdyn", tried="files of our writer",
        lost="stress stiffening where an interface is no single node", is_it=is_mbdyn, read=read_mbdyn,
    ),
    BodyFormat(
        "SID_FEM, m1(row, q, column)", "PY_SID, EMBSlib", REDUCED, (".SID_FEM",), key="sid_fem",
        tried="files of our writer", lost="geometric stiffness without 5C (Gr of first order)",
        is_it=is_sid_fem, read=read_sid_fem,
    ),
    BodyFormat(
        "SID_FEM, m1(row, column, q)", "FEMBeam, welib", REDUCED, (".SID_FEM",), key="sid_fem-fembeam",
        tried="files of our writer", lost="geometric stiffness without 5C (Gr of first order)",
        is_it=never, read=read_sid_fem_fembeam,
    ),
    BodyFormat(
        "ExtPtfm, FlexASCII", "OpenFAST", REDUCED, (".dat",), key="ext_ptfm", tried="files of our writer",
        lost="3C, 4C, 5C; loads that change with time; the place of the node",
        is_it=is_ext_ptfm, read=read_ext_ptfm,
    ),
)}  # fmt: skip
#: formats of matrices whose rows are those of a reduced body
REDUCED_MATRICES = (
    Format(
        "CMS superelement", "ANSYS", REDUCED, (".sub",), key="matrices",
        tried="example-data of PyMAPDL (cp56.sub)", lost="3C, 4C, 5C unless masses are beside",
    ),
    Format(
        "*SUBSTRUCTURE MATRIX OUTPUT, *USER ELEMENT", "Abaqus, CalculiX", REDUCED, (".mtx",),
        key="matrices", tried="our own matrices in its layout",
        lost="3C, 4C, 5C unless masses are beside; retained modes; places: a deck beside it",
    ),
    Format(
        "reduced matrices", "any of the matrix formats", REDUCED, (".mtx", ".op4", ".npz", ".mat"),
        key="matrices", tried="our own Craig-Bampton matrices",
        lost="3C, 4C, 5C unless masses are beside; stress; rows say their dofs, or --boundary does",
    ),
)  # fmt: skip


# import body ----------------------------------------------------------------------------------------------------------


#: one file, several files, or the file for each role
ForeignFiles = str | Path | Iterable[str | Path] | Mapping[str, str | Path]


def import_body(
    files: ForeignFiles | ForeignMatrices,
    *,
    units: Units | str,
    name: str | None = None,
    form: str | None = None,
    nodes: str | Path | Places | None = None,
    boundary: Sequence[int] | None = None,
    interfaces: Mapping[str, Sequence[int]] | None = None,
    inertia: Inertia | None = None,
    frame: Frame | None = None,
    damping: Damping | None = None,
    repair_mass: bool = False,
    accept: Sequence[str] = (),
) -> ReducedBody:
    """Make a reduced body from the files of another program.

    Superelements (matrices over boundary dofs and modal coordinates, including rigid motion) and floating-frame bodies
    (modes without rigid motion, with their mass integrals) become reduced bodies. Data that are not in the files are
    missing in the body: `Moments.missing`, stress, geometric stiffness.

    Parameters
    ----------
    files
        A file, several files of one body, or role ("K", "M", "D") -> file of matrices; or matrices that were read.
    units
        Units of all numbers in the files; none of these formats records them.
    name
        Name of the body; default: the name of the first file.
    form
        Key of `BODY_FORMATS`, or "matrices"; None: determined from suffix and content.
    nodes
        Node positions that are not in the files: a deck or mesh with the same node numbers, or number -> position.
    boundary
        For matrices without a list of dofs: boundary nodes in the order of the rows, six dofs each; the remaining rows
        are modal coordinates.
    interfaces
        Interface name -> node numbers; default: the interfaces in the files, or every boundary node with six dofs.
    inertia
        For superelements: `FullMass`, `NodalMasses` or `MeshMass`, which give 3C, 4C and 5C; reduced matrices do not.
    frame
        Body frame; default: Tisserand (mean axes).
    damping
        Damping in addition to the damping in the files.
    repair_mass
        Whether to set slightly negative eigenvalues of a reduced mass to zero; a note reports this.
    accept
        Findings to accept: "units" means implausible size, density or wave speed.

    Raises
    ------
    ForeignBodyError
        If a file is missing, damaged or of unknown kind, if files belong to two bodies, or if needed data are missing.
    BodyError
        If the body is held, a mechanism, or its mass is indefinite.
    """
    options = ImportOptions(
        unit_system(units) if isinstance(units, str) else units,
        interfaces, inertia, frame, damping, repair_mass, tuple(accept),
    )  # fmt: skip
    places = places_of(nodes)
    if isinstance(files, ForeignMatrices):
        options = with_names(options, files)
        return body_of_superelement(of_matrices(files, name or "superelement", places, boundary), options)
    paths = paths_of(files)
    name = name or paths[0].stem
    heads = [bytes_of(str(path), path, ForeignBodyError, n=HEAD) for path in paths]
    key = form or format_of(paths, heads)
    if key != "matrices" and key not in BODY_FORMATS:
        raise ForeignBodyError(f"format {quoted(key)}: unknown{nearest(key, [*BODY_FORMATS, 'matrices'])}")
    with reading(str(paths[0]), paths[0], key, ForeignBodyError, (CmsError, FeModelsError)):
        if key == "matrices":
            read = read_matrices(files if isinstance(files, Mapping) else paths)
            options = with_names(options, read)
            body: Superelement | ModalBody = of_matrices(read, name, places, boundary)
        else:
            if boundary is not None:
                raise ForeignBodyError(f"boundary: files of {key} list their dofs themselves; remove it")
            body = BODY_FORMATS[key].read(paths, name, places)
    if isinstance(body, Superelement):
        return body_of_superelement(body, options)
    record = {f"file {path}": file_digest(path) for path in paths}
    return body_of_modes(replace(body, provenance={**record, **body.provenance}), options)


def paths_of(files: ForeignFiles) -> list[Path]:
    """Return the paths as a list."""
    if isinstance(files, Mapping):
        files = list(files.values())
    paths = [Path(files)] if isinstance(files, str | Path) else [Path(path) for path in files]
    if not paths:
        raise ForeignBodyError("import: expected at least one file, got none")
    return paths


def format_of(paths: Sequence[Path], heads: Sequence[bytes]) -> str:
    """Return the key of the first format that recognises one of the files; "matrices" if none does."""
    for key, known in BODY_FORMATS.items():
        if any(known.is_it(path, head) for path, head in zip(paths, heads, strict=True)):
            return key
    return "matrices"


def of_matrices(foreign: ForeignMatrices, name: str, places: Places, boundary: Sequence[int] | None) -> Superelement:
    """Return the superelement of matrices; given boundary nodes define the rows if the files do not list them."""
    if boundary is not None:
        n = foreign.n_dof or 0
        if foreign.dofs is not None:
            raise ForeignBodyError("boundary: the files list the dofs of their rows themselves; remove it")
        if not 6 * len(boundary) <= n or not len(boundary):
            raise ForeignBodyError(
                f"boundary: {len(boundary)} nodes have {6 * len(boundary)} dofs, the matrices have {n} rows; expected "
                "at least one node, and not more dofs than rows"
            )
        own = dofs_of(np.asarray(boundary), 6)
        n_modes = n - len(own)
        modal = np.stack([1 + np.arange(n_modes), np.full(n_modes, SCALAR)], axis=1)
        note = f"the first {len(own)} rows are six dofs of each of nodes {list(map(int, boundary))}, as given"
        foreign = replace(foreign, dofs=np.concatenate([own, modal]), notes=(*foreign.notes, note))
    return superelement_of_matrices(foreign, name, places)


def with_names(options: ImportOptions, foreign: ForeignMatrices) -> ImportOptions:
    """Return the options, with the interfaces of the files if the user names none."""
    return options if options.interfaces is not None else replace(options, interfaces=named_interfaces(foreign))


def named_interfaces(foreign: ForeignMatrices) -> dict[str, list[int]] | None:
    """Return the node numbers of each interface, if the files name the interface of each node; otherwise None."""
    names = np.asarray(foreign.others.get("interfaces", ()))
    if foreign.node_numbers is None or names.dtype.kind != "U" or names.shape != (len(foreign.node_numbers),):
        return None
    found: dict[str, list[int]] = {}
    for text, number in zip(names.tolist(), foreign.node_numbers.tolist(), strict=True):
        found.setdefault(text.strip(), []).append(number)
    return None if "" in found else found


def places_of(nodes: str | Path | Places | None) -> Places:
    """Return node positions by node number."""
    if nodes is None:
        return {}
    if isinstance(nodes, str | Path):
        geometry = read_geometry(nodes)
        return dict(zip(map(int, numbers_of(geometry)), geometry.nodes, strict=True))
    return {int(number): np.asarray(place, dtype=float) for number, place in nodes.items()}
