"""The commands prepare and machine: compiled kernels, and copies of ready machines."""

import json
import os
import subprocess
import sys
import time
from pathlib import Path
from typing import Annotated

import typer

from cms.cli.console import guarded, print_table, say, stages
from cms.cli.demo import environment

__all__ = ["example_command", "prepare_command", "prepare_parts"]


# the command example: copies of ready machines ------------------------------------------------------------------------


@guarded
def example_command(
    name: Annotated[str | None, typer.Argument(help="A machine; without it the command lists them.")] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder to copy it into; default: its name.")
    ] = None,
) -> None:
    """Copy an example machine into a folder, or list all examples.

    Its jobs and systems are copied.

    Example: floatframe example antenna -o my_antenna
    """
    from floatframe.machines.catalogue import MACHINES, copy_machine

    if name is None:
        print_table(
            "Machines", ("machine", "what", "shows"), [(key, each.title, each.shows) for key, each in MACHINES.items()]
        )
        return
    folder = output or Path(name)
    for path in copy_machine(name, folder):
        say(f"{path}")
    say("its README.md lists the commands in order")


# prepare --------------------------------------------------------------------------------------------------------------


RUN = "import sys; from floatframe.cli.compile_kernels import main; main(sys.argv[1:])"
LATER = {"relative": "motion", "schemes": "motion"}  #: parts that start after another part, whose kernels they need


@guarded
def prepare_command(
    workers: Annotated[
        int, typer.Option("--workers", "-j", min=0, help="Processes at a time; 0: one per processor.")
    ] = 0,
) -> None:
    """Compile the code of motions and reductions in advance.

    Otherwise it is compiled at first use.

    This is needed once after an installation; code that is already compiled is kept.

    Example: floatframe prepare
    """
    from floatframe.cli.compile_kernels import PARTS
    from floatframe.engine.kernels.compiler.choice import words
    from floatframe.errors import FloatframeError

    began = time.perf_counter()
    with stages() as clock, clock("compile"):
        done = prepare_parts(tuple(PARTS), workers or os.cpu_count() or 1)
    rows = [
        (name, PARTS[name][0], f"compiled in {each['seconds']:.0f} s" if each.get("compiled") else "was ready")
        for name, each in done.items()
        if "failed" not in each
    ]
    print_table(f"Compiled code ({words()})", ("part", "for", "now"), rows)
    say(f"{time.perf_counter() - began:.0f} s")
    failed = {name: each["failed"] for name, each in done.items() if "failed" in each}
    if failed:
        name, why = next(iter(failed.items()))
        raise FloatframeError(f"prepare: the code of {name!r} could not be compiled: {why}; the other parts are ready")


def prepare_parts(parts: tuple[str, ...], workers: int) -> dict[str, dict]:
    """Return the report of the process of each part, or its error; at most `workers` processes run at a time."""
    waiting, running, done = list(parts), {}, {}  # type: ignore[var-annotated]
    try:
        while waiting or running:
            ready = [part for part in waiting if LATER.get(part) not in (*waiting, *running)]
            for part in ready[: workers - len(running)]:
                waiting.remove(part)
                running[part] = subprocess.Popen(
                    [sys.executable, "-P", "-c", RUN, part], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                    stderr=subprocess.PIPE, text=True, env=environment(),
                )  # fmt: skip
            for part, process in list(running.items()):
                try:
                    said, errors = process.communicate(timeout=0.1)
                except subprocess.TimeoutExpired:
                    continue
                del running[part]
                lines = errors.strip().splitlines()
                done[part] = (
                    json.loads(said.splitlines()[-1])
                    if process.returncode == 0
                    else {"failed": lines[-1] if lines else f"exit code {process.returncode}"}
                )
    finally:
        for process in running.values():
            process.kill()
            process.wait()
    return {part: done[part] for part in parts}
