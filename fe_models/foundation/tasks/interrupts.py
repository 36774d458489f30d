"""Ctrl-C that is not lost: Python drops an exception that is raised while an object is being freed."""

import signal
import threading
import weakref
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from types import FrameType

__all__ = ["heeded_interrupts"]


@contextmanager
def heeded_interrupts() -> Iterator[Callable[[], None]]:
    """Within this, every Ctrl-C (SIGINT) is remembered as well as raised where it comes.

    Python raises `KeyboardInterrupt` between any two of its instructions. Where these are of a weak reference that
    vanishes, or of a `__del__`, the exception is printed and dropped, and the work goes on. Here it is not raised at
    such places; work in a long loop calls what this gives at every turn.

    Yields
    ------
    Callable
        Raises `KeyboardInterrupt` if one has come. Never does outside the main thread, or where the program has a
        handler of its own: Python and that handler decide then.
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
    """Whether a frame, or one that called it, runs while an object is being freed."""
    while frame is not None:
        if frame.f_code.co_name == "__del__" or frame.f_code.co_filename == weakref.__file__:
            return True
        frame = frame.f_back
    return False
