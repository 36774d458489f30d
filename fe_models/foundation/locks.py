"""A file lock that ends with the process that holds it, however the process ends."""

import logging
import os
import socket
import time
from pathlib import Path

from fe_models.foundation.errors import ReportedError

__all__ = ["FileLock", "LockedError"]

log = logging.getLogger(__name__)


class LockedError(ReportedError, OSError):
    """Another process, or another call in this process, holds the lock; the message names it."""


class FileLock:
    """Lock of a file with at most one holder, on this machine and on network file systems that support locks.

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
        """Whether we hold the lock, and its file still has this name."""
        try:
            return self.descriptor >= 0 and os.path.samestat(os.fstat(self.descriptor), os.stat(self.path))
        except FileNotFoundError:
            return False

    def release(self) -> None:
        """Release the lock; the file stays."""
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
