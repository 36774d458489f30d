"""Compile the kernels of motions, then run commands of `floatframe` when a line arrives on the standard input.

`python -m floatframe.cli.run_later demo "run crank.toml -o crank.h5" "plot crank.h5 -o crank.png"` does so while
another process makes the modal files that the commands read; kernels and modules are loaded once for all. Each command
is announced as typed in the folder `demo`. At the end of the input without a line, it ends.
"""

import logging
import sys
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from cms.cli.demo import announce
from floatframe.cli import compile_kernels, main

__all__ = ["run_later"]


def run_later(folder: Path, commands: Sequence[str]) -> None:
    """Compile, wait for a line, and run the commands up to the first that fails."""
    logging.disable(logging.WARNING)  # they would say that kernels can be compiled in advance
    with suppress(Exception):  # the command meets the same error and tells it
        compile_kernels.make_motion()
    logging.disable(logging.NOTSET)
    if sys.stdin.readline():
        for command in commands:
            announce(folder, f"floatframe {command}")
            sys.argv = ["floatframe", *command.split()]
            try:
                main()
            except SystemExit as end:
                if end.code:
                    raise


if __name__ == "__main__":
    run_later(Path(sys.argv[1]), sys.argv[2:])
