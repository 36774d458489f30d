"""HDF5 files that are written completely or not at all, with a seal, and read without trust in their content.

Writing: HDF5 writes through `Storage`, which records the first disk error and hides it from the library, because HDF5
can crash if the disk is full. The caller gets the OSError. Reading: only items that are stored in the file itself and
have the declared size are read (`own_items`). Links to other files, virtual or external datasets, and shapes with more
values than the file has bytes for are rejected.
"""

import hashlib
import os
import zlib
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np

from fe_models.foundation.paths import sync_folder
from fe_models.foundation.seal import SEAL_SIZE, Kind, altered, newer, reason, seal_of
from fe_models.foundation.words import quoted

__all__ = [
    "DIGEST",
    "SHA256",
    "Attribute",
    "Manifest",
    "as_attribute",
    "described",
    "digest_of",
    "opened",
    "own_items",
    "require_digest",
    "stated_version",
    "write_sealed_file",
]

DIGEST = "digest"  #: name of the root attribute
SHA256 = "sha256"  #: name of the attribute of a dataset
MOST_COMPRESSED = 1032  #: largest compression ratio of deflate, for files that another tool has repacked
BLOCK_VALUES = 1 << 20  #: number of values that are hashed at a time
LARGE = 1 << 20  #: size of an array above which compression is tried [bytes]
PAYS = 0.75  #: largest ratio of compressed to original size for which compression is used; dense numbers exceed it
SAMPLES, SAMPLE = 16, 4096  #: number of samples of an array for a trial compression, and number of values in each
Attribute = str | int | float


# Writing -------------------------------------------------------------------------------------------------------------


class Storage:
    """The open file that HDF5 writes to; after a failed write it discards all further data."""

    def __init__(self, file: BinaryIO) -> None:
        self.file = file
        self.position = 0
        self.failure: OSError | None = None

    def guarded(self, action: Callable[[], Any]) -> None:
        """Run a disk operation, unless an earlier one has failed."""
        if self.failure is None:
            try:
                action()
            except OSError as error:
                self.failure = error

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        """Move to a position."""
        origin = {os.SEEK_SET: 0, os.SEEK_CUR: self.position}.get(whence)
        self.position = offset + (self.file.seek(0, os.SEEK_END) if origin is None else origin)
        return self.position

    def tell(self) -> int:
        """Return the position."""
        return self.position

    def write(self, data: Any) -> int:
        """Write bytes at the position."""

        def put() -> None:
            self.file.seek(self.position)
            self.file.write(data)

        self.guarded(put)
        self.position += len(data)
        return len(data)

    def readinto(self, buffer: Any) -> int:
        """Read bytes from the position."""
        self.file.seek(self.position)
        n = self.file.readinto(buffer)  # type: ignore[attr-defined]
        self.position += n
        return int(n)

    def read(self, n: int = -1) -> bytes:
        """Return bytes from the position."""
        self.file.seek(self.position)
        data = self.file.read(n)
        self.position += len(data)
        return data

    def truncate(self, size: int) -> int:
        """Give the file a size."""
        self.guarded(lambda: self.file.truncate(size))
        return size

    def flush(self) -> None:
        """Write buffered data."""
        self.guarded(self.file.flush)


def write_sealed_file(path: Path, kind: Kind, fill: Callable[[Any], None], *, part: Path) -> None:
    """Write an HDF5 file under the temporary name `part`, seal it, flush it to disk, and rename it in one step.

    Parameters
    ----------
    path, part
        Final name, and temporary name during writing. An existing file with the temporary name is overwritten.
    kind
        Kind of file, for the seal.
    fill
        Function that writes the content into the open `h5py.File`.

    Raises
    ------
    OSError
        If the file cannot be written to disk. An existing file at `path` is then unchanged.
    """
    import h5py

    try:
        with open(part, "w+b", buffering=0) as raw:
            storage = Storage(raw)
            try:
                with h5py.File(storage, "w", userblock_size=SEAL_SIZE, libver=("v108", "v108")) as file:
                    fill(file)
            finally:
                if storage.failure is not None:
                    raise storage.failure
            seal = seal_of(raw, kind)
            raw.seek(0)
            raw.write(seal)
            os.fsync(raw.fileno())
        os.replace(part, path)
    except BaseException:
        part.unlink(missing_ok=True)
        raise
    sync_folder(path.parent)


class Entry(NamedTuple):
    """Manifest entry of an attribute or dataset."""

    path: str  #: path of a dataset, or "<path>@<name>" of an attribute
    kind: str  #: type of the values: "utf8", "int64" or "float64"
    shape: tuple[int, ...]
    sha256: str  #: sha256 of the values


@dataclass(eq=False)
class Manifest:
    """Writer of attributes and datasets to a file, and of a digest over all of them at the end.

    The digest, a root attribute, is the sha256 over the paths, types, shapes and sha256 of all contents. It does not
    depend on the layout of HDF5. Therefore it does not change if the file is repacked, and equal digests mean equal
    contents.
    """

    file: Any  #: open `h5py.File`
    entries: list[Entry] = field(default_factory=list)  #: entries of all attributes and datasets

    def attributes(self, path: str, values: Mapping[str, Attribute]) -> None:
        """Write the attributes of a group, which is created if it does not exist."""
        item = self.file.require_group(path)
        self.entries += [put_attribute(item, path, name, value) for name, value in values.items()]

    def dataset(self, path: str, values: Any, attributes: Mapping[str, Attribute]) -> None:
        """Write a dataset with its attributes and its sha256."""
        stored, kind, entry = described(path, values)
        item = self.file.create_dataset(path, data=stored, dtype=kind, track_times=False, **filters_for(stored))
        self.entries += [put_attribute(item, path, name, value) for name, value in attributes.items()]
        put_attribute(item, path, SHA256, entry.sha256)
        self.entries.append(entry)

    def rows(
        self, path: str, shape: tuple[int, ...], parts: Iterable[Any], attributes: Mapping[str, Attribute]
    ) -> None:
        """Write a float64 dataset of this shape from successive blocks of its rows, without keeping them all in memory.

        Raises
        ------
        ValueError
            If the blocks do not fill the dataset.
        """
        item = self.file.create_dataset(path, shape=shape, dtype="<f8", track_times=False)
        digest, first = hashlib.sha256(), 0
        for part in parts:
            block = np.ascontiguousarray(part, dtype="<f8")
            digest.update(block.tobytes())
            if block.size:
                item[first : first + len(block)] = block
            first += len(block)
        if first != shape[0]:
            raise ValueError(f"{path}: expected {shape[0]} rows, got {first}")
        self.entries += [put_attribute(item, path, name, value) for name, value in attributes.items()]
        put_attribute(item, path, SHA256, digest.hexdigest())
        self.entries.append(Entry(path, "float64", shape, digest.hexdigest()))

    def close(self) -> None:
        """Write the digest."""
        put_attribute(self.file, "/", DIGEST, digest_of(self.entries))


def filters_for(stored: Any) -> dict[str, Any]:
    """Return the HDF5 filters of a dataset: none, or chunks with shuffle and deflate if these save much space.

    Both filters belong to every HDF5 installation. Samples of large arrays are compressed to estimate the ratio.
    Diagonal matrices and blocks of zeros shrink to a hundredth of their size.
    """
    if stored.dtype.kind not in "fi" or stored.nbytes < LARGE:
        return {}
    values = stored.reshape(-1)
    starts = np.linspace(0, max(0, len(values) - SAMPLE), SAMPLES).astype(np.int64)
    sample = np.concatenate([values[first : first + SAMPLE] for first in starts])
    shuffled = sample.view(np.uint8).reshape(len(sample), -1).T.tobytes()
    if len(zlib.compress(shuffled, 1)) > PAYS * len(shuffled):
        return {}
    return {"chunks": chunk_of(stored.shape, stored.itemsize), "shuffle": True, "compression": "gzip",
            "compression_opts": 1}  # fmt: skip


def chunk_of(shape: tuple[int, ...], itemsize: int) -> tuple[int, ...]:
    """Return the largest chunk of about `LARGE` bytes of an array in C order: 1, ..., 1, a few rows, then full axes."""
    chunk, room = list(shape), max(1, LARGE // itemsize)
    for axis in range(len(shape)):
        inner = int(np.prod(shape[axis + 1 :]))
        chunk[axis] = min(shape[axis], max(1, room // max(1, inner)))
    return tuple(chunk)


def described(path: str, values: Any) -> tuple[Any, Any, Entry]:
    """Return the values as stored, their HDF5 type, and their entry of the manifest.

    The sha256 covers the little-endian values in C order, or the UTF-8 bytes of each string followed by a zero byte.

    Raises
    ------
    ValueError
        If a text contains a zero byte, or characters that UTF-8 cannot encode.
    """
    import h5py

    if isinstance(values, str | tuple):
        words = [values] if isinstance(values, str) else list(values)
        try:
            encoded = [word.encode("utf-8") for word in words]
        except UnicodeEncodeError:
            encoded = [b"\0"]
        if any(b"\0" in word for word in encoded):
            raise ValueError(f"{path}: expected text that UTF-8 can hold, without zero bytes, got {values!r}")
        kind = h5py.string_dtype("utf-8", max(1, *(len(word) for word in encoded), 1))
        stored = np.array(encoded, dtype=kind) if isinstance(values, tuple) else np.array(encoded[0], dtype=kind)
        name, sha256 = "utf8", hashlib.sha256(b"".join(word + b"\0" for word in encoded)).hexdigest()
    else:
        array = np.asarray(values)
        name = "int64" if array.dtype.kind in "iu" else "float64"
        kind = np.dtype("<i8" if name == "int64" else "<f8")
        stored = np.ascontiguousarray(array, dtype=kind).reshape(array.shape)
        sha256 = hashlib.sha256(stored.reshape(-1).view(np.uint8).data).hexdigest()
    return stored, kind, Entry(path, name, stored.shape, sha256)


def put_attribute(item: Any, path: str, name: str, value: Attribute) -> Entry:
    """Write one attribute and return its entry of the manifest."""
    stored, kind, entry = described(f"{path}@{name}", value)
    item.attrs.create(name, stored, dtype=kind)
    return entry


def digest_of(entries: Iterable[Entry]) -> str:
    """Return the sha256 of the manifest: a line for each entry, in ascending order of their bytes.

    A line holds path, type, shape and sha256, separated by tabs.
    """
    lines = [f"{path}\t{kind}\t{','.join(map(str, shape))}\t{sha256}\n" for path, kind, shape, sha256 in entries]
    return hashlib.sha256(b"".join(sorted(line.encode("utf-8") for line in lines))).hexdigest()


# Reading -------------------------------------------------------------------------------------------------------------


@contextmanager
def opened(path: Path, kind: Kind, *, has_seal: bool) -> Iterator[Any]:
    """Open the HDF5 part of a file whose seal was checked, and raise the error of the kind for every fault in it.

    Raises
    ------
    Exception
        The error of the kind, if the file is not HDF5, has lost its seal, or cannot be read.
    """
    import h5py

    if not h5py.is_hdf5(path):
        raise kind.error(
            f"{path}: not a {kind.format}: expected an HDF5 file, got something else; a file of this kind is written "
            f"by {kind.writer}"
        )
    try:
        with h5py.File(path, "r") as file:
            # only a repacked file may lack a seal, and then it has no user block
            if file.userblock_size and not has_seal:
                raise altered(path, kind, "its seal is damaged")
            yield file
    except kind.error:
        raise
    except Exception as error:  # HDF5 reports a damaged structure as OSError, KeyError, RuntimeError, ValueError...
        raise altered(path, kind, f"HDF5 cannot read it ({reason(error)})") from error


def stated_version(file: Any, path: Path, kind: Kind) -> int:
    """Return the version of a file; raise the error of the kind if the file is of another kind or a later version."""
    found, stated = (as_attribute(file.attrs.get(name)) for name in ("format", "version"))
    if found != (kind.stored or kind.format):
        what = f"format {quoted(found)}" if found else "HDF5 of another program"
        raise kind.error(f"{path}: expected a {kind.format}, got {what}")
    if not isinstance(stated, int) or stated < 1:
        raise altered(path, kind, f"attribute 'version': expected a whole number, got {quoted(stated)}")
    if stated > kind.version:
        raise newer(path, kind, stated)
    return stated


def own_items(file: Any, path: Path, kind: Kind) -> dict[str, Any]:
    """Return the groups and datasets of a file by path, after a check that all of them lie in the file itself.

    Raises
    ------
    Exception
        The error of the kind, if there is a link to another file, an object of another type, a virtual or external
        dataset, or a shape that the bytes of the file cannot fill.
    """
    import h5py

    items: dict[str, Any] = {"/": file["/"]}
    waiting, known = ["/"], {h5py.h5o.get_info(file.id).addr}
    while waiting:
        group = waiting.pop()
        for name in items[group]:
            where = f"{group.rstrip('/')}/{name}"
            if not isinstance(items[group].get(name, getlink=True), h5py.HardLink):
                raise altered(path, kind, f"{where[:80]!r} is a link to elsewhere")
            item = items[where] = items[group][name]
            address = h5py.h5o.get_info(item.id).addr
            if address in known:
                raise altered(path, kind, f"{where[:80]!r} has two names")
            known.add(address)
            if isinstance(item, h5py.Dataset):
                require_stored(item, where, path, kind)
            elif isinstance(item, h5py.Group):
                waiting.append(where)
            else:
                raise altered(path, kind, f"{where[:80]!r} is neither a group nor a dataset")
    return items


def require_stored(item: Any, where: str, path: Path, kind: Kind) -> None:
    """Raise the error of the kind unless the file holds the values of a dataset; no memory is allocated before."""
    import h5py

    plan = item.id.get_create_plist()
    if plan.get_layout() == h5py.h5d.VIRTUAL or plan.get_external_count():
        raise altered(path, kind, f"the values of {where[:80]!r} lie in another file")
    if item.shape is None:
        raise altered(path, kind, f"{where[:80]!r} holds no values")
    size = float(np.prod([float(n) for n in item.shape])) * item.dtype.itemsize
    stored = item.id.get_storage_size() * (MOST_COMPRESSED if plan.get_nfilters() else 1)
    if size > stored:
        shape = " x ".join(str(n) for n in item.shape)
        raise altered(path, kind, f"{where[:80]!r} says {shape} values, of which the file holds {stored} bytes")


def require_digest(
    items: Mapping[str, Any], path: Path, kind: Kind, entry_of: Callable[[str, Any], Entry] | None = None
) -> dict[str, dict[str, Any]]:
    """Return the attributes by path; raise the error of the kind unless they and the datasets match the digest.

    Parameters
    ----------
    items
        Groups and datasets of the file by path.
    path, kind
        File and its kind, for messages.
    entry_of
        Function that reads a dataset and returns its entry of the manifest; default: numbers are read in blocks.
    """
    import h5py

    entries, stated = [], None
    found = {where: {name: as_attribute(item.attrs[name]) for name in item.attrs} for where, item in items.items()}
    for where, item in items.items():
        attributes = dict(found[where])
        if isinstance(item, h5py.Dataset):
            expected = attributes.pop(SHA256, None)
            entry = (entry_of or entry_in_blocks)(where, item)
            if entry.sha256 != expected:
                raise altered(path, kind, f"dataset {where} does not have its sha256")
            entries.append(entry)
        elif where == "/":
            stated = attributes.pop(DIGEST, None)
        entries += [described(f"{where}@{name}", value)[2] for name, value in attributes.items()]
    if digest_of(entries) != stated:
        raise altered(
            path, kind, "its contents do not have its digest (an attribute or a name was changed, or one is missing)"
        )
    return found


def entry_in_blocks(where: str, item: Any) -> Entry:
    """Return the manifest entry of a dataset of numbers, which is read in blocks."""
    digest = hashlib.sha256()
    name, kind = ("int64", "<i8") if item.dtype.kind in "iu" else ("float64", "<f8")
    each = max(1, int(np.prod(item.shape[1:])))
    step = max(1, BLOCK_VALUES // each)
    blocks = [slice(k, k + step) for k in range(0, item.shape[0] if item.size else 0, step)] if item.shape else [()]
    for block in blocks:
        digest.update(np.ascontiguousarray(item[block], dtype=kind).tobytes())
    return Entry(where, name, item.shape, digest.hexdigest())


def as_attribute(value: Any) -> Any:
    """Return an attribute as str, int or float; None and values of other types are returned unchanged."""
    if isinstance(value, bytes):
        return value.decode("utf-8")
    return value.item() if isinstance(value, np.generic) else value
