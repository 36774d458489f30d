"""What a worker gives back: the result of a call, or its error, as bytes that can be read in another process."""

import pickle
from functools import lru_cache
from typing import Any

from fe_models.foundation.tasks.task_map import ProcessError, WorkerError

__all__ = ["answer", "read_answer", "sendable"]


def answer(function: bytes, value: bytes) -> bytes:
    """Return pickled (function(value),), or the pickled error."""
    try:
        call = loaded(function)
    except Exception as error:
        words = f"{type(error).__name__}: {error}"
        return sendable(WorkerError(f"the function cannot be loaded in another process: {words}"))
    try:
        return pickle.dumps((call(pickle.loads(value)),))
    except BaseException as error:  # SystemExit too: it is the answer of one value
        return sendable(error)


@lru_cache(1)
def loaded(function: bytes) -> Any:
    """Return the function of some bytes; what it keeps in memory stays for the next value."""
    return pickle.loads(function)


def read_answer(data: bytes) -> Any:
    """Return a tuple with the result, or the error; `WorkerError` is raised, for it is no matter of one value."""
    try:
        found = pickle.loads(data)
    except Exception as error:
        return ProcessError(f"the answer cannot be read: {type(error).__name__}: {error}")
    if isinstance(found, WorkerError):
        raise found
    return found


def sendable(error: BaseException) -> bytes:
    """Return an error as bytes; one that cannot be sent and read again is replaced by its words."""
    try:
        data = pickle.dumps(error)
        if isinstance(error, Exception) and type(pickle.loads(data)) is type(error):
            return data
    except Exception:
        pass
    return pickle.dumps(ProcessError(f"{type(error).__name__}: {error}"[:500]))
