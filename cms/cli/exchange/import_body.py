"""`cms import`: a body that another program has reduced becomes a modal file."""

import csv
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from cms.cli.console import output_path, say, stages
from cms.errors import ForeignBodyError, ModalFileError
from fe_models.foundation.units import UNIT_SYSTEMS

if TYPE_CHECKING:
    from cms.body.reduced_body import ReducedBody
    from cms.exchange.importers.inertia import Inertia
    from cms.reduction.basis.damping import Damping
    from cms.reduction.basis.frames import Frame

__all__ = ["ImportRequest", "run_import"]


@dataclass(frozen=True)
class ImportRequest:
    """The arguments of `cms import`."""

    files: tuple[str, ...]  #: paths, or ROLE=path
    units: str | None
    output: Path | None = None
    name: str | None = None
    form: str | None = None
    nodes: Path | None = None
    boundary: str | None = None  #: "3,11,19"
    interfaces: tuple[str, ...] = ()  #: "NAME=3,11"
    full_mass: tuple[str, ...] = ()  #: files of the full model
    nodal_masses: Path | None = None
    mesh: Path | None = None
    density: float | None = None
    to: str = "tisserand"
    at: str | None = None
    damping: float | None = None
    mend_mass: bool = False
    accept: tuple[str, ...] = ()


def run_import(request: ImportRequest) -> "ReducedBody":
    """Import, write the modal file, and return the body.

    Raises
    ------
    CmsError
        If no units are given, a file cannot be read, or the files do not make a body.
    """
    from cms.body.modal_file.file import write
    from cms.exchange.importers.import_body import import_body

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
                mend_mass=request.mend_mass,
                accept=request.accept,
            )
        with clock("write"):
            write(body, path)
    say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")
    return body


def named_files(words: tuple[str, ...]) -> "list[Path] | dict[str, Path]":
    """Return paths, or paths by role if files are given as ROLE=path."""
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
    """Return the nodes of each interface from NAME=3,11; None if none are given."""
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
    from fe_models.files.matrices.read_matrices import read_matrices
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
    if not path.is_file():
        raise ForeignBodyError(f"--nodal-masses {path}: there is no such file")
    numbers, masses = [], []
    with path.open(newline="", encoding="utf-8", errors="replace") as file:
        for k, row in enumerate(csv.reader(file), start=1):
            if not row or row[0].lstrip().startswith("#"):
                continue
            try:
                number, mass = int(row[0]), float(row[1])
            except (ValueError, IndexError):
                if k == 1:
                    continue  # a header line
                raise ForeignBodyError(f"{path}, line {k}: expected node, mass, got {','.join(row)[:60]!r}") from None
            numbers.append(number)
            masses.append(mass)
    return np.array(numbers, dtype=np.int64), np.array(masses)


def frame_of(request: ImportRequest) -> "Frame | None":
    """Return the requested frame; None: the default."""
    from cms.cli.frame import FrameRequest
    from cms.cli.frame import frame_of as frame_of_request

    if request.to == "tisserand" and request.at is None:
        return None
    return frame_of_request(FrameRequest(Path(request.files[0]), request.to, request.at))


def damping_of(request: ImportRequest) -> "Damping | None":
    """Return the damping requested in addition to that of the files."""
    from cms.reduction.basis.damping import ModalDamping

    return None if request.damping is None else ModalDamping(request.damping)
