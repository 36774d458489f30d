"""Results on disk: closed segments while a motion is computed, one file when it is done (docs/results_file.md).

A run that writes to swing.h5 first fills the folder swing.h5.segments with head.h5 and 000000.h5, 000001.h5, ...:
each is written under a temporary name and moved into place, so that a killed run leaves every closed segment readable.
At the end the segments are copied into one file, which is moved to swing.h5, and the folder is removed.
"""

import json
import os
import shutil
from collections.abc import Callable, Mapping
from dataclasses import asdict, dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import h5py
import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.errors import ResultsError
from floatframe.kernels.model import N_DRIFTS, Rows

__all__ = [
    "ArraySource",
    "BodyEntry",
    "FileSource",
    "Head",
    "MemorySource",
    "ResultsWriter",
    "last_restart",
    "open_results",
    "validity_text",
]

FORMAT = "floatframe-results"
VERSION = 1  #: of the format; a reader refuses greater ones
SEGMENTS = ".segments"  #: added to the name of the results file
UNFINISHED = ".unfinished"  #: added to the name of a file being written
VALIDITY = "validity"  #: attribute with the notes on the range of the linear frames
RESTART = "restart"  #: group in a segment with the memory of the integrator at its end

DATASETS = {  # name in the file -> field of Rows, what it is
    "t": ("t", "time"),
    "position": ("r", "of the frame origins, ground axes, (n_t, n_bodies, 3)"),
    "euler_parameters": ("p", "w, x, y, z of R_GB, (n_t, n_bodies, 4)"),
    "q": ("q", "modal coordinates of all bodies, (n_t, n_q)"),
    "u": ("u", "per body: velocity of the origin in ground axes, angular velocity in body axes, q_dot, (n_t, n_u)"),
    "u_dot": ("u_dot", "rates of u, (n_t, n_u)"),
    "w": ("w", "force (and moment) of each connection on its marker A, ground axes, (n_t, n_w)"),
    "diagnostics": (
        "diagnostics",
        "kinetic, strain, gravity and spring energy, linear momentum (3), angular momentum "
        "about the ground origin (3), work of point forces, energy taken by damping",
    ),
    "drift": ("drift", "of each joint: distance, angle, their rates, (n_t, n_joints, 4)"),
}


@dataclass(frozen=True)
class BodyEntry:
    """Where the columns of a body are."""

    name: str
    n_q: int
    q0: int  #: first column in q
    u0: int  #: first column in u
    source: str = ""  #: path of the modal file; "" for rigid bodies and bodies made in memory
    digest: str = ""  #: of that file
    is_stiffened: bool = False  #: whether its geometric stiffness counts


@dataclass(frozen=True)
class Head:
    """What a results file says besides numbers."""

    system: str
    units: str  #: name of the unit system
    bodies: tuple[BodyEntry, ...]
    joints: tuple[str, ...]
    springs: tuple[str, ...]
    w0: tuple[int, ...]  #: first column in w of each connection (joints, then springs), and the end
    run: Mapping[str, Any]  #: integrator and its parameters, h, t_end, version
    #: of a run that has ended: n_steps, n_rejected, n_iterations (of Newton's method), wall_time [s]
    summary: Mapping[str, Any] = field(default_factory=dict)


class ArraySource(Protocol):
    """Where the arrays of a trajectory are: in memory or in files."""

    def read(self, name: str) -> Array:
        """Return a whole dataset by its name in `DATASETS`."""


@dataclass(frozen=True, eq=False)
class MemorySource:
    """Arrays in memory."""

    arrays: Mapping[str, Array]

    def read(self, name: str) -> Array:
        """Return a whole dataset."""
        return self.arrays[name]


@dataclass(frozen=True, eq=False)
class FileSource:
    """Arrays in one file, or in consecutive segments."""

    paths: tuple[Path, ...]
    shapes: Mapping[str, tuple[int, ...]]  #: of one row, for the case that there is no segment

    def read(self, name: str) -> Array:
        """Return a whole dataset."""
        parts = [np.zeros((0, *self.shapes[name]))]
        for path in self.paths:
            with h5py.File(path, "r") as file:
                parts.append(file[name][...])
        return np.concatenate(parts)


class ResultsWriter:
    """Writes the rows of a run in closed segments, and joins them at the end.

    Raises
    ------
    ResultsError
        If the folder or a file cannot be written.
    """

    def __init__(self, path: str | os.PathLike[str], head: Head, *, goes_on: bool = False) -> None:
        """Begin with an empty folder of segments, or go on after the last restart record of the one that is there."""
        self.path = Path(path)
        self.head = head
        self.folder = self.path.with_name(self.path.name + SEGMENTS)
        self.n_segments = 0
        self.open_rows: list[Rows] = []
        self.validity = "[]"  #: notes on the range of the linear frames, see floatframe/results/validity.py
        if self.path.is_dir():
            raise ResultsError(f"results file {str(self.path)!r}: expected a file name, got a folder")
        if not self.path.parent.is_dir():
            raise ResultsError(f"results file {str(self.path)!r}: no such folder {str(self.path.parent)!r}; make it")
        self.guarded(self.go_on if goes_on else self.begin)

    def begin(self) -> None:
        """Make an empty folder of segments with the head."""
        if self.folder.exists():
            shutil.rmtree(self.folder)
        self.folder.mkdir()
        self.write_file(self.folder / "head.h5", lambda file: write_head(file, self.head, is_complete=False))

    def go_on(self) -> None:
        """Take away what comes after the last restart record: it will be computed again."""
        for path in self.folder.glob(f"*{UNFINISHED}"):
            path.unlink()
        paths = segment_paths(self.folder)
        while paths and not has_restart(paths[-1]):
            paths.pop().unlink()
        self.n_segments = len(paths)

    def guarded(self, action: Callable[[], None]) -> None:
        """Run an action; say in words why it cannot write."""
        try:
            action()
        except OSError as error:
            raise ResultsError(
                f"results file {str(self.path)!r}: cannot be written: {error}; closed segments stay in "
                f"{str(self.folder)!r}"
            ) from error

    @staticmethod
    def write_file(path: Path, fill: Callable[[h5py.File], None]) -> None:
        """Write a file under a temporary name and move it into place."""
        unfinished = path.with_name(path.name + UNFINISHED)
        try:
            with h5py.File(unfinished, "w") as file:
                fill(file)
            os.replace(unfinished, path)
        finally:
            unfinished.unlink(missing_ok=True)

    def append(self, rows: Rows) -> None:
        """Take rows into the open segment."""
        if len(rows.t):
            self.open_rows.append(rows)

    def close_segment(self, restart: Mapping[str, Array] | None = None) -> None:
        """Write the open segment, if it holds anything, with a record from which the run can go on."""
        if not self.open_rows:
            return
        arrays = arrays_of(self.open_rows)
        arrays["drift"] = arrays["drift"][:, : len(self.head.joints)]

        def fill(file: h5py.File) -> None:
            file.attrs["format"], file.attrs["version"] = FORMAT, VERSION
            file.attrs[VALIDITY] = self.validity
            for name, array in arrays.items():
                file.create_dataset(name, data=array)
            for name, array in (restart or {}).items():
                file.create_dataset(f"{RESTART}/{name}", data=array)

        self.guarded(lambda: self.write_file(self.folder / f"{self.n_segments:06d}.h5", fill))
        self.n_segments += 1
        self.open_rows = []

    def finish(self, summary: Mapping[str, Any] | None = None) -> None:
        """Join the segments into the results file, with the summary of the run, and remove them."""
        self.close_segment()
        _, source = open_segments(self.folder)
        self.head = replace(self.head, summary=summary or {})

        def fill(file: h5py.File) -> None:
            write_head(file, self.head, is_complete=True)
            file.attrs[VALIDITY] = self.validity
            copy_segments(file, source)

        self.guarded(lambda: self.write_file(self.path, fill))
        shutil.rmtree(self.folder, ignore_errors=True)


def arrays_of(parts: list[Rows]) -> dict[str, Array]:
    """Return the datasets of consecutive rows."""
    return {name: np.concatenate([getattr(rows, field) for rows in parts]) for name, (field, _) in DATASETS.items()}


def copy_segments(file: h5py.File, source: FileSource) -> None:
    """Copy all segments into one file, a segment at a time."""
    counts = []
    for path in source.paths:
        with h5py.File(path, "r") as segment:
            counts.append(len(segment["t"]))
    n_t = sum(counts)
    for name, (_, words) in DATASETS.items():
        dataset = file.create_dataset(name, shape=(n_t, *source.shapes[name]), dtype=np.float64)
        dataset.attrs["is"] = words
    first = 0
    for path, count in zip(source.paths, counts, strict=True):
        with h5py.File(path, "r") as segment:
            for name in DATASETS:
                if count and file[name].size:
                    file[name][first : first + count] = segment[name][...]
        first += count


def write_head(file: h5py.File, head: Head, *, is_complete: bool) -> None:
    """Write the attributes and tables of a results file."""
    file.attrs["format"], file.attrs["version"] = FORMAT, VERSION
    file.attrs["is_complete"] = is_complete
    file.attrs["head"] = json.dumps(asdict(head))


def read_head(path: Path, file: h5py.File) -> tuple[Head, bool]:
    """Return the head of a results file and whether the run was complete."""
    if file.attrs.get("format") != FORMAT or "head" not in file.attrs:
        raise ResultsError(f"{path}: expected a results file of floatframe, got format {file.attrs.get('format')!r}")
    version = int(file.attrs["version"])
    if version > VERSION:
        raise ResultsError(f"{path}: results format {version}, but this program reads up to {VERSION}; update it")
    data = json.loads(file.attrs["head"])
    data["bodies"] = tuple(BodyEntry(**body) for body in data["bodies"])
    for name in ("joints", "springs", "w0"):
        data[name] = tuple(data[name])
    return Head(**data), bool(file.attrs["is_complete"])


def row_shapes(head: Head) -> dict[str, tuple[int, ...]]:
    """Return the shape of one row of each dataset."""
    n_b = len(head.bodies)
    n_q = sum(body.n_q for body in head.bodies)
    return {
        "t": (),
        "position": (n_b, 3),
        "euler_parameters": (n_b, 4),
        "q": (n_q,),
        "u": (6 * n_b + n_q,),
        "u_dot": (6 * n_b + n_q,),
        "w": (head.w0[-1],),
        "diagnostics": (12,),
        "drift": (len(head.joints), N_DRIFTS),
    }


def open_segments(folder: Path) -> tuple[Head, FileSource]:
    """Return the head and the closed segments of an unfinished run."""
    try:
        with h5py.File(folder / "head.h5", "r") as file:
            head, _ = read_head(folder, file)
    except (OSError, KeyError, ValueError, TypeError) as error:
        raise ResultsError(f"{folder}: not the segments of a run: {error}") from error
    return head, FileSource(tuple(segment_paths(folder)), row_shapes(head))


def segment_paths(folder: Path) -> list[Path]:
    """Return the closed segments in their order."""
    return sorted(folder.glob("[0-9]*.h5"))


def has_restart(path: Path) -> bool:
    """Whether a run can go on after this segment."""
    with h5py.File(path, "r") as file:
        return RESTART in file


def last_restart(path: str | os.PathLike[str]) -> tuple[Head, dict[str, Array] | None]:
    """Return the head of an interrupted run and its last restart record, None if it came to none.

    Raises
    ------
    ResultsError
        If there are no segments: the run was never begun, or it is complete.
    """
    path = Path(path)
    folder = path if path.name.endswith(SEGMENTS) else path.with_name(path.name + SEGMENTS)
    if not folder.is_dir():
        state = "the run is complete" if path.is_file() else "no run to this name was begun"
        raise ResultsError(f"{path}: nothing to resume: there is no folder {str(folder)!r}; {state}")
    head, source = open_segments(folder)
    for segment in reversed(source.paths):
        with h5py.File(segment, "r") as file:
            if RESTART in file:
                return head, {name: dataset[...] for name, dataset in file[RESTART].items()}
    return head, None


def open_results(path: str | os.PathLike[str]) -> tuple[Head, FileSource, bool]:
    """Return head, arrays and completeness of a results file, or of the segments that a killed run left in its place.

    Raises
    ------
    ResultsError
        If there is neither, or the file is of another kind, a newer version or damaged.
    """
    path = Path(path)
    folder = path if path.name.endswith(SEGMENTS) else path.with_name(path.name + SEGMENTS)
    if path.is_dir() or (not path.exists() and folder.is_dir()):
        head, source = open_segments(folder)
        return head, source, False
    if not path.exists():
        raise ResultsError(f"results file {str(path)!r}: no such file")
    try:
        with h5py.File(path, "r") as file:
            head, is_complete = read_head(path, file)
            shapes = row_shapes(head)
            for name, shape in shapes.items():
                if name not in file or file[name].shape != (len(file["t"]), *shape):
                    raise ResultsError(f"{path}: dataset {name!r} is missing or misshapen; the file is damaged")
    except ResultsError:
        raise
    except (OSError, KeyError, ValueError, TypeError) as error:
        words = f"{path}: expected a results file of floatframe; it is damaged or of another kind: {error}"
        raise ResultsError(words) from error
    return head, FileSource((path,), shapes), is_complete


def validity_text(path: Path) -> str:
    """Return the notes on the range of the linear frames in a results file, or in its last segment, as text."""
    paths = [path] if path.is_file() else segment_paths(path if path.is_dir() else path.with_name(path.name + SEGMENTS))
    if not paths:
        return "[]"
    with h5py.File(paths[-1], "r") as file:
        return str(file.attrs.get(VALIDITY, "[]"))
