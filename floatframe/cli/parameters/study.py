"""The command study: models of a flexible body compared with a reference."""

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cms.cli.console import USER_ERROR, guarded, output_path, print_table, say, stages

if TYPE_CHECKING:
    from floatframe.design.laboratory.laboratory import LaboratoryResult

__all__ = ["register"]

KINDS = (".csv", ".json", ".png", ".svg", ".pdf")


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command("study")(study_command)


@guarded
def study_command(
    file: Annotated[Path, typer.Argument(help="Laboratory file (TOML), see docs/laboratory.md.")],
    outputs: Annotated[
        list[Path] | None, typer.Option("--output", "-o", help="A .csv, .json, .png, .svg or .pdf file; repeatable.")
    ] = None,
) -> None:
    """Run a mechanism with many models of its flexible body: mode sets, frames, modes, stiffening, parts.

    The result contains error against a reference, cost, and the first limit that is exceeded. A failed case is a row
    with its reason. Without -o, a table and a picture are written next to the file: blade.toml gives blade.csv and
    blade.png.

    Example: floatframe study blade.toml -o blade.csv -o blade.pdf
    """
    import io

    from fe_models.foundation.paths import replace_files
    from floatframe.design.laboratory.figures import convergence_figure
    from floatframe.design.laboratory.laboratory_file import read_laboratory, run_laboratory
    from floatframe.errors import ModelError

    asked = read_laboratory(file)
    wanted = outputs or [file.with_suffix(".csv"), file.with_suffix(".png")]
    inputs = (file, asked.system, asked.job)
    paths = [output_path(path, None, ModelError, overwrite_of=inputs, needs_file=True) for path in wanted]
    for path in paths:
        if path.suffix.lower() not in KINDS:
            raise ModelError(f"--output {path}: expected a file name that ends in {', '.join(KINDS)}")
    with stages() as clock:
        result = run_laboratory(asked, clock)
    contents: dict[Path, bytes] = {}
    for path in paths:
        if path.suffix.lower() == ".json":
            record = {"name": result.name, "reference": result.reference, "settled": result.settled,
                      "cases": result.table()}  # fmt: skip
            contents[path] = json_module.dumps(record, indent=2).encode()
        elif path.suffix.lower() == ".csv":
            contents[path] = csv_text(result).encode()
        else:
            target = io.BytesIO()
            convergence_figure(result).savefig(target, format=path.suffix.lower().removeprefix("."), dpi=200)
            contents[path] = target.getvalue()
    try:
        replace_files(contents)
    except OSError as error:
        raise ModelError(f"study: cannot be written: {error.strerror or error}; check folder and space") from error
    print_result(result)
    for path in paths:
        say(f"wrote {path}")
    if all(row.failure for row in result.cases):
        raise typer.Exit(USER_ERROR)


def csv_text(result: "LaboratoryResult") -> str:
    """Return the tidy table as CSV."""
    import csv
    import io

    rows = result.table()
    text = io.StringIO()
    writer = csv.DictWriter(text, fieldnames=list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()


def print_result(result: "LaboratoryResult") -> None:
    """Print one row per case."""
    rows = []
    for r in result.cases:
        if r.failure:
            rows.append((r.case.words, str(r.case.n_modes), "", "fails", "", "", "", r.failure))
            continue
        note = "" if not r.notes else r.notes[0] + (f" ({len(r.notes)} notes)" if len(r.notes) > 1 else "")
        told = (str(r.n_q), f"{100 * r.error:.3g}", r.worst, r.fails_first, f"{r.seconds:.3g}", note)
        rows.append((r.case.words, str(r.case.n_modes), *told))
    settled = "" if result.settled is None else f", itself settled to {100 * result.settled:.2g} %"
    print_table(
        f"{result.name}, against {result.reference}{settled}",
        ("description", "modes>", "coordinates>", "error %>", "of", "fails first", "time [s]>", "note"),
        rows,
    )
