"""Writing of results: closed segments during the computation, and one file at the end.

A run that writes to swing.h5 first fills the folder swing.h5.segments with head.h5 and 000000.h5, 000001.h5, .... Each
is written under a temporary name and then renamed, so that a killed run leaves all closed segments readable. At the
end, the segments are copied into one file, which is renamed to swing.h5, and the folder is removed. The folder is
locked during the run.
"""

import logging
import os
import socket
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager
from dataclasses import replace
from itertools import chain
from pathlib import Path
from types import TracebackType
from typing import Any

import h5py
import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.hdf5_file import Manifest, write_sealed_file
from fe_models.foundation.paths import is_stream, same_file
from fe_models.foundation.seal import reason
from floatframe.engine.kernels.memory import Rows
from floatframe.errors import ResultsError
from floatframe.results.head import Head, text_of_head
from floatframe.results.results_file import (
    DATASETS,
    FORMAT,
    KIND,
    RESTART,
    SEGMENTS,
    VALIDITY,
    VERSION,
    FileSource,
    checked,
    open_segments,
    row_shapes,
    segment_paths,
    segments_folder,
)

__all__ = ["FileLock", "LockedError", "ResultsPlace", "ResultsWriter", "arrays_of", "last_restart"]


# a file lock that ends with the process that holds it, however the process ends ---------------------------------------


log = logging.getLogger(__name__)


class LockedError(ReportedError, OSError):
    """The lock is held by another process, or by another call in this process; the message names it."""


class FileLock:
    """Lock of a file for one holder at a time, on this machine and on network file systems that support locks.

    The operating system releases it when the process ends, even by SIGKILL, so a file left behind locks nothing.

    Parameters
    ----------
    path
        The lock file, which is created if missing and names the holder. Its folder must exist.

    Raises
    ------
    LockedError
        If another process or call holds the lock.
    OSError
        If the file cannot be created.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self.descriptor = -1
        while not self.is_held():
            descriptor = os.open(path, os.O_RDWR | os.O_CREAT, 0o666)
            try:
                lock(descriptor)
            except BlockingIOError:
                holder = os.read(descriptor, 200).decode("utf-8", "replace").strip()
                os.close(descriptor)
                raise LockedError(holder or "another process") from None
            except OSError as error:  # the file system does not support locks
                log.warning("%s: cannot be locked (%s); ensure that no second run writes there", path, error.strerror)
            self.descriptor = descriptor
            # the previous holder removed the file while we waited, so we locked a file that no longer exists
            if not self.is_held():
                self.release()
        os.ftruncate(self.descriptor, 0)
        words = f"process {os.getpid()} on {socket.gethostname()} since {time.strftime('%Y-%m-%d %H:%M:%S')}\n"
        os.write(self.descriptor, words.encode())

    def is_held(self) -> bool:
        """Whether we hold the lock and its file still exists under this name."""
        try:
            return self.descriptor >= 0 and os.path.samestat(os.fstat(self.descriptor), os.stat(self.path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Release the lock; its file remains."""
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1


def lock(descriptor: int) -> None:
    """Lock an open file, or raise `BlockingIOError` immediately."""
    if os.name == "posix":
        import fcntl

        # flock belongs to the open file, so two calls in one process exclude each other too
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        return
    import msvcrt

    try:
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
    except PermissionError:
        raise BlockingIOError from None


# writer ---------------------------------------------------------------------------------------------------------------


UNFINISHED = ".unfinished"  #: suffix of a file that is being written
LOCK = "lock"  #: name of the lock file in the folder of segments


class ResultsPlace(AbstractContextManager["ResultsPlace"]):
    """The location to which a run writes its results, locked against other runs.

    Parameters
    ----------
    path
        The results file, or its folder of segments.
    inputs
        Input files of the run, which it must not overwrite.
    is_begun
        Whether the folder of segments must exist, because an interrupted run is continued.

    Raises
    ------
    ResultsError
        If the place is not writable, or another run is writing there.
    """

    def __init__(
        self, path: str | os.PathLike[str], *, inputs: Sequence[str | os.PathLike[str]] = (), is_begun: bool = False
    ) -> None:
        given = Path(path)
        self.path = given.with_name(given.name.removesuffix(SEGMENTS))
        where = f"results file {str(self.path)!r}"
        if self.path.is_dir():
            raise ResultsError(f"{where}: expected a file name, got a folder")
        if is_stream(self.path):
            raise ResultsError(f"{where}: expected a file name, got a device or a pipe; a run writes its file in parts")
        if not self.path.parent.is_dir():
            raise ResultsError(f"{where}: no such folder {str(self.path.parent)!r}; create it")
        for source in inputs:
            if same_file(self.path, Path(source)):
                raise ResultsError(f"{where}: this is an input of the run; choose another name")
        self.path = self.path.resolve()  # resolves a link, so that the link is kept
        self.folder = segments_folder(self.path)
        if is_begun and not self.folder.is_dir():
            state = "the run is complete" if self.path.is_file() else "no run with this name was begun"
            raise ResultsError(f"{given}: nothing to resume: there is no folder {str(self.folder)!r}; {state}")
        self.lock = self.locked(where)

    def locked(self, where: str) -> FileLock:
        """Take the lock of the folder, which is created if necessary."""
        try:
            while True:
                self.folder.mkdir(exist_ok=True)
                try:
                    return FileLock(self.folder / LOCK)
                except FileNotFoundError:  # a run that has just ended has removed the folder
                    continue
        except LockedError as holder:
            raise ResultsError(
                f"{where}: another run writes to it now ({holder}); wait until it ends, stop it, or choose another name"
            ) from None
        except OSError as error:
            raise ResultsError(f"{where}: cannot be written: {reason(error)}") from error

    def clear(self) -> None:
        """Remove the files of a run from the folder, but not the lock."""
        for path in (*self.folder.glob(f"*{UNFINISHED}"), *self.folder.glob("[0-9]*.h5"), self.folder / "head.h5"):
            path.unlink(missing_ok=True)

    def remove(self) -> None:
        """Remove the folder, unless it contains other files."""
        self.clear()
        self.lock.path.unlink(missing_ok=True)
        try:
            self.folder.rmdir()
        except OSError:  # another run has begun there, or the folder contains other files
            pass

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Release the location; an empty folder is removed, segments remain."""
        if self.lock.is_held() and not (self.folder / "head.h5").exists():
            self.remove()
        self.lock.release()


class ResultsWriter:
    """Writes the rows of a run to closed segments and joins them at the end.

    Raises
    ------
    ResultsError
        If the folder or a file cannot be written.
    """

    def __init__(self, place: ResultsPlace, head: Head, *, goes_on: bool = False) -> None:
        """Begin with an empty folder of segments, or continue after the last restart record in an existing folder."""
        self.place = place
        self.path, self.folder = place.path, place.folder
        self.head = head
        self.n_segments = 0
        self.n_rows = 0  #: number of rows in closed segments
        self.open_rows: list[Rows] = []
        self.validity = "[]"  #: validity notes of the run as JSON text, see results/validity.py
        self.guarded(self.go_on if goes_on else self.begin)

    def begin(self) -> None:
        """Remove everything from the folder of segments except its head."""
        self.place.clear()
        self.write_file(self.folder / "head.h5", self.write_head)

    def go_on(self) -> None:
        """Remove the segments after the last restart record, because they will be computed again."""
        for path in self.folder.glob(f"*{UNFINISHED}"):
            path.unlink()
        paths = segment_paths(self.folder)
        while paths and not has_restart(paths[-1]):
            paths.pop().unlink()
        self.n_segments = len(paths)
        self.n_rows = sum(rows_in(path) for path in paths)

    def guarded(self, action: Callable[[], None]) -> None:
        """Run an action that writes; convert its failure to an error with a description."""
        try:
            action()
        except OSError as error:
            kept = f"; closed segments remain in {str(self.folder)!r}" if self.n_segments else ""
            raise ResultsError(f"results file {str(self.path)!r}: cannot be written: {reason(error)}{kept}") from error

    def write_file(self, path: Path, fill: Callable[[h5py.File], None]) -> None:
        """Write a file under a temporary name, then move it to its final name."""
        write_sealed_file(path, KIND, fill, part=path.with_name(path.name + UNFINISHED))

    def write_head(self, file: h5py.File) -> None:
        """Write a file that contains only the head."""
        manifest = Manifest(file)
        manifest.attributes("/", self.attributes(is_complete=False))
        manifest.close()

    def attributes(self, *, is_complete: bool) -> dict[str, str | int]:
        """Return the root attributes of a results file."""
        return {
            "format": FORMAT,
            "version": VERSION,
            "is_complete": int(is_complete),
            "head": text_of_head(self.head),
            VALIDITY: self.validity,
        }

    def append(self, rows: Rows) -> None:
        """Append rows to the segment that is still open."""
        if len(rows.t):
            self.open_rows.append(rows)

    def open_arrays(self) -> dict[str, Array]:
        """Return the datasets of the segment that is still open."""
        arrays = arrays_of(self.open_rows)
        arrays["drift"] = arrays["drift"][:, : len(self.head.joints)]
        return arrays

    def close_segment(self, restart: Mapping[str, Array] | None = None) -> None:
        """Write the open segment, unless it is empty, optionally with a restart record."""
        if not self.open_rows:
            return
        arrays = self.open_arrays()

        def fill(file: h5py.File) -> None:
            manifest = Manifest(file)
            manifest.attributes("/", {"format": FORMAT, "version": VERSION, VALIDITY: self.validity})
            for name, array in arrays.items():
                manifest.dataset(f"/{name}", array, {})
            for name, array in (restart or {}).items():
                manifest.dataset(f"/{RESTART}/{name}", array, {})
            manifest.close()

        self.guarded(lambda: self.write_file(self.folder / f"{self.n_segments:06d}.h5", fill))
        self.n_segments += 1
        self.n_rows += len(arrays["t"])
        self.open_rows = []

    def finish(self, summary: Mapping[str, Any] | None = None) -> None:
        """Join all segments, including the open one, to the results file with the summary; then remove them."""
        try:
            self.join(summary or {})
        except BaseException:
            self.close_segment()  # so that no row is lost
            raise
        self.place.remove()

    def join(self, summary: Mapping[str, Any]) -> None:
        """Write the results file from all segments."""
        _, source = open_segments(self.folder)
        if len(source.paths) != self.n_segments or sum(map(rows_in, source.paths)) != self.n_rows:
            raise ResultsError(
                f"{self.folder}: expected {self.n_segments} segments with {self.n_rows} rows, got {len(source.paths)} "
                "others: the folder was changed during the run; repeat the run"
            )
        self.head = replace(self.head, summary=summary)
        last = self.open_arrays() if self.open_rows else {}
        n_rows = self.n_rows + (len(last["t"]) if last else 0)

        def fill(file: h5py.File) -> None:
            manifest = Manifest(file)
            for name, shape in row_shapes(self.head).items():
                parts = chain(parts_of(source, name), [last[name]] if last else [])
                manifest.rows(f"/{name}", (n_rows, *shape), parts, {"is": DATASETS[name][1]})
            manifest.attributes("/", self.attributes(is_complete=True))
            manifest.close()

        self.guarded(lambda: self.write_file(self.path, fill))


def arrays_of(parts: list[Rows]) -> dict[str, Array]:
    """Return consecutive rows as datasets."""
    return {name: np.concatenate([getattr(rows, field) for rows in parts]) for name, (field, _) in DATASETS.items()}


def parts_of(source: FileSource, name: str) -> Iterator[Array]:
    """Yield a dataset segment by segment."""
    for path in source.paths:
        with h5py.File(path, "r") as segment:
            yield segment[name][...]


def rows_in(path: Path) -> int:
    """Return the number of rows of a segment."""
    with h5py.File(path, "r") as file:
        return len(file["t"])


def has_restart(path: Path) -> bool:
    """Return whether a run can be resumed after this segment."""
    with h5py.File(path, "r") as file:
        return RESTART in file


def last_restart(folder: Path) -> tuple[Head, dict[str, Array] | None]:
    """Return the head and the last restart record of an interrupted run, or None if there is no record.

    Raises
    ------
    ResultsError
        If the segments are damaged, or of another kind.
    """
    head, source = open_segments(folder)
    for segment in reversed(source.paths):
        with checked(segment, tell_age=False) as (_, items):
            prefix = f"/{RESTART}/"
            record = {name.removeprefix(prefix): item[...] for name, item in items.items() if name.startswith(prefix)}
        if record:
            return head, record
    return head, None
