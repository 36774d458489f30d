"""Reading of results from disk: one file, or the segments of an unfinished run (docs/results_file.md)."""

import logging
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import h5py
import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.hdf5_file import as_attribute, opened, own_items, require_digest, stated_version
from fe_models.foundation.paths import near_file
from fe_models.foundation.records import frozen_copies
from fe_models.foundation.seal import Kind, altered, check_seal
from fe_models.foundation.words import quoted
from floatframe.engine.kernels.memory import Rows
from floatframe.engine.kernels.records import Size
from floatframe.errors import ResultsError
from floatframe.results.head import Head, head_of_text

__all__ = [
    "DATASETS",
    "ArraySource",
    "FileSource",
    "MemorySource",
    "open_results",
    "row_shapes",
    "segment_paths",
    "segments_folder",
    "segments_words",
    "validity_text",
]

log = logging.getLogger(__name__)

FORMAT = "floatframe-results"
VERSION = 2  #: version of the format; version 1 had no seal and no checksums
KIND = Kind("results-file", VERSION, ResultsError, "`floatframe run` or `integrate`", stored=FORMAT)
SEGMENTS = ".segments"  #: suffix after the name of the results file for the folder of segments
VALIDITY = "validity"  #: attribute with the validity notes of a run
ROWS_CHECKED = 1000  #: number of rows checked at a time
RESTART = "restart"  #: group in a segment with the state of the integrator at its end

#: field of `Rows`, which declares shape and unit, and description, by the name of the dataset in the file
DATASETS = {
    "t": ("t", "time"),
    "position": ("r", "positions of the body frame origins, ground axes"),
    "euler_parameters": ("p", "Euler parameters (w, x, y, z) of R_GB, of length one"),
    "q": ("q", "modal coordinates of all bodies, mass^(1/2) length"),
    "u": (
        "u",
        "per body from column u0: velocity of the frame origin (3, ground axes), angular velocity (3, body axes), "
        "rates of q",
    ),
    "u_dot": ("u_dot", "rates of u"),
    "w": (
        "w",
        "per connection from column w0: force (3) on its marker A and, for joints that constrain angles, moment (3), "
        "ground axes",
    ),
    "diagnostics": (
        "diagnostics",
        "kinetic, strain, gravity and spring energy; linear momentum (3); angular momentum about the ground origin "
        "(3); work of point forces; energy dissipated by dampers and modal damping",
    ),
    "drift": ("drift", "how far each joint is open: distance, angle, and their rates"),
    "angle": (
        "angle",
        "angles of joints and of sensors between the frames of bodies, without elastic rotation, with all full turns "
        "that the run has counted; absent without angles",
    ),
    "load": (
        "load",
        "force (3) and moment (3) of each point force on its marker as they acted, with switches by events and values "
        "from another program; ground axes; absent without loads",
    ),
    "load_case": ("load_case", "factor of each load case as it acted; absent without load cases"),
}


class ArraySource(Protocol):
    """The arrays of a trajectory, in memory or in files."""

    def read(self, name: str) -> Array:
        """Return a whole dataset by its name in `DATASETS`."""


@frozen_copies
@dataclass(frozen=True, eq=False)
class MemorySource:
    """Arrays in memory."""

    arrays: Mapping[str, Array]

    def read(self, name: str) -> Array:
        """Return a whole dataset by name."""
        return self.arrays[name]


@frozen_copies
@dataclass(frozen=True, eq=False)
class FileSource:
    """Arrays in one file, or in consecutive segments, which have been checked."""

    paths: tuple[Path, ...]
    shapes: Mapping[str, tuple[int, ...]]  #: shapes of one row, needed if there is no segment

    def read(self, name: str) -> Array:
        """Return a whole dataset by name; `ResultsError` if a file is missing or has changed since it was checked."""
        parts = [np.zeros((0, *self.shapes[name]))]
        for path in self.paths:
            try:
                with h5py.File(path, "r") as file:
                    parts.append(np.asarray(file[name][...], dtype=float))
            except (OSError, KeyError, ValueError, TypeError, RuntimeError) as error:
                raise altered(path, KIND, f"dataset {name} cannot be read any more") from error
        return np.concatenate(parts)


def row_shapes(head: Head) -> dict[str, tuple[int, ...]]:
    """Return the shape of one row of each dataset, as `Rows` declares it; a head of an older file lacks some."""
    n_b, n_q = len(head.bodies), sum(body.n_q for body in head.bodies)
    sizes = {"n_b": n_b, "n_q": n_q, "n_u": 6 * n_b + n_q, "n_w": head.w0[-1], "n_c": len(head.joints)}
    optional = {"angles": head.angles, "loads": head.loads, "body loads": head.load_cases}
    sizes |= {name: len(items) for name, items in optional.items() if items is not None}
    declared = Rows()._asdict()
    shapes = {name: declared[field].shape[1:] for name, (field, _) in DATASETS.items()}
    return {
        name: tuple(size.of(sizes) if isinstance(size, Size) else size for size in shape)
        for name, shape in shapes.items()
        if all(size.name in sizes for size in shape if isinstance(size, Size))
    }


def segments_folder(path: str | os.PathLike[str]) -> Path:
    """Return the folder of the segments of a results file; the folder itself is also accepted."""
    path = Path(path)
    return path if path.name.endswith(SEGMENTS) else path.with_name(path.name + SEGMENTS)


def segments_words(folder: Path) -> str:
    """Return where the motion of a run that ended early is, and what can read it, for messages."""
    return f"the motion so far is in {str(folder)!r}, which floatframe plot, animate and info can read"


def segment_paths(folder: Path) -> list[Path]:
    """Return the closed segments in order; `ResultsError` if one of them is missing."""
    paths = sorted(folder.glob("[0-9]*.h5"))
    for k, path in enumerate(paths):
        if path.name != f"{k:06d}.h5":
            raise ResultsError(f"{folder}: {k:06d}.h5 is missing among the segments of the run; repeat the run")
    return paths


@contextmanager
def checked(path: Path, *, tell_age: bool = True) -> Iterator[tuple[Any, dict[str, Any]]]:
    """Open a results file or segment with a valid seal or digest; return it with its groups and datasets.

    A file of version 1 has neither; it is read with a warning.
    """
    has_seal = check_seal(path, KIND)
    with opened(path, KIND, has_seal=has_seal) as file:
        stated = stated_version(file, path, KIND)
        items = own_items(file, path, KIND)
        if not has_seal and stated >= 2:
            require_digest(items, path, KIND)
        if not has_seal and stated < 2 and tell_age:
            log.warning("%s: this results file is of version 1, which has no checksum, so that damage to its numbers "
            "cannot be detected; a new run writes a file with checksums", path)  # fmt: skip
        yield file, items


def read_head(path: Path, file: Any) -> tuple[Head, bool]:
    """Return the head of an open results file, and whether the run was complete."""
    try:
        head = head_of_text(as_attribute(file.attrs.get("head")))
    except ValueError as error:
        raise ResultsError(f"{path}: {error}; the file is damaged, or was written by a faulty program") from error
    return head, bool(file.attrs.get("is_complete", False))


def require_datasets(path: Path, items: Mapping[str, Any], shapes: Mapping[str, tuple[int, ...]]) -> int:
    """Return the number of rows; `ResultsError` unless all datasets are numeric with the shapes in the head."""
    t = items.get("/t")
    n_t = t.shape[0] if isinstance(t, h5py.Dataset) and len(t.shape) == 1 else -1
    for name, shape in shapes.items():
        item = items.get(f"/{name}")
        if not isinstance(item, h5py.Dataset) or item.shape != (n_t, *shape) or item.dtype.kind != "f":
            raise ResultsError(f"{path}: dataset {name!r} is missing or misshapen; the file is damaged")
        for first in range(0, n_t, ROWS_CHECKED):
            if not np.isfinite(item[first : first + ROWS_CHECKED]).all():
                raise ResultsError(
                    f"{path}: dataset {name!r}: expected finite numbers; the file was written by a faulty program"
                )
    assert isinstance(t, h5py.Dataset)
    if (np.diff(t[...]) <= 0).any():
        raise ResultsError(f"{path}: dataset 't': expected increasing times; the file is damaged")
    return n_t


def open_segments(folder: Path) -> tuple[Head, FileSource]:
    """Return the head and the closed segments of an unfinished run after a check of all segments."""
    try:
        with checked(folder / "head.h5") as (file, _):
            head, _ = read_head(folder, file)
    except ResultsError as error:
        raise ResultsError(f"{folder}: not the segments of a run: {error}") from error
    paths, shapes, last = segment_paths(folder), row_shapes(head), -np.inf
    for path in paths:
        with checked(path, tell_age=False) as (file, items):
            if require_datasets(path, items, shapes):
                if file["t"][0] <= last:
                    raise ResultsError(
                        f"{path}: its times do not continue those of the previous segment; repeat the run"
                    )
                last = file["t"][-1]
    return head, FileSource(tuple(paths), shapes)


def open_results(path: str | os.PathLike[str]) -> tuple[Head, FileSource, bool]:
    """Return head, arrays and completeness of a results file, or of the segments of an interrupted run.

    Raises
    ------
    ResultsError
        If there is neither, or the file is of another kind, of a newer version, or damaged.
    """
    path = Path(path)
    folder = segments_folder(path)
    if path.is_dir() or (not path.exists() and folder.is_dir()):
        head, source = open_segments(path if path.is_dir() else folder)
        return head, source, False
    if not path.exists():
        raise ResultsError(f"results file {quoted(str(path))}: no such file{near_file(path)}")
    with checked(path) as (file, items):
        head, is_complete = read_head(path, file)
        shapes = row_shapes(head)
        require_datasets(path, items, shapes)
    return head, FileSource((path,), shapes), is_complete


def validity_text(path: Path) -> str:
    """Return the validity notes of a run from a results file, or from its last segment, as text."""
    paths = [path] if path.is_file() else segment_paths(path if path.is_dir() else segments_folder(path))
    if not paths:
        return "[]"
    with h5py.File(paths[-1], "r") as file:
        return str(as_attribute(file.attrs.get(VALIDITY, "[]")))
