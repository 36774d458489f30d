"""The answer of a worker: the result of a call, or its error, as bytes that another process can read."""

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
    except BaseException as error:  # SystemExit included: it is the answer for a single value
        return sendable(error)


@lru_cache(1)
def loaded(function: bytes) -> Any:
    """Return the function from its bytes; the function stays cached, so its memory persists between values."""
    return pickle.loads(function)


def read_answer(data: bytes) -> Any:
    """Return a tuple with the result, or the error; `WorkerError` is raised, because it concerns all values."""
    try:
        found = pickle.loads(data)
    except Exception as error:
        return ProcessError(f"the answer cannot be read: {type(error).__name__}: {error}")
    if isinstance(found, WorkerError):
        raise found
    return found


def sendable(error: BaseException) -> bytes:
    """Return an error as bytes; an error that cannot be pickled and read again is replaced by its text."""
    try:
        data = pickle.dumps(error)
        if isinstance(error, Exception) and type(pickle.loads(data)) is type(error):
            return data
    except Exception:
        pass
    return pickle.dumps(ProcessError(f"{type(error).__name__}: {error}"[:500]))
