"""The command demo: all steps with an included rod that bends in a fast crank, one by one as a user would type them."""

import os
import subprocess
import sys
import time
from collections.abc import Sequence
from contextlib import ExitStack, suppress
from importlib.resources import files
from pathlib import Path
from typing import Annotated

import typer

import cms
from cms.cli.console import guarded, print_table, say, size_words, stages
from cms.errors import JobError

__all__ = ["demo_command", "run_demo"]

JOBS = ("rod.toml", "crank.toml")  #: job files included in this package
MODE = 3
RUN_LATER = "floatframe.cli.run_later"  #: module that compiles kernels and runs commands when it is signalled
MOTION = (  #: commands of `floatframe`
    "run crank.toml -o crank.h5",
    "plot crank.h5 -o crank.png",
    "animate crank.h5 --fps 12 -o crank.mp4",  # it lasts 8 s; drawing it takes most of the time
    "schema system -o system.schema.json",
)


@guarded
def demo_command(
    folder: Annotated[Path, typer.Argument(help="Folder for the files of the demo.")] = Path("demo"),
) -> None:
    """Run all steps with the included connecting rod.

    Reduce, info, view, run, plot, animate: some ten seconds, and half a minute more the first time. Both
    programs have this command.

    Example: cms demo
    """
    run_demo(folder)


def run_demo(folder: Path) -> None:
    """Copy the included part and its jobs into a folder, and run every command on them.

    Raises
    ------
    JobError
        If the folder cannot be made, or contains a changed job, which is not overwritten.
    """
    began = time.perf_counter()
    put_inputs(folder)
    run_steps(folder)
    list_files(folder)
    say(f"{time.perf_counter() - began:.0f} s; change rod.toml or crank.toml and run the commands above in {folder}")


def run_steps(folder: Path) -> None:
    """Run every command, each announced, those of `cms` in this process and those of `floatframe` in another.

    That process compiles its kernels during the reduction, which takes half a minute on a new machine, and computes
    the motion while modes are drawn.
    """
    from cms.cli.info import info_command, info_record
    from cms.cli.modes import view_command
    from cms.cli.reduce import reduce_command
    from cms.cli.schema import schema_command_of
    from fe_models.foundation.paths import replace_file

    modal = folder / "rod.h5"
    with ExitStack() as running:
        motion = begun(running, folder, MOTION)
        announce(folder, "cms reduce rod.toml -o rod.h5")
        reduce_command([folder / "rod.toml"], modal)
        signal(motion)
        announce(folder, "cms info rod.h5")
        info_command(modal)
        announce(folder, "cms info rod.h5 --json > rod.json")
        replace_file(folder / "rod.json", info_record(modal).encode("utf-8"))
        announce(folder, "cms schema job -o job.schema.json")
        schema_command_of("cms")("job", folder / "job.schema.json")
        announce(folder, f"cms view rod.h5 --mode {MODE} -o m{MODE}.png --animate m{MODE}.gif")
        view_command(modal, MODE, folder / f"m{MODE}.png", folder / f"m{MODE}.gif")
        finish(motion)


def begun(running: ExitStack, folder: Path, commands: Sequence[str]) -> subprocess.Popen[bytes]:
    """Start the process that runs commands of `floatframe` in the folder; the stack terminates it.

    Apart from its module, the package does not know `floatframe`.
    """
    worker = subprocess.Popen(
        [sys.executable, "-P", "-m", RUN_LATER, str(folder), *commands], cwd=folder, env=environment(),
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
    )  # fmt: skip
    running.callback(ended, worker)
    return worker


def signal(worker: subprocess.Popen[bytes]) -> None:
    """Let a process of `RUN_LATER` run its commands."""
    assert worker.stdin is not None  # the pipe was opened with the process
    with suppress(BrokenPipeError), worker.stdin as pipe:  # if the process has ended, `finish` shows why
        pipe.write(b"run\n")


def finish(worker: subprocess.Popen[bytes]) -> None:
    """Print what the commands of a process print, as they do, until it ends.

    Raises
    ------
    typer.Exit
        With the exit code of the command that failed, which has printed its error.
    """
    assert worker.stdout is not None  # the pipe was opened with the process
    with stages() as clock, clock("run; its kernels are compiled once on a machine"):
        line = worker.stdout.readline()
    while line:
        typer.echo(line.decode(errors="replace"), nl=False)
        line = worker.stdout.readline()
    if worker.wait():
        raise typer.Exit(worker.returncode)


def ended(worker: subprocess.Popen[bytes]) -> None:
    """Terminate a process that is still running, and close its pipes."""
    worker.kill()
    worker.wait()
    for pipe in (worker.stdin, worker.stdout):
        if pipe is not None:
            pipe.close()


def environment() -> dict[str, str]:
    """Return the environment of child processes, in which they find the packages of this process."""
    search = os.pathsep.join([str(Path(cms.__file__).parents[1]), *filter(None, [os.environ.get("PYTHONPATH")])])
    return os.environ | {"PYTHONPATH": search}


def list_files(folder: Path) -> None:
    """Print the list of created files."""
    made = {
        "rod.msh": "the shipped mesh, tet10",
        "rod.toml": "what to reduce and how",
        "rod.h5": "the modal file",
        "rod.json": "what is in it",
        f"m{MODE}.png": f"mode {MODE}, picture",
        f"m{MODE}.gif": f"mode {MODE}, film",
        "crank.toml": "the system: the rod between crank and slider",
        "crank.h5": "its motion",
        "crank.png": "its plots",
        "crank.mp4": "its film",
        "job.schema.json": "keys of rod.toml, for completion in an editor",
        "system.schema.json": "keys of crank.toml, for completion in an editor",
    }
    typer.echo()
    rows = [(str(folder / name), size_words((folder / name).stat().st_size), words) for name, words in made.items()]
    print_table("Files of the demo", ("file", "size>", "what it is"), rows)


def put_inputs(folder: Path) -> None:
    """Copy the mesh and job files into the folder; raise `JobError` rather than overwrite a changed job."""
    from fe_models.foundation.paths import replace_file
    from fe_models.parts import shipped_mesh

    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise JobError(f"{folder}: cannot be made: {error.strerror}; choose another folder: cms demo FOLDER") from error
    jobs = {name: (files("cms.cli") / "data" / name).read_bytes() for name in JOBS}
    for name, content in jobs.items():
        if (folder / name).exists() and (folder / name).read_bytes() != content:
            raise JobError(
                f"{folder / name}: is there already, with other contents, and would be lost; move it away, or choose "
                "another folder: cms demo FOLDER"
            )
    for name, content in jobs.items():
        replace_file(folder / name, content)
    replace_file(folder / "rod.msh", shipped_mesh("slender_rod").read_bytes())


def announce(folder: Path, command: str) -> None:
    """Announce a step by printing the equivalent command."""
    typer.echo()
    typer.secho(f"{folder}$ {command}", bold=True)
