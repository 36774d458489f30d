"""A lock that ends with the process that holds it, however it ends."""

import logging
import os
import socket
import time
from pathlib import Path

from fe_models.foundation.errors import ReportedError

__all__ = ["FileLock", "LockedError"]

log = logging.getLogger(__name__)


class LockedError(ReportedError, OSError):
    """Another process (or another call in this one) holds the lock; its text says which."""


class FileLock:
    """The lock of a file: at most one holder at a time, on this machine and where the file system locks over a network.

    The system gives it back when the process ends, even by SIGKILL, so that a file left behind locks nothing.

    Parameters
    ----------
    path
        The file, which is made where it is missing; it tells who holds the lock. Its folder must be there.

    Raises
    ------
    LockedError
        If another one holds it.
    OSError
        If the file cannot be made.
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
            except OSError as error:  # a file system without locks
                log.warning("%s: cannot be locked (%s); see that no second run writes there", path, error.strerror)
            self.descriptor = descriptor
            if not self.is_held():  # the holder before removed it while we waited: that was its lock, not ours
                self.release()
        os.ftruncate(self.descriptor, 0)
        words = f"process {os.getpid()} on {socket.gethostname()} since {time.strftime('%Y-%m-%d %H:%M:%S')}\n"
        os.write(self.descriptor, words.encode())

    def is_held(self) -> bool:
        """Whether the lock is ours and its file is still the one of that name."""
        try:
            return self.descriptor >= 0 and os.path.samestat(os.fstat(self.descriptor), os.stat(self.path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Give the lock back; the file stays."""
        if self.descriptor >= 0:
            os.close(self.descriptor)
            self.descriptor = -1


def lock(descriptor: int) -> None:
    """Take the lock of an open file, or raise `BlockingIOError` at once."""
    if os.name == "posix":
        import fcntl

        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)  # of the open file: two calls in a process exclude, too
        return
    import msvcrt

    try:
        msvcrt.locking(descriptor, msvcrt.LK_NBLCK, 1)  # type: ignore[attr-defined]
    except PermissionError:
        raise BlockingIOError from None
