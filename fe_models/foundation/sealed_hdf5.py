"""HDF5 files that show every change of a byte and never exist half written.

Two checks stand one behind the other. The *seal*, 512 bytes of text before the HDF5 part (its "user block", which HDF5
readers skip), holds the length of the file and the sha256 of all that follows: it is compared before HDF5 touches
the file. The *digest*, an attribute of the root, is the sha256 over names, types, shapes and sha256 of all contents: it
does not depend on how HDF5 lays them out, so it survives repacking and tells whether two files say the same.
"""

import hashlib
import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.foundation.errors import ModalFileError
from fe_models.foundation.paths import near_file, replace_file

__all__ = ["SEAL_SIZE", "Content", "Dataset", "read_sealed", "write_sealed"]

SEAL_SIZE = 512  #: bytes of the seal; the smallest user block that HDF5 knows
DIGEST = "digest"  #: name of the root attribute
Attribute = str | int | float


@dataclass(frozen=True, eq=False)
class Dataset:
    """An array with the unit and the words that describe it in the file."""

    values: Any  #: float64 or int64 array, or a tuple of strings
    unit: str = "1"
    description: str = ""


@dataclass(frozen=True, eq=False)
class Content:
    """What a file says: datasets by path, and attributes by path of their group and name."""

    format: str
    version: int
    datasets: Mapping[str, Dataset]
    attributes: Mapping[str, Mapping[str, Attribute]] = field(default_factory=dict)


def write_sealed(content: Content, path: str | os.PathLike[str]) -> None:
    """Write the content to a temporary name in the same folder, make it durable, and move it into place.

    Raises
    ------
    ModalFileError
        If the file cannot be written (no folder, no permission, disk full); an old file of that name is unchanged.
    """
    image = hdf5_image(content)
    path = Path(path)
    try:
        replace_file(path, seal(content.format, content.version, image), image)
    except OSError as error:
        old = "; the file that was there is unchanged" if path.is_file() else "; nothing was written"
        raise ModalFileError(f"{path}: cannot be written: {reason(error)}{old}") from error


def read_sealed(path: str | os.PathLike[str], *, format: str, version: int) -> Content:
    """Read a file of this format, up to this version, after checking its seal and its digest.

    Raises
    ------
    ModalFileError
        If the file is missing, of another kind, of a newer version, truncated or altered.
    """
    path = Path(path)
    return checked_content(path, format, version, has_seal=check_seal(path, format, version))


# The seal ------------------------------------------------------------------------------------------------------------


def seal(format: str, version: int, image: bytes) -> bytes:
    """Return the seal of an HDF5 image, 512 bytes."""
    return seal_text(format, version, SEAL_SIZE + len(image), hashlib.sha256(image).hexdigest())


def seal_text(format: str, version: int, n_bytes: int, sha256: str) -> bytes:
    """Return the seal, 512 bytes of ASCII: five lines, filled up with spaces."""
    text = (
        f"floatframe {format} {version}\n"
        f"bytes {n_bytes}\n"
        f"sha256 {sha256}\n"
        f"HDF5 begins at byte {SEAL_SIZE}; sha256 is that of all bytes from there to the end.\n"
    )
    return text.encode("ascii").ljust(SEAL_SIZE - 1) + b"\n"


def check_seal(path: Path, format: str, version: int) -> bool:
    """Compare the seal with the file and raise if it is broken; return False if there is none that could be broken."""
    try:
        with open(path, "rb") as file:
            head = file.read(SEAL_SIZE)
            sha256 = hashlib.file_digest(file, "sha256").hexdigest()
            n_bytes = file.tell()
    except FileNotFoundError:
        raise ModalFileError(f"{path}: no such file{near_file(path)}") from None
    except OSError as error:
        raise ModalFileError(f"{path}: cannot be read: {reason(error)}") from error
    magic = f"floatframe {format} ".encode("ascii")
    if not head.startswith(magic):
        if head and magic.startswith(head):
            raise truncated(path, format, f"at least {SEAL_SIZE} bytes", n_bytes)
        return False  # of another kind, repacked, or with a damaged seal: the HDF5 part tells
    stated = re.match(rb"(\d{1,9})\nbytes (\d{1,18})\n", head[len(magic) :])
    if stated and int(stated[1]) > version:
        raise newer(path, format, int(stated[1]), version)
    if len(head) < SEAL_SIZE:
        raise truncated(path, format, f"at least {SEAL_SIZE} bytes", n_bytes)
    if stated is None:
        raise altered(path, format, "its seal cannot be read")
    if n_bytes < int(stated[2]):
        raise truncated(path, format, f"{int(stated[2])} bytes", n_bytes)
    if head != seal_text(format, int(stated[1]), n_bytes, sha256):
        raise altered(path, format, "its bytes do not have the sha256 of its seal")
    return True


def truncated(path: Path, format: str, expected: str, n_bytes: int) -> ModalFileError:
    """Return the error of a file that is too short."""
    return ModalFileError(
        f"{path}: this {format} is truncated: expected {expected}, got {n_bytes}; copy it again or write it again"
    )


def altered(path: Path, format: str, detail: str) -> ModalFileError:
    """Return the error of a file that is not as it was written."""
    return ModalFileError(
        f"{path}: this {format} was altered since it was written: {detail}; copy it again or write it again"
    )


def newer(path: Path, format: str, got: int, known: int) -> ModalFileError:
    """Return the error of a file from a later version of this program."""
    return ModalFileError(
        f"{path}: this {format} has format version {got}, this program reads versions up to {known}; "
        "update the program (pip install -U floatframe)"
    )


# The HDF5 part -------------------------------------------------------------------------------------------------------


def hdf5_image(content: Content) -> bytes:
    """Return the HDF5 file as bytes: made in memory, so that a full disk never meets HDF5's caches."""
    import h5py

    attributes = {name: dict(group) for name, group in content.attributes.items()}
    attributes["/"] = {"format": content.format, "version": content.version, **attributes.get("/", {})}
    manifest = []
    # A user block is declared, so that the addresses in the image count from it; the 1.8 layout is read by every tool.
    with h5py.File(
        "modal", "w", driver="core", backing_store=False, userblock_size=SEAL_SIZE, libver=("v108", "v108")
    ) as file:
        for path, dataset in content.datasets.items():
            values, kind, sha256, line = described(path, dataset.values)
            stored = file.create_dataset(path, data=values, dtype=kind, track_times=False)
            for name, value in {"unit": dataset.unit, "description": dataset.description}.items():
                manifest.append(put_attribute(stored, path, name, value))
            put_attribute(stored, path, "sha256", sha256)
            manifest.append(line)
        for path, group in attributes.items():
            target = file.require_group(path)
            manifest += [put_attribute(target, path, name, value) for name, value in group.items()]
        put_attribute(file, "/", DIGEST, manifest_digest(manifest))
        file.flush()
        return bytes(file.id.get_file_image())


def checked_content(path: Path, format: str, version: int, *, has_seal: bool) -> Content:
    """Read every dataset and attribute, comparing each sha256 and the digest."""
    import h5py

    if not h5py.is_hdf5(path):
        raise ModalFileError(
            f"{path}: not a {format}: expected an HDF5 file, got something else; "
            "a file of this kind is written by `cms reduce` or `cms.write`"
        )
    try:
        with h5py.File(path, "r") as file:
            found = as_attribute(file.attrs.get("format"))
            if found != format:
                what = f"a {found!r}" if found else "HDF5 of another program"
                raise ModalFileError(f"{path}: not a {format}: {what}")
            stated = as_attribute(file.attrs.get("version"))
            if isinstance(stated, int) and stated > version:
                raise newer(path, format, stated, version)
            if file.userblock_size and not has_seal:  # only a repacked file may lack one, and then has no block
                raise altered(path, format, "its seal is damaged")
            return Content(format, int(stated or 0), *walk(file, path, format))
    except ModalFileError:
        raise
    except Exception as error:  # HDF5 reports a damaged structure as OSError, KeyError, RuntimeError, ValueError...
        raise altered(path, format, f"HDF5 cannot read it ({reason(error)})") from error


def walk(file: Any, path: Path, format: str) -> tuple[dict[str, Dataset], dict[str, dict[str, Attribute]]]:
    """Return all datasets and all attributes of groups; raise if one of them is not as it was written."""
    import h5py

    objects = {"/": file}
    file.visititems(lambda name, item: objects.update({f"/{name}": item}))
    datasets, groups, manifest = {}, {}, []
    for name, item in objects.items():
        attributes = {key: as_attribute(item.attrs[key]) for key in item.attrs}
        written = {"/": DIGEST}.get(name) if not isinstance(item, h5py.Dataset) else "sha256"
        expected = attributes.pop(written, None) if written else None
        manifest += [described(f"{name}@{key}", value)[3] for key, value in attributes.items()]
        if isinstance(item, h5py.Dataset):
            values = as_values(item[()])
            _, _, sha256, line = described(name, values)
            if sha256 != expected:
                raise altered(path, format, f"dataset {name} does not have its sha256")
            datasets[name] = Dataset(values, str(attributes.get("unit", "1")), str(attributes.get("description", "")))
            manifest.append(line)
        else:
            groups[name] = attributes
            if name == "/":
                digest = expected
    if manifest_digest(manifest) != digest:
        raise altered(
            path, format, "its contents do not have its digest (an attribute or a name was changed, or one is missing)"
        )
    groups["/"][DIGEST] = str(digest)
    return datasets, groups


def described(path: str, values: Any) -> tuple[Any, Any, str, str]:
    """Return the values as stored, their HDF5 type, their sha256, and their line of the manifest.

    The line is path, kind, shape and sha256 with tabs between; the sha256 is that of the little-endian values in C
    order, or of the UTF-8 bytes of each string followed by a zero byte.
    """
    import h5py

    if isinstance(values, str | tuple):
        words = [values] if isinstance(values, str) else list(values)
        try:
            encoded = [word.encode("utf-8") for word in words]
        except UnicodeEncodeError:
            encoded = [b"\0"]
        if any(b"\0" in word for word in encoded):
            raise ModalFileError(f"{path}: expected text that UTF-8 can hold, without zero bytes, got {values!r}")
        kind = h5py.string_dtype("utf-8", max(1, *(len(word) for word in encoded), 1))
        stored = np.array(encoded, dtype=kind) if isinstance(values, tuple) else np.array(encoded[0], dtype=kind)
        name, data = "utf8", b"".join(word + b"\0" for word in encoded)
    else:
        array = np.asarray(values)
        name = "int64" if array.dtype.kind in "iu" else "float64"
        kind = np.dtype("<i8" if name == "int64" else "<f8")
        stored = np.ascontiguousarray(array, dtype=kind).reshape(array.shape)
        data = stored.tobytes()
    sha256 = hashlib.sha256(data).hexdigest()
    return stored, kind, sha256, f"{path}\t{name}\t{','.join(str(n) for n in stored.shape)}\t{sha256}\n"


def put_attribute(item: Any, path: str, name: str, value: Attribute) -> str:
    """Write one attribute and return its line of the manifest."""
    stored, kind, _, line = described(f"{path}@{name}", value)
    item.attrs.create(name, stored, dtype=kind)
    return line


def manifest_digest(lines: list[str]) -> str:
    """Return the sha256 of the lines in ascending order of their bytes."""
    return hashlib.sha256(b"".join(sorted(line.encode("utf-8") for line in lines))).hexdigest()


def as_attribute(value: Any) -> Any:
    """Return an attribute as str, int or float; None stays None, anything else is left as it is."""
    if isinstance(value, bytes):
        return value.decode("utf-8")
    return value.item() if isinstance(value, np.generic) else value


def as_values(value: Any) -> Any:
    """Return a dataset as float64 or int64 array or as a tuple of strings."""
    array = np.asarray(value)
    if array.dtype.kind in "SO":
        return tuple(word.decode("utf-8") if isinstance(word, bytes) else str(word) for word in array.ravel())
    return array


def reason(error: BaseException) -> str:
    """Return the first line of an error's own words."""
    text = str(getattr(error, "strerror", None) or error or type(error).__name__)
    return text.splitlines()[0]
