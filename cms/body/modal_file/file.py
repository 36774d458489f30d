"""The modal file: a reduced body as self-describing HDF5 (specified in docs/modal_file.md).

Every change of a byte in a file is detected, and a file is never half written. There are two checks: the seal
(fe_models/foundation/seal.py) is compared before HDF5 opens the file; the digest over all contents
(fe_models/foundation/hdf5_file.py) does not change if the file is repacked, and shows whether two files have equal
contents.
"""

import io
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cms.body.modal_file.content import FORMAT, body_of, content_of, require_same_frequencies, require_same_invariants
from cms.body.modal_file.contents import Attribute, Content, Dataset
from cms.body.modal_file.schema import in_units
from cms.body.reduced_body import ReducedBody
from cms.errors import CmsError, ModalFileError
from fe_models.foundation.hdf5_file import (
    DIGEST,
    Entry,
    Manifest,
    as_attribute,
    described,
    opened,
    own_items,
    require_digest,
    stated_version,
    write_sealed_file,
)
from fe_models.foundation.paths import is_stream, part_of, replace_file
from fe_models.foundation.seal import SEAL_SIZE, Kind, check_seal, reason, seal_of
from fe_models.foundation.tall.on_disk import release
from fe_models.foundation.units import Units, unit_system

__all__ = ["FORMAT", "VERSION", "convert_units", "digest", "read", "write"]

SUFFIXES = (".h5", ".hdf5")
LARGE = 1 << 26  #: size of the numbers above which the file is written directly, without an image in memory [bytes]
VERSION = 6  #: version of the format; a reader accepts all versions up to this one
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
        If the file cannot be written, or its suffix belongs to another kind of file.
    """
    if (suffix := Path(path).suffix.lower()) and suffix not in SUFFIXES and not is_stream(Path(path)):
        raise ModalFileError(
            f"{path}: a modal file ends in {' or '.join(SUFFIXES)}, got {suffix}; other formats are written by "
            "cms.exchange.export_body (cms export --to)"
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
        Unit system of the numbers, or its name; default: the units of the file.

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
    """Return the same body in other units; the body itself if it already has these units.

    q has the unit mass^(1/2) length, so the numerical values of modal coordinates, such as initial values, change too.

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
    content = in_units(content_of(reduced, VERSION), reduced.units, new)
    provenance = dict(reduced.provenance)
    provenance.setdefault("units converted from", reduced.units.name)  # the units of its texts, also if converted twice
    attributes = dict(content.attributes) | {"/provenance": provenance}
    body = body_of(replace(content, attributes=attributes))
    tables = {name: table.in_units(new) for name, table in reduced.recovery.items()}
    return replace(body, recovery=tables) if tables else body


def digest(path: str | os.PathLike[str]) -> str:
    """Return the digest of a modal file: equal for equal contents (sha256, 64 hexadecimal digits)."""
    path = Path(path)
    has_seal = check_seal(path, KIND)
    with opened(path, KIND, has_seal=has_seal) as file:
        stated_version(file, path, KIND)
        if has_seal and (stated := as_attribute(file.attrs.get(DIGEST))):  # the seal covers all bytes of the file
            return str(stated)
        _, groups = walk(file, path, KIND)
        return str(groups["/"][DIGEST])


# sealed files ---------------------------------------------------------------------------------------------------------


def write_sealed(content: Content, path: str | os.PathLike[str]) -> None:
    """Write the content to a temporary file in the same folder, flush it to disk, and rename it.

    Raises
    ------
    ModalFileError
        If the file cannot be written (no folder, no permission, disk full). An existing file is unchanged.
    """
    import h5py

    path = Path(path)
    kind = Kind(content.format, content.version, ModalFileError, "")
    try:
        size = sum(each.values.nbytes for each in content.datasets.values() if isinstance(each.values, np.ndarray))
        if size >= LARGE and not is_stream(path):  # a large image in memory would be wasteful
            whole = path.resolve()  # resolve a link, so that it remains a link
            write_sealed_file(whole, kind, lambda file: fill(file, content), part=part_of(whole))
            return
        image = io.BytesIO()
        with h5py.File(image, "w", userblock_size=SEAL_SIZE, libver=("v108", "v108")) as file:  # readable by every tool
            fill(file, content)
        seal = seal_of(image, kind)
        with image.getbuffer() as data:
            replace_file(path, seal, data[SEAL_SIZE:])
    except ValueError as error:  # a text that cannot be stored
        raise ModalFileError(str(error)) from error
    except OSError as error:
        old = "; the file that was there is unchanged" if path.is_file() else "; nothing was written"
        raise ModalFileError(f"{path}: cannot be written: {reason(error)}{old}") from error


def read_sealed(path: str | os.PathLike[str], kind: Kind) -> Content:
    """Read a file of this kind after checking its version, seal and digest.

    Raises
    ------
    Exception
        The error of the kind, if the file is missing, of another kind, of a later version, truncated or altered.
    """
    path = Path(path)
    with opened(path, kind, has_seal=check_seal(path, kind)) as file:
        version = stated_version(file, path, kind)
        return Content(kind.format, version, *walk(file, path, kind))


def fill(file: Any, content: Content) -> None:
    """Write the content into an open `h5py.File`; memory of arrays on disk is released after use."""
    attributes = {name: dict(group) for name, group in content.attributes.items()}
    attributes["/"] = {"format": content.format, "version": content.version, **attributes.get("/", {})}
    manifest = Manifest(file)
    for path, dataset in content.datasets.items():
        manifest.dataset(path, dataset.values, {"unit": dataset.unit, "description": dataset.description})
        release(dataset.values)
    for path, group in attributes.items():
        manifest.attributes(path, group)
    manifest.close()


def walk(file: Any, path: Path, kind: Kind) -> tuple[dict[str, Dataset], dict[str, dict[str, Attribute]]]:
    """Return all datasets and group attributes; raise an error if one differs from its digest."""
    values: dict[str, Any] = {}

    def entry_of(name: str, item: Any) -> Entry:
        """Keep the values of a dataset; return its entry of the manifest."""
        values[name] = as_values(item[()])
        return described(name, values[name])[2]

    attributes = require_digest(own_items(file, path, kind), path, kind, entry_of)
    datasets = {
        name: Dataset(each, str(attributes[name].get("unit", "1")), str(attributes[name].get("description", "")))
        for name, each in values.items()
    }
    return datasets, {name: each for name, each in attributes.items() if name not in datasets}


def as_values(value: Any) -> Any:
    """Return a dataset as a float64 or int64 array, or as a tuple of strings."""
    array = np.asarray(value)
    if array.dtype.kind in "SO":
        return tuple(word.decode("utf-8") if isinstance(word, bytes) else str(word) for word in array.ravel())
    return array
