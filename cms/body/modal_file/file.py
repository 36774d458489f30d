"""The modal file: a reduced body as self-describing HDF5 (specified in docs/modal_file.md)."""

import os
from pathlib import Path

from cms.body.modal_file.content import FORMAT, body_of, content_of, require_same_frequencies, require_same_invariants
from cms.body.modal_file.entries import in_units
from cms.body.reduced_body import ReducedBody
from cms.errors import CmsError, ModalFileError
from fe_models.foundation.paths import is_stream
from fe_models.foundation.seal import Kind
from fe_models.foundation.sealed_hdf5 import read_sealed, write_sealed
from fe_models.foundation.units import Units, unit_system

__all__ = ["FORMAT", "VERSION", "convert_units", "digest", "read", "write"]

SUFFIXES = (".h5", ".hdf5")
VERSION = 6  #: version of the format; a reader rejects later versions and reads all earlier ones
KIND = Kind(FORMAT, VERSION, ModalFileError, "`cms reduce` or `cms.write`")


def write(reduced: ReducedBody, path: str | os.PathLike[str]) -> None:
    """Write a reduced body to a modal file. An existing file is replaced in one step or stays unchanged.

    Parameters
    ----------
    reduced
        The body to write.
    path
        Name of the modal file, usually with the ending .h5.

    Raises
    ------
    ModalFileError
        If the file cannot be written, or its name says that it is another kind of file.
    """
    if (suffix := Path(path).suffix.lower()) and suffix not in SUFFIXES and not is_stream(Path(path)):
        raise ModalFileError(
            f"{path}: a modal file ends in {' or '.join(SUFFIXES)}, got {suffix}; other formats are written by "
            "cms.export_body (cms export --to)"
        )
    write_sealed(content_of(reduced, version_of(reduced)), path)


def version_of(reduced: ReducedBody) -> int:
    """Return the earliest version that can store the body, so that older readers accept as many bodies as possible.

    6: geometric stiffness lacks the loads at some interfaces; 5: nodes or elements have user numbers, or there are
    sets, points with rotations, or recovery matrices; 4: loads that rotate with the body are recorded, or inertia terms
    are missing; 3: the body is held; 2: all other bodies.
    """
    if reduced.geometric is not None and not all(reduced.geometric.is_loaded):
        return 6
    if not reduced.numbering.is_empty or reduced.kept is not None or reduced.recovery:
        return 5
    if reduced.moments.missing or (reduced.geometric is not None and reduced.geometric.turned is not None):
        return 4
    return 3 if reduced.is_held else 2


def read(path: str | os.PathLike[str], *, units: Units | str | None = None) -> ReducedBody:
    """Read a modal file; every array is bitwise equal to the written one, unless other units are requested.

    Parameters
    ----------
    path
        File of this version or an older one.
    units
        Unit system of the numbers, or its name; default: that of the file.

    Raises
    ------
    ModalFileError
        If the file is missing, truncated, altered, of another kind or of a later version, or if its data are
        inconsistent.
    UnitsError
        If the unit system is unknown.
    """
    wanted = unit_system(units) if isinstance(units, str) else units
    content = read_sealed(path, KIND)
    try:
        body = body_of(content)
        require_same_invariants(content, body.moments)
        require_same_frequencies(content, body)
    except CmsError as error:
        raise ModalFileError(f"{Path(path)}: {error}") from error
    return body if wanted is None else convert_units(body, wanted)


def convert_units(reduced: ReducedBody, units: Units | str) -> ReducedBody:
    """Return the same body in other units; the body itself if it is already in these units.

    q has the unit mass^(1/2) length, so modal coordinates, such as initial values, are different numbers in other
    units.

    Parameters
    ----------
    reduced
        The body to convert.
    units
        A unit system or its name.

    Raises
    ------
    UnitsError
        If the unit system is unknown.
    """
    new = unit_system(units) if isinstance(units, str) else units
    if new == reduced.units:
        return reduced
    record = {"units converted from": reduced.units.name}
    content = in_units(content_of(reduced, VERSION), reduced.units, new)
    provenance = {"/provenance": dict(reduced.provenance) | record}
    attributes = dict(content.attributes) | provenance
    return body_of(type(content)(content.format, content.version, content.datasets, attributes))


def digest(path: str | os.PathLike[str]) -> str:
    """Return the digest of a modal file: equal for equal contents (sha256, 64 hexadecimal digits)."""
    return str(read_sealed(path, KIND).attributes["/"]["digest"])
