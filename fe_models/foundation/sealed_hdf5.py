"""HDF5 files that reveal every change of a byte and never exist half written.

There are two checks: the seal (seal.py), compared before HDF5 opens the file, and the digest over all contents
(hdf5_file.py), which survives repacking and shows whether two files have equal contents.
"""

import io
import os
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.foundation.errors import ModalFileError
from fe_models.foundation.hdf5_file import (
    DIGEST,
    SHA256,
    Attribute,
    Manifest,
    as_attribute,
    described,
    digest_of_lines,
    opened,
    own_items,
    write_sealed_file,
)
from fe_models.foundation.paths import is_stream, part_of, replace_file
from fe_models.foundation.seal import SEAL_SIZE, Kind, altered, check_seal, newer, reason, seal_of
from fe_models.foundation.tall.on_disk import release

__all__ = ["Attribute", "Content", "Dataset", "read_sealed", "write_sealed"]

LARGE = 1 << 26  #: bytes of numbers above which the file is written directly, not first in memory


@dataclass(frozen=True, eq=False)
class Dataset:
    """An array with its unit and description in the file."""

    values: Any  #: float64 or int64 array, or a tuple of strings
    unit: str = "1"
    description: str = ""


@dataclass(frozen=True, eq=False)
class Content:
    """Content of a file: datasets by path, and attributes by name for each group path."""

    format: str
    version: int
    datasets: Mapping[str, Dataset]
    attributes: Mapping[str, Mapping[str, Attribute]] = field(default_factory=dict)


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
    """Read a file of this kind, up to its version, after checks of its seal and its digest.

    Raises
    ------
    Exception
        The error of the kind, if the file is missing, of another kind, of a later version, truncated or altered.
    """
    path = Path(path)
    with opened(path, kind, has_seal=check_seal(path, kind)) as file:
        found = as_attribute(file.attrs.get("format"))
        if found != kind.format:
            what = f"a {str(found)[:80]!r}" if found else "HDF5 of another program"
            raise kind.error(f"{path}: not a {kind.format}: {what}")
        stated = as_attribute(file.attrs.get("version"))
        if isinstance(stated, int) and stated > kind.version:
            raise newer(path, kind, stated)
        return Content(kind.format, int(stated or 0), *walk(file, path, kind))


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
    """Return all datasets and all group attributes; raise the error of the kind if one differs from its digest."""
    import h5py

    datasets, groups, lines = {}, {}, []
    for name, item in own_items(file, path, kind).items():
        attributes = {key: as_attribute(item.attrs[key]) for key in item.attrs}
        written = {"/": DIGEST}.get(name) if not isinstance(item, h5py.Dataset) else SHA256
        expected = attributes.pop(written, None) if written else None
        lines += [described(f"{name}@{key}", value)[3] for key, value in attributes.items()]
        if isinstance(item, h5py.Dataset):
            values = as_values(item[()])
            _, _, sha256, line = described(name, values)
            if sha256 != expected:
                raise altered(path, kind, f"dataset {name} does not have its sha256")
            datasets[name] = Dataset(values, str(attributes.get("unit", "1")), str(attributes.get("description", "")))
            lines.append(line)
        else:
            groups[name] = attributes
            if name == "/":
                digest = expected
    if digest_of_lines(lines) != digest:
        raise altered(
            path, kind, "its contents do not have its digest (an attribute or a name was changed, or one is missing)"
        )
    groups["/"][DIGEST] = str(digest)
    return datasets, groups


def as_values(value: Any) -> Any:
    """Return a dataset as a float64 or int64 array, or as a tuple of strings."""
    array = np.asarray(value)
    if array.dtype.kind in "SO":
        return tuple(word.decode("utf-8") if isinstance(word, bytes) else str(word) for word in array.ravel())
    return array
