"""Shared parts of the command lines: error handling, progress, and tables for terminals and pipes.

Exit codes: 0 done, 1 a fault of the program, 2 an error that the user can correct, 130 interrupted.
"""

import errno
import functools
import logging
import os
import re
import sys
import traceback
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import Any, ParamSpec, TypeVar

import typer
from typer.core import TyperCommand, TyperGroup

from fe_models.foundation.errors import ReportedError
from fe_models.foundation.stages import Stages
from fe_models.foundation.words import number_list

__all__ = [
    "INTERRUPTED",
    "USER_ERROR",
    "bug",
    "commands",
    "guarded",
    "hertz",
    "output_path",
    "print_error",
    "print_table",
    "register",
    "run",
    "say",
    "say_written",
    "size_words",
    "stages",
    "vector_words",
    "version_option",
]

P = ParamSpec("P")
R = TypeVar("R")

FAULT, USER_ERROR, INTERRUPTED = 1, 2, 130
NO_SPACE = (errno.ENOSPC, errno.EDQUOT, errno.EFBIG)
show_tracebacks = ContextVar("show_tracebacks", default=False)  #: whether the option --debug is given
PIPE_WIDTH = 160  #: width in columns of tables that are not written to a terminal


# Error handling ------------------------------------------------------------------------------------------------------


def run(app: typer.Typer, name: str) -> None:
    """Run an application; text that the terminal's encoding cannot show is replaced and never causes an error."""
    notes = Notes()
    logging.getLogger().addHandler(notes)
    for stream in (sys.stdout, sys.stderr):
        reconfigure = getattr(stream, "reconfigure", None)
        if reconfigure is not None:
            reconfigure(errors="replace")
    try:
        try:
            app(prog_name=name)
        finally:
            logging.getLogger().removeHandler(notes)  # the process may run another command
            sys.stdout.flush()  # errors in writing are reported here, not by the interpreter at its end
    except KeyboardInterrupt:
        print_error("interrupted")
        sys.exit(INTERRUPTED)
    except OSError as error:
        if not isinstance(error, BrokenPipeError) and error.errno not in NO_SPACE:
            raise
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        if isinstance(error, BrokenPipeError):  # the reader of our output (head, less) has closed the pipe
            sys.exit(0)
        print_error(f"standard output cannot be written: {error.strerror}; free space on the disk, or lift its limit")
        sys.exit(USER_ERROR)


class Notes(logging.Handler):
    """Logging handler that prints the warnings of the packages on standard error, one line each, each once."""

    def __init__(self) -> None:
        super().__init__(logging.WARNING)
        self.printed: set[str] = set()

    def emit(self, record: logging.LogRecord) -> None:
        """Print one warning, unless the same was printed, perhaps with the full path of a file."""
        text = record.getMessage()
        key = text.replace(f"{os.getcwd()}{os.sep}", "")
        if key not in self.printed:
            self.printed.add(key)
            typer.echo(f"note: {text}", err=True)


class PlainHelp(TyperCommand):
    """Command whose help is printed literally: words in brackets are tables and units, not markup."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.help = escape(self.help or "")
        for parameter in self.params:
            if getattr(parameter, "help", None):
                parameter.help = escape(parameter.help)  # type: ignore[attr-defined]


class Commands(typer.Typer):
    """Application with commands of the class `PlainHelp`."""

    def command(self, name: str | None = None, **options: Any) -> Any:
        """Register a command."""
        return super().command(name, cls=options.pop("cls", PlainHelp), **options)


def register(app: typer.Typer, groups: Mapping[str, Mapping[str, Callable[..., None]]]) -> None:
    """Add commands under the headings of their groups in --help, in the order of work."""
    for heading, members in groups.items():
        for name, command in members.items():
            app.command(name, help=without_line_breaks(command.__doc__ or ""), rich_help_panel=heading)(command)


def without_line_breaks(text: str) -> str:
    """Return a docstring with one line for each paragraph, which the help then breaks to the width of the terminal."""
    return "\n\n".join(" ".join(paragraph.split()) for paragraph in re.split(r"\n\s*\n", text.strip()))


def commands(name: str, help: str, *, hints: Mapping[str, str] | None = None) -> typer.Typer:
    """Return an application with the options --version and --debug.

    `hints` gives, by name, the commands to use in place of commands that this program does not have. FILE or NAME in
    them is replaced by the arguments.
    """
    known = hints or {}

    class Hinting(TyperGroup):
        def get_params(self, ctx: Any) -> list[Any]:
            params = super().get_params(ctx)
            for param in params:
                if param.name == "show_completion":
                    param.hidden = True  # type: ignore[attr-defined]
                if param.name == "install_completion":
                    param.help = "Complete words in this shell."  # type: ignore[attr-defined]
            return params

        def format_help(self, ctx: Any, formatter: Any) -> None:
            print_help(self, ctx)

        def resolve_command(self, ctx: Any, args: list[str]) -> Any:
            if args[0] in known:
                given = " ".join(args[1:])
                hint = re.sub("FILE|NAME", lambda word: given or word[0], known[args[0]])
                ctx.fail(f"No such command {args[0]!r}. Use {hint}.")
            return super().resolve_command(ctx, args)

    app = Commands(
        name=name, help=help, cls=Hinting, no_args_is_help=True, rich_markup_mode="rich",
        pretty_exceptions_enable=False, context_settings={"help_option_names": ["-h", "--help"]},
    )  # fmt: skip

    @app.callback()
    def options(
        version: bool = version_option(name),
        debug: bool = typer.Option(False, "--debug", help="Show tracebacks of faults."),
    ) -> None:
        show_tracebacks.set(debug)

    options.__doc__ = help
    return app


def print_help(program: TyperGroup, ctx: Any) -> None:
    """Print options and commands, a line each under the line of their group: panels do not fit a screen."""
    from rich.console import Console
    from rich.table import Table

    shown = [each for each in program.get_params(ctx) if not getattr(each, "hidden", False)]
    groups = {"Options": [(", ".join(sorted(each.opts, key=len)), getattr(each, "help", "")) for each in shown]}
    for name, command in program.commands.items():
        heading = getattr(command, "rich_help_panel", None) or "Commands"
        groups.setdefault(heading, []).append((name, command.get_short_help_str(limit=80)))
    console = Console(highlight=False)
    console.print(program.get_usage(ctx), program.help, "", sep="\n", markup=False)
    for heading, rows in groups.items():
        console.rule(f"[bold]{heading}", align="left", style="dim")
        table = Table.grid(padding=(0, 1), pad_edge=True)
        table.add_column(no_wrap=True, style="bold cyan")
        for name, meaning in rows:
            table.add_row(f"{name:<11}", meaning)
        console.print(table)


def version_option(name: str) -> Any:
    """Return the option --version, which prints the version and exits."""

    def show(value: bool) -> None:
        if value:
            from importlib import metadata

            try:
                version = metadata.version("floatframe")
            except metadata.PackageNotFoundError:  # a checkout that is not installed
                version = "(not installed)"
            print(f"{name} {version}")
            raise typer.Exit

    return typer.Option(False, "--version", callback=show, is_eager=True, help="Show the version and exit.")


def guarded(command: Callable[P, R]) -> Callable[P, R]:
    """Decorate a command: errors become one message on standard error, and an exit code."""

    @functools.wraps(command)
    def safe(*args: P.args, **kwargs: P.kwargs) -> R:
        try:
            # collects warnings of overflows and the like; they are not shown if the command fails
            with warnings.catch_warnings(record=True) as caught:
                result = command(*args, **kwargs)
            for each in caught:
                warnings.warn_explicit(each.message, each.category, each.filename, each.lineno)
            return result
        except KeyboardInterrupt:
            print_error("interrupted; no output was left half written")
            raise typer.Exit(INTERRUPTED) from None
        except (typer.Exit, typer.Abort):
            raise
        except BrokenPipeError:  # the reader of our output (head, less) has closed the pipe
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            raise typer.Exit(0) from None
        except Exception as error:
            if isinstance(error, ReportedError):
                print_error(str(error))
                raise typer.Exit(USER_ERROR) from None
            if isinstance(error, OSError) and error.filename is not None:
                print_error(f"{error.filename}: {error.strerror}")
                raise typer.Exit(USER_ERROR) from None
            if isinstance(error, OSError) and error.errno in NO_SPACE:  # for example the cache of compiled code
                print_error(f"a file cannot be written: {error.strerror}; free space on the disk, or lift its limit")
                raise typer.Exit(USER_ERROR) from None
            print_error(bug(error))
            if show_tracebacks.get():
                traceback.print_exc()
            raise typer.Exit(FAULT) from None

    return safe


def bug(error: BaseException) -> str:
    """Return a short text about an unexpected error."""
    if isinstance(error, MemoryError):
        return "not enough memory; close other programs, take a coarser mesh or fewer modes"
    text = f"{type(error).__name__}: {error}".strip().removesuffix(":")
    return f"this is a fault of the program, not of the input: {text}\nRun it again with --debug before the command "\
           "to see where, and report it with that text."  # fmt: skip


def print_error(text: str) -> None:
    """Print a message on standard error, literally, without wrapping."""
    typer.secho("error: ", fg=typer.colors.RED, bold=True, nl=False, err=True)
    typer.echo(text, err=True)


def output_path(
    given: Any, default: Any, error: type[Exception], *, overwrite_of: Iterable[Any] = (), needs_file: bool = False
) -> Any:
    """Return the output path after a check, before any work, that it can be written.

    A device or a pipe is written to directly; with `needs_file`, for output in several parts, it is rejected.

    Raises
    ------
    error
        If the folder does not exist, the path is a folder, or the path is one of the inputs.
    """
    from fe_models.foundation.paths import is_stream, same_file

    path = Path(default if given is None else given)
    if is_stream(path):
        if needs_file:
            raise error(f"--output {path}: this is a device or a pipe; expected the name of a file")
        return path
    if path.is_dir():
        raise error(f"--output {path}: this is a folder; expected the name of a file")
    if not path.parent.is_dir():
        raise error(f"--output {path}: the folder {path.parent} does not exist; make it first")
    if not os.access(path.parent, os.W_OK):
        raise error(f"--output {path}: the folder {path.parent} is not writable")
    for source in overwrite_of:
        if same_file(path, Path(source)):
            raise error(f"--output {path}: this is an input; choose another name")
    return path


# Tables --------------------------------------------------------------------------------------------------------------


def print_table(title: str, columns: Sequence[str], rows: Iterable[Sequence[Any]], *, is_named: bool = False) -> None:
    """Print a table on standard output.

    A heading ending in '>' is right-aligned; `columns` may be empty. With `is_named`, the first column holds names,
    which are not broken.
    """
    from rich import box
    from rich.table import Table

    table = Table(
        title=title, title_justify="left", title_style="bold", box=box.SIMPLE_HEAD if any(columns) else box.SIMPLE,
        show_header=any(columns), pad_edge=False,
    )  # fmt: skip
    for k, column in enumerate(columns):
        right = column.endswith(">")
        heading = escape(column.removesuffix(">"))
        no_wrap = right or (k == 0 and is_named)
        table.add_column(heading, justify="right" if right else "left", no_wrap=no_wrap, overflow="fold")
    for row in rows:
        table.add_row(*(escape(cell) for cell in row))
    out().print(table)


def say(text: str) -> None:
    """Print a line on standard output, literally."""
    out().print(text, markup=False, soft_wrap=True)


def say_written(path: Path, n_bytes: int | None = None) -> None:
    """Print the name and size of a written file; without `n_bytes` the size of the file on disk."""
    say(f"wrote {path} ({size_words(path.stat().st_size if n_bytes is None else n_bytes)})")


def size_words(n_bytes: int) -> str:
    """Return the size of a file as text, in MB or kB."""
    return f"{n_bytes / 1e6:.2f} MB" if n_bytes >= 1e5 else f"{n_bytes / 1e3:.1f} kB"


def escape(cell: Any) -> str:
    """Return the text of a cell, escaped such that rich prints it literally."""
    from rich.markup import escape as escaped

    return escaped(cell if isinstance(cell, str) else f"{cell:.6g}" if isinstance(cell, float) else str(cell))


def out() -> Any:
    """Return the console of standard output, as wide as the terminal, or wide enough for a pipe."""
    from rich.console import Console

    width = None if sys.stdout.isatty() or "COLUMNS" in os.environ else PIPE_WIDTH
    return Console(width=width, highlight=False, emoji=False)


# Progress ------------------------------------------------------------------------------------------------------------


@contextmanager
def stages(*, remaining: bool = False) -> Iterator[Stages]:
    """Show progress bars on standard error, if that is a terminal."""
    from rich.console import Console
    from rich.progress import (
        BarColumn,
        Progress,
        TaskProgressColumn,
        TextColumn,
        TimeElapsedColumn,
        TimeRemainingColumn,
    )

    console = Console(stderr=True)
    if not console.is_terminal:
        yield Stages()
        return
    columns = [TextColumn("{task.description:<28}"), BarColumn(bar_width=30), TaskProgressColumn(), TimeElapsedColumn()]
    with Progress(*columns, *([TimeRemainingColumn()] if remaining else []), console=console, transient=True) as show:
        yield Stages(show)


def hertz(value: float | None) -> str:
    """Return a frequency with six digits [Hz]; "static" for a shape without mass."""
    return "static" if value is None else f"{value:.6g}"


def vector_words(values: Any, scale: float | None = None) -> str:
    """Return numbers in brackets; numbers within rounding of the scale (default: the largest) become 0."""
    return f"({number_list(values, scale)})"
