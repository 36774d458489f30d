"""`cms recovery`: recovery tables of a modal file, listed or written for other programs."""

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

from cms.cli.console import output_path, print_table, say
from cms.errors import JobError, RecoveryError

if TYPE_CHECKING:
    from cms.body.reduced_body import ReducedBody

__all__ = ["RecoveryCommand", "run_recovery"]


@dataclass(frozen=True)
class RecoveryCommand:
    """The arguments of `cms recovery`."""

    file: Path
    table: str | None
    rows: Path | None
    over: str
    units: str | None
    output: Path | None


def run_recovery(request: RecoveryCommand) -> None:
    """List the rows of a body, or write one table; if `rows` is given, the tables of that file are made first.

    Raises
    ------
    CmsError
        If there is no such table, a row is unknown, or the file cannot be written.
    """
    from cms.body.modal_file.file import read, write
    from cms.reduction.recovery.files import chosen, write_recovery

    body = read(request.file, units=request.units)
    if request.rows is not None:
        body = with_rows(body, request.rows)
    if request.output is None:
        names = [chosen(body, request.table).name] if request.table or not body.recovery else list(body.recovery)
        for name in names:
            table = body.recovery[name]
            print_table(
                f"Recovery table {name}: {table.n_rows} rows, {len(table.loads)} loads",
                ("row>", "label", "unit"),
                [(k + 1, label, unit) for k, (label, unit) in enumerate(zip(table.labels, table.units, strict=True))],
            )
            say(f"left out: {table.truncated}\n")
        return
    path = output_path(request.output, request.output, RecoveryError, overwrite_of=(request.file,))
    if path.suffix.lower() == ".h5":
        write(body, path)
        say(f"wrote {path}: recovery tables {', '.join(body.recovery) or 'none'}")
        return
    written = write_recovery(body, path, table=request.table, over=request.over)
    for file in written.files:
        say(f"wrote {file}")
    say(f"units: {body.units.name} ({body.units.length_symbol}, {body.units.mass_symbol}, {body.units.time_symbol})")
    for note in written.notes:
        say(note)


def with_rows(body: "ReducedBody", path: Path) -> "ReducedBody":
    """Return the body with the tables requested in a file, as far as it knows them without its model."""
    from cms.jobs.tables.recovery_section import RecoveryFile, requests_of
    from cms.reduction.recovery.matrices import recovery_matrices
    from fe_models.foundation.toml_file import read_toml, validated

    sections = validated(RecoveryFile, read_toml(path, JobError), path, JobError).recovery
    made = recovery_matrices(body, requests_of(sections))
    twice = sorted(set(made) & set(body.recovery))
    if twice:
        raise RecoveryError(f"{path}: body {body.name!r} has a table {twice[0]!r} already; choose another name")
    return replace(body, recovery={**body.recovery, **made})
