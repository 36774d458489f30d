"""The command demo: all steps with an included rod that bends in a fast crank, one by one as a user would type them."""

import os
import subprocess
import sys
import time
from contextlib import ExitStack, suppress
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO, Annotated

import typer

import cms
from cms.cli.console import guarded, print_table, say, size_words, stages
from cms.errors import JobError

__all__ = ["demo_command", "run_demo"]

JOBS = ("rod.toml", "crank.toml")  #: job files included in this package
MODE = 3
RUN_LATER = "floatframe.cli.run_later"  #: module that compiles kernels and runs a command when it is signalled
FPS = 15  #: frames per second of the film of the motion, which lasts 8 s; drawing it takes most of the time


@guarded
def demo_command(
    folder: Annotated[Path, typer.Argument(help="Folder for the files of the demo.")] = Path("demo"),
) -> None:
    """Run all steps with the included connecting rod.

    Reduce, info, view, run, plot, animate: about a minute. Both programs have this command.

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
    """Run every command, each announced; independent commands run at the same time.

    The process of the motion compiles its kernels during the reduction, which takes half a minute on a new machine.
    """
    from cms.cli.info import info_command, info_record
    from cms.cli.reduce import reduce_command
    from fe_models.foundation.parametric_file import schemas_named_in
    from fe_models.foundation.paths import replace_file, replace_files

    modal = folder / "rod.h5"
    with ExitStack() as running:
        run = begun(running, folder, "floatframe run crank.toml -o crank.h5", RUN_LATER)
        announce(folder, "cms reduce rod.toml -o rod.h5")
        reduce_command([folder / "rod.toml"], modal)
        run.signal()
        view = begun(running, folder, f"cms view rod.h5 --mode {MODE} -o m{MODE}.png --animate m{MODE}.gif")
        announce(folder, "cms info rod.h5")
        info_command(modal)
        announce(folder, "cms info rod.h5 --json > rod.json")
        replace_file(folder / "rod.json", info_record(modal).encode("utf-8"))
        schemas = schemas_named_in((folder / name).read_bytes() for name in JOBS)  # seconds, during the run
        replace_files({folder / name: content for name, content in schemas.items()})
        with stages() as clock, clock("run; its kernels are compiled once on a machine"):
            run.worker.wait()
        later = [
            begun(running, folder, words)
            for words in (
                "floatframe plot crank.h5 -o crank.png",
                f"floatframe animate crank.h5 --fps {FPS} -o crank.mp4",
            )
            if run.worker.returncode == 0
        ]
        for each in (view, run, *later):
            finish(folder, each)


@dataclass(frozen=True, eq=False)
class Begun:
    """Command in a separate process, and the file that receives its output."""

    words: str
    worker: subprocess.Popen[bytes]
    said: IO[bytes]

    def signal(self) -> None:
        """Let the command of a process of `RUN_LATER` run."""
        assert self.worker.stdin is not None  # the pipe was opened with the process
        with suppress(BrokenPipeError), self.worker.stdin as pipe:  # if the process has ended, `finish` shows why
            pipe.write(b"run\n")


def begun(running: ExitStack, folder: Path, words: str, module: str = "") -> Begun:
    """Start a command, `cms ...` or `floatframe ...`, in the folder as a user does; the stack terminates it.

    A module other than the command line of the program gets its arguments. Apart from this, the package does not know
    `floatframe`.
    """
    program, *arguments = words.split()
    said = running.enter_context(TemporaryFile())
    worker = subprocess.Popen(
        [sys.executable, "-P", "-m", module or f"{program}.cli", *arguments], cwd=folder, env=environment(),
        stdin=subprocess.PIPE if module else subprocess.DEVNULL, stdout=said, stderr=subprocess.STDOUT,
    )  # fmt: skip
    running.callback(ended, worker)
    return Begun(words, worker, said)


def finish(folder: Path, command: Begun) -> None:
    """Announce a started command, wait for its end, and print its output.

    Raises
    ------
    typer.Exit
        With the exit code of the command, which has printed its error.
    """
    announce(folder, command.words)
    sys.stdout.flush()
    command.worker.wait()
    command.said.seek(0)
    typer.echo(command.said.read().decode(errors="replace"), nl=False)
    if command.worker.returncode:
        raise typer.Exit(command.worker.returncode)


def ended(worker: subprocess.Popen[bytes]) -> None:
    """Terminate a process that is still running."""
    if worker.stdin is not None:
        worker.stdin.close()
    worker.kill()
    worker.wait()


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
