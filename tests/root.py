"""Where the checkout begins, and how its commands are started, for tests."""

import signal
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent


def heed_interrupts() -> None:
    """A process started in the background of a shell ignores SIGINT, and its children after it; ours must not."""
    signal.signal(signal.SIGINT, signal.SIG_DFL)
