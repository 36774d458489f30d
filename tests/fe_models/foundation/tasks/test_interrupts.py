"""Ctrl-C while an object is being freed, where Python drops it."""

import signal
import threading
import weakref

import pytest

from fe_models.foundation.tasks.interrupts import heeded_interrupts


class Freed:
    """Is interrupted while it is freed, by itself or by what watches it."""

    def __init__(self, *, alone: bool) -> None:
        self.alone = alone

    def __del__(self) -> None:
        if self.alone:
            signal.raise_signal(signal.SIGINT)


class Interrupting:
    """A key that interrupts where a weak dictionary looks it up to take it out."""

    is_armed = False

    def __hash__(self) -> int:
        if self.is_armed:
            self.is_armed = False
            signal.raise_signal(signal.SIGINT)
        return 1


def free_alone() -> None:
    Freed(alone=True)


def free_in_a_weak_dictionary() -> None:
    watched, key, kept = weakref.WeakValueDictionary(), Interrupting(), Freed(alone=False)
    watched[key] = kept
    key.is_armed = True
    del kept
    assert not key.is_armed


FREEING = [free_alone, free_in_a_weak_dictionary]


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@pytest.mark.parametrize("free", FREEING)
def test_python_alone_drops_it(free):
    free()  # raises nothing


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("free", FREEING)
def test_it_is_raised_at_the_next_turn(free):
    with heeded_interrupts() as raise_if_come:
        raise_if_come()
        free()
        with pytest.raises(KeyboardInterrupt):
            raise_if_come()


def test_elsewhere_it_is_raised_at_once():
    with heeded_interrupts(), pytest.raises(KeyboardInterrupt):
        signal.raise_signal(signal.SIGINT)
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler


def test_a_handler_of_the_program_and_other_threads_are_left_alone(monkeypatch):
    heard = []
    before = signal.signal(signal.SIGINT, lambda *_: heard.append("here"))
    try:
        with heeded_interrupts() as raise_if_come:
            signal.raise_signal(signal.SIGINT)
            raise_if_come()
        assert heard == ["here"]
    finally:
        signal.signal(signal.SIGINT, before)
    outcome = []

    def work() -> None:
        with heeded_interrupts() as raise_if_come:
            raise_if_come()
            outcome.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert outcome == [signal.default_int_handler]
