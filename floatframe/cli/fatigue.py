"""The command fatigue: damage and life on the surface of a body."""

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.console import guarded, output_path, print_table, say, stages

if TYPE_CHECKING:
    from floatframe.durability.fatigue.assessment import Assessment

__all__ = ["register"]

KINDS = ("html", "json", "csv", "vtu", "png")


def register(app: typer.Typer) -> None:
    """Add the command to an application."""
    app.command("fatigue")(fatigue_command)


@guarded
def fatigue_command(
    file: Annotated[Path, typer.Argument(help="Fatigue file (TOML), see docs/fatigue.md.")],
    outputs: Annotated[
        list[Path], typer.Option("--output", "-o", help="A .html, .json, .csv, .vtu or .png file; repeatable.")
    ] = [],  # noqa: B006
    json: Annotated[bool, typer.Option("--json", help="Write the same record as JSON, for other programs.")] = False,
) -> None:
    """Damage and life on the surface of a flexible body, from results files of motions or from spectra.

    Without -o, a page, a table, a record and a surface are written next to the file: arm.toml gives arm.html, arm.csv,
    arm.json and arm.vtu.

    Example: floatframe fatigue arm.toml

    Example: floatframe fatigue arm.toml -o hot_spot.png -o arm.csv
    """
    from fe_models.foundation.paths import replace_file
    from fe_models.foundation.toml_file import files_named
    from floatframe.durability.fatigue.assessment import assess
    from floatframe.durability.fatigue.fatigue_file import read_fatigue
    from floatframe.durability.fatigue.outputs import fatigue_record
    from floatframe.errors import FatigueError

    given = read_fatigue(file)
    inputs = (file, *files_named(given))
    paths = [output_path(path, None, FatigueError, overwrite_of=inputs) for path in outputs]
    if not paths and not json:
        paths = [
            output_path(None, file.with_suffix(f".{kind}"), FatigueError, overwrite_of=inputs) for kind in KINDS[:4]
        ]
    for path in paths:
        if path.suffix.lower().removeprefix(".") not in KINDS:
            raise FatigueError(f"--output {path}: expected a name that ends in {', '.join('.' + k for k in KINDS)}")
    with stages(remaining=True) as clock, clock("damage on the surface") as advance:
        made = assess(given, progress=advance)
    record = fatigue_record(made)
    if json:
        typer.echo(json_module.dumps(record, indent=2))
    else:
        print_fatigue(record)
    for path in paths:
        write(made, record, path, replace_file)
        if not json:
            say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")


def write(made: "Assessment", record: dict[str, Any], path: Path, replace_file: Any) -> None:
    """Write a file of a result, in the format of its suffix."""
    from floatframe.durability.fatigue.outputs import csv_of, render_fatigue, vtu_of

    kind = path.suffix.lower().removeprefix(".")
    if kind == "png":
        drawing = render_fatigue(made, path)
        if drawing.note:
            typer.echo(f"note: {drawing.note}", err=True)
    elif kind == "html":
        from floatframe.durability.fatigue.report import fatigue_html

        replace_file(path, fatigue_html(made).encode())
    elif kind == "vtu":
        replace_file(path, vtu_of(made))
    elif kind == "csv":
        replace_file(path, csv_of(made).encode())
    else:
        replace_file(path, (json_module.dumps(record, indent=2) + "\n").encode())


def sn_words(curve: dict[str, Any], unit: str) -> str:
    """Return an S-N curve as one line of text."""
    slopes = ", ".join(f"{slope:.4g}" for slope in curve["slope"])
    return (
        f"{curve['amplitude'][0]:.5g} {unit} at {curve['cycles'][0]:.4g} cycles, slopes {slopes}; given in "
        f"{curve['given_in']}"
    )


def print_fatigue(record: dict[str, Any]) -> None:
    """Print assumptions and the worst nodes."""
    unit = record["stress_unit"]
    n_points = record["n_points"]
    rows = [
        ("body", record["body"]),
        ("criterion", f"{record['criterion']}, mean stress {record['mean_stress']}"),
        ("counting", record["method"]),
        *((f"S-N curve {each['name']}".strip(), sn_words(each["curve"], unit)) for each in record["materials"]),
        ("blocks", ", ".join(f"{each['name']} ({each['repeats']:.6g} times)" for each in record["blocks"])),
        ("nodes and stress points" if n_points else "nodes",
         f"{record['n_nodes']}, of which {record['n_counted']} counted; the others cannot matter"),
        ("damage", "none" if not record["damage"] else f"{record['damage']:.4g} a programme"),
        ("life", "no end" if record["life"] is None else f"{record['life']:.5g} {record['life_unit']}"),
        *(("note", note) for note in record["notes"]),
    ]  # fmt: skip
    print_table("Fatigue", ("", ""), rows)
    print_table(
        "Worst nodes",
        ("", "node", "material", "place", "damage>", f"life [{record['life_unit']}]>", f"amplitude [{unit}]>", "plane"),
        [
            (
                str(rank), each["node"], each["material"], f"({each['x']:.5g}, {each['y']:.5g}, {each['z']:.5g})",
                f"{each['damage']:.4g}",
                "no end" if each["life"] is None else f"{each['life']:.5g}", f"{each['largest_amplitude']:.5g}",
                each["plane"],
            )
            for rank, each in enumerate(record["worst"], start=1)
        ],
    )  # fmt: skip
