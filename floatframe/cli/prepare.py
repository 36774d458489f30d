"""The commands prepare and machine: compiled kernels, and copies of ready machines."""

import json
import os
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Annotated, Any

import typer

from cms.cli.console import guarded, print_table, say, stages
from cms.cli.demo import environment
from fe_models.foundation.stages import Stages

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

    This is needed once after an installation; code that is already compiled, or came with the package, is kept.

    Example: floatframe prepare
    """
    from floatframe.cli.compile_kernels import PARTS
    from floatframe.engine.kernels.compiler.choice import words
    from floatframe.errors import FloatframeError

    began, n_workers = time.perf_counter(), min(workers or os.cpu_count() or 1, len(PARTS))
    say(f"preparing {len(PARTS)} parts ({words()}), {n_workers} at a time; compiling all takes minutes")
    with stages() as clock:
        done = prepare_parts(tuple(PARTS), n_workers, clock=clock, tell=lambda part, words: say(f"{part:<10} {words}"))
    say(f"done in {time.perf_counter() - began:.0f} s")
    failed = {name: each["failed"] for name, each in done.items() if "failed" in each}
    if failed:
        name, why = next(iter(failed.items()))
        raise FloatframeError(f"prepare: the code of {name!r} could not be compiled: {why}; the other parts are ready")


def prepare_parts(
    parts: tuple[str, ...],
    workers: int,
    *,
    clock: Stages | None = None,
    tell: Callable[[str, str], None] = lambda part, words: None,
) -> dict[str, dict]:
    """Return the report of the process of each part, or its error; at most `workers` processes run at a time.

    Parameters
    ----------
    clock
        Shows a progress bar for each running part.
    tell
        Called with a part and what happened to it, when it begins and when it ends.
    """
    from floatframe.cli.compile_kernels import PARTS

    clock = clock or Stages()
    waiting, running, done = list(parts), {}, {}  # type: ignore[var-annotated]
    bars = {part: clock(part) for part in parts}
    try:
        while waiting or running:
            ready = [part for part in waiting if LATER.get(part) not in (*waiting, *running)]
            for part in ready[: workers - len(running)]:
                waiting.remove(part)
                tell(part, f"begins: {PARTS[part][0] if part in PARTS else part}")
                bars[part].__enter__()
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
                bars[part].__exit__(None, None, None)
                lines = errors.strip().splitlines()
                done[part] = (
                    json.loads(said.splitlines()[-1])
                    if process.returncode == 0
                    else {"failed": lines[-1] if lines else f"exit code {process.returncode}"}
                )
                tell(part, result_words(done[part]))
    finally:
        for process in running.values():
            process.kill()
            process.wait()
    return {part: done[part] for part in parts}


def result_words(report: dict[str, Any]) -> str:
    """Return what happened to a part."""
    if "failed" in report:
        return "failed"
    if report.get("compiled"):
        return f"compiled in {report['seconds']:.0f} s"
    return "came with the package" if report.get("from_package") else "was ready"
