"""Reliable Ctrl-C: Python loses an exception that is raised while an object is being freed."""

import signal
import threading
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["heeded_interrupts"]


@contextmanager
def heeded_interrupts() -> Iterator[Callable[[], None]]:
    """Record every Ctrl-C (SIGINT) within this context, in addition to raising it.

    Python raises `KeyboardInterrupt` between any two of its instructions. If these belong to the callback of a weak
    reference or to a `__del__`, the exception is printed and lost, and the work continues. In these places it is
    recorded but not raised. Long loops must therefore call the yielded function in every iteration.

    Yields
    ------
    Callable
        Function that raises `KeyboardInterrupt` if a Ctrl-C was recorded. It does nothing outside the main thread, or
        if the program has its own handler of SIGINT.
    """
    has_come = False

    def heed(number: int, frame: FrameType | None) -> None:
        nonlocal has_come
        has_come = True
        if not is_freeing(frame):
            signal.default_int_handler(number, frame)

    def raise_if_come() -> None:
        if has_come:
            raise KeyboardInterrupt

    is_main = threading.current_thread() is threading.main_thread()
    if not is_main or signal.getsignal(signal.SIGINT) is not signal.default_int_handler:
        yield raise_if_come
        return
    signal.signal(signal.SIGINT, heed)
    try:
        yield raise_if_come
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)


def is_freeing(frame: FrameType | None) -> bool:
    """Whether a frame, or one of its callers, runs while an object is being freed."""
    while frame is not None:
        if frame.f_code.co_name == "__del__" or frame.f_code.co_filename == weakref.__file__:
            return True
        frame = frame.f_back
    return False
