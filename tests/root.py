"""Where the checkout begins, and how its commands are started, for tests."""

import signal
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def heed_signals() -> None:
    """A process in the background ignores SIGINT, one under nohup SIGHUP, and so do its children; ours must not."""
    for number in (signal.SIGINT, signal.SIGHUP):
        signal.signal(number, signal.SIG_DFL)
