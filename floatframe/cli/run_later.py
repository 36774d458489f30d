"""Compile the kernels of motions, then run a command of `floatframe` when a line arrives on the standard input.

`python -m floatframe.cli.run_later run crank.toml -o crank.h5` does so while another process makes the modal files that
the command reads; the kernels and modules are loaded only once. At the end of the input without a line, it ends.
"""

import logging
import sys
from collections.abc import Sequence
from contextlib import suppress

from floatframe.cli import compile_kernels, main

__all__ = ["run_later"]


def run_later(arguments: Sequence[str]) -> None:
    """Compile, wait for a line, and run the command with these arguments."""
    logging.disable(logging.WARNING)  # they would say that kernels can be compiled in advance
    with suppress(Exception):  # the command meets the same error and tells it
        compile_kernels.make_motion()
    logging.disable(logging.NOTSET)
    if sys.stdin.readline():
        sys.argv = ["floatframe", *arguments]
        main()


if __name__ == "__main__":
    run_later(sys.argv[1:])
