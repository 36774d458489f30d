"""CAD file opened in gmsh: its solids, faces and length unit."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np

from fe_models.errors import MeshError
from fe_models.files.cad.cad_faces import CadFace, cad_faces
from fe_models.files.cad.cad_units import CAD_FORMATS, length_unit
from fe_models.files.cad.gmsh_model import gmsh_call, gmsh_model
from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ArgumentError
from fe_models.foundation.paths import bytes_of
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.units import Units, unit_system
from fe_models.foundation.words import nearest, quoted

__all__ = ["CadModel", "CadPart", "open_cad", "read_cad"]

OVERLAP = 1e-6  #: shared volume of solids divided by their volume, up to which it is rounding
OPTIONS: dict[str, float | str] = {
    "Geometry.OCCImportLabels": 1,
    "Geometry.OCCScaling": 1.0,
    "Mesh.MeshSizeMin": 0.0,
    "Mesh.MeshSizeMax": 1e22,
    "Mesh.MeshSizeFromCurvature": 0,
    "Mesh.ElementOrder": 1,
}  #: gmsh options at the start; changes while the model is open are discarded with it
MILLIMETRE = 1e-3  #: one millimetre [m]
#: name of each length unit of the CAD kernel, by its size in metres
KERNEL_UNITS = {1e-3: "MM", 1e-2: "CM", 1.0: "M", 1e3: "KM", 0.0254: "INCH", 0.3048: "FT"}


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ArgumentError)
class CadPart:
    """Content of a CAD file, in the length unit of the job.

    Parameters
    ----------
    path
        Path of the CAD file.
    digest
        sha256 of the file.
    format
        "STEP", "IGES" or "BREP".
    unit
        Length unit of the file; "" if it has none.
    units
        Unit system of the job.
    solids
        Names of the solids; "" for a solid without name.
    faces
        Faces of the geometry, by ascending number.
    volume
        Volume of all solids [length³].
    lo
        Lower corner of the bounding box, (3,).
    hi
        Upper corner of the bounding box, (3,).
    """

    path: Path
    digest: str
    format: str
    unit: str
    units: Units
    solids: tuple[str, ...]
    faces: tuple[CadFace, ...]
    volume: float
    lo: Array
    hi: Array

    @property
    def description(self) -> str:
        """Description of the file and of the conversion between its unit and that of the job."""
        symbol = self.units.length_symbol
        unit = f"in {self.unit}, taken to {symbol}" if self.unit else f"without unit, its numbers taken as {symbol}"
        n, m = len(self.solids), len(self.faces)
        return f"{self.format} {unit}; {n} solid{'s' * (n > 1)}, {m} faces, volume {self.volume:.6g} {symbol}³"


@dataclass(frozen=True, eq=False)
class CadModel:
    """An open model of gmsh and its content."""

    gmsh: ModuleType
    part: CadPart
    scale: float  #: length unit of the job, in units of the model


def read_cad(path: str | Path, *, units: Units | str) -> CadPart:
    """Return solids and faces of a CAD file.

    Parameters
    ----------
    path
        STEP file (.step, .stp), IGES file (.iges, .igs) or BREP file (.brep).
    units
        Unit system of the returned numbers. STEP and IGES files state their length unit and are converted. BREP files
        have none; their numbers are not changed.

    Raises
    ------
    MeshError
        If the file is missing, damaged, of another kind, states no length unit or has no solid, or solids overlap.
    MeshingError
        If gmsh is not installed.
    """
    with open_cad(path, units=units) as model:
        return model.part


@contextmanager
def open_cad(path: str | Path, *, units: Units | str) -> Iterator[CadModel]:
    """Open a CAD file in gmsh, as `read_cad` does, until the context ends.

    (1) the unit of the file is read from its text. gmsh converts every STEP file to millimetres. It leaves IGES files
        in their unit: the kernel only sews faces whose edges are at most 1e-6 apart, and in metres the coordinates are
        not written to that accuracy
    (2) faces without solids are sewn to one solid if they enclose a volume; several solids are cut where they touch, so
        that they share faces and their meshes are compatible
    (3) every number is divided by `scale`, the length unit of the job in units of the model
    """
    path = Path(path)
    units = unit_system(units) if isinstance(units, str) else units
    content = _content(path)
    kind = CAD_FORMATS[path.suffix.lower()].name
    unit = length_unit(path, content)
    model_unit = unit[1] if unit is not None and kind == "IGES" and unit[1] in KERNEL_UNITS else MILLIMETRE
    scale = 1.0 if unit is None else units.length / model_unit
    where = f"geometry {path}"
    with gmsh_model(path.stem, OPTIONS | {"Geometry.OCCTargetUnit": KERNEL_UNITS[model_unit]}) as gmsh:
        with gmsh_call(where, advice=f"is it a {kind} file, whole and of this kind?"):
            if kind == "IGES":
                _prepare_units(gmsh)
            shapes = gmsh.model.occ.importShapes(str(path))
            gmsh.model.occ.synchronize()
        if not gmsh.model.getEntities(3):
            _sew(where, gmsh, shapes)
        _join(where, gmsh)
        faces = cad_faces(gmsh, scale)
        part = CadPart(
            path=path,
            digest=sha256(content).hexdigest(),
            format=kind,
            unit="" if unit is None else unit[0],
            units=units,
            solids=tuple(gmsh.model.getEntityName(3, tag).rpartition("/")[2] for _, tag in gmsh.model.getEntities(3)),
            faces=faces,
            volume=_volume(gmsh) / scale**3,
            lo=np.min([face.lo for face in faces], axis=0),
            hi=np.max([face.hi for face in faces], axis=0),
        )
        yield CadModel(gmsh, part, scale)


def _prepare_units(gmsh: ModuleType) -> None:
    """Read an empty IGES file: OpenCASCADE takes no target unit before its first reader."""
    unit = gmsh.option.getString("Geometry.OCCTargetUnit")
    gmsh.option.setString("Geometry.OCCTargetUnit", "")
    with TemporaryDirectory(prefix="units-") as folder:
        empty = Path(folder) / "empty.igs"
        empty.touch()
        gmsh.model.occ.importShapes(str(empty))
    gmsh.option.setString("Geometry.OCCTargetUnit", unit)


def _content(path: Path) -> bytes:
    where = f"geometry {path}"
    if path.suffix.lower() not in CAD_FORMATS:
        raise MeshError(f"{where}: unknown suffix {quoted(path.suffix)}{nearest(path.suffix, CAD_FORMATS)}")
    return bytes_of(where, path, MeshError)


def _volume(gmsh: ModuleType) -> float:
    return float(sum(gmsh.model.occ.getMass(3, tag) for _, tag in gmsh.model.getEntities(3)))


def _sew(where: str, gmsh: ModuleType, shapes: list[tuple[int, int]]) -> None:
    """Make one solid from faces that enclose a volume; IGES files often contain only faces."""
    faces = [tag for dim, tag in shapes if dim == 2]
    if not faces:
        raise MeshError(f"{where}: expected a solid, got neither solids nor faces; is the file whole? Export the solid")
    advice = "export it as a solid, best as STEP"
    with gmsh_call(f"{where}: it holds {len(faces)} faces and no solid, and they do not close", advice=advice):
        shell = gmsh.model.occ.addSurfaceLoop(faces, sewing=True)
        gmsh.model.occ.addVolume([shell])
        gmsh.model.occ.remove([(2, tag) for tag in faces], recursive=True)
        gmsh.model.occ.synchronize()
    borders = gmsh.model.getBoundary(gmsh.model.getEntities(2), combined=True, oriented=False)
    loose = [tag for _, tag in gmsh.model.getEntities(2) if not len(gmsh.model.getAdjacencies(2, tag)[0])]
    solids = gmsh.model.getEntities(3)
    if len(solids) != 1 or borders or loose or not _is_one_shell(gmsh) or not _volume(gmsh) > 0:
        raise MeshError(
            f"{where}: it holds {len(faces)} faces and no solid, and the faces do not close to a single solid "
            f"({len(borders)} edges are open); {advice}"
        )


def _is_one_shell(gmsh: ModuleType) -> bool:
    """Return whether all faces are connected by edges; a body with a cavity cannot be told from two bodies."""
    left = {tag for _, tag in gmsh.model.getEntities(2)}
    front = {left.pop()}
    while front:
        edges = {int(edge) for face in front for edge in gmsh.model.getAdjacencies(2, face)[1]}
        beside = {int(face) for edge in edges for face in gmsh.model.getAdjacencies(1, edge)[0]}
        front = beside & left
        left -= front
    return not left


def _join(where: str, gmsh: ModuleType) -> None:
    """Cut several solids where they touch, so that they share faces; raise an error if solids overlap."""
    solids = gmsh.model.getEntities(3)
    if len(solids) < 2:
        return
    before = _volume(gmsh)
    names = {tag: gmsh.model.getEntityName(3, tag) for _, tag in solids}
    with gmsh_call(f"{where}: its {len(solids)} solids could not be joined", advice="export them as one solid"):
        _, parts = gmsh.model.occ.fragment(solids, [])
        gmsh.model.occ.synchronize()
    after = _volume(gmsh)
    if abs(after - before) > OVERLAP * before or len(gmsh.model.getEntities(3)) != len(solids):
        raise MeshError(
            f"{where}: its {len(solids)} solids overlap: together they fill {after / before:.6g} of the sum of their "
            "volumes, and their mass would count twice. Cut them where they meet, or export fewer"
        )
    for (_, tag), pieces in zip(solids, parts, strict=True):
        for _, piece in pieces:
            gmsh.model.setEntityName(3, piece, names[tag])
