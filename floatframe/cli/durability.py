"""The commands of durability: fatigue, shake."""

import math
from json import dumps
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.console import guarded, output_path, print_table, say, say_written, stages
from cms.cli.outputs import DOCUMENTS, TABLES, json_text, output_files, write_outputs

if TYPE_CHECKING:
    from floatframe.durability.shaking.loads.levels import Level
    from floatframe.durability.shaking.shake import ShakeJob, ShakeResult

__all__ = ["fatigue_command", "shake_command"]


# the command fatigue: damage and life on the surface of a body --------------------------------------------------------


@guarded
def fatigue_command(
    file: Annotated[Path, typer.Argument(help="Fatigue file (TOML), see docs/fatigue.md.")],
    outputs: Annotated[
        list[Path],
        typer.Option("--output", "-o", help="A .html, .pdf, .json, .vtu or .png file, or a table (.csv, ...)."),
    ] = [],  # noqa: B006
    json: Annotated[bool, typer.Option("--json", help="Write the same record as JSON, for other programs.")] = False,
) -> None:
    """Fatigue damage and life on the surface of a flexible body.

    The loads are results files of motions, or spectra.

    Without -o, a page, a table, a record and a surface are written next to the file: arm.toml gives arm.html, arm.csv,
    arm.json and arm.vtu.

    Example: floatframe fatigue arm.toml

    Example: floatframe fatigue arm.toml -o hot_spot.png -o arm.csv
    """
    from fe_models.foundation.toml_file import files_named
    from floatframe.durability.fatigue.assessment import assess
    from floatframe.durability.fatigue.fatigue_file import read_fatigue
    from floatframe.durability.fatigue.outputs import fatigue_record, render_fatigue, vtu_of, worst_table
    from floatframe.durability.fatigue.report import fatigue_document
    from floatframe.errors import FatigueError

    given = read_fatigue(file)
    inputs = (file, *files_named(given))
    default = [] if json else [file.with_suffix(ending) for ending in (".html", ".json", ".csv", ".vtu")]
    endings = (*DOCUMENTS, ".vtu", ".png", *TABLES)
    paths = output_files(outputs, default, endings, FatigueError, overwrite_of=inputs)
    with stages(remaining=True) as clock, clock("damage on the surface") as advance:
        made = assess(given, progress=advance)
    record = fatigue_record(made)
    if json:
        typer.echo(json_text(record), nl=False)
    else:
        print_fatigue(record)
    for path in [path for path in paths if path.suffix.lower() == ".png"]:
        drawing = render_fatigue(made, path)
        paths.remove(path)
        if drawing.note:
            typer.echo(f"note: {drawing.note}", err=True)
        if not json:
            say_written(path)
    write_outputs(
        paths, table=lambda: worst_table(made), record=record, document=lambda: fatigue_document(made), is_quiet=json,
        others={".vtu": lambda _: vtu_of(made)},
    )  # fmt: skip


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
         f"{record['n_nodes']}, of which {record['n_counted']} counted; the damage of the others is negligible"),
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


# the command shake: a structure on a moving base ----------------------------------------------------------------------


SHOWN = 14  #: largest number of printed outputs of a run


@guarded
def shake_command(
    file: Annotated[Path, typer.Argument(help="A shake file (TOML), see docs/shake.md, or a modal file (.h5).")],
    outputs: Annotated[
        list[Path],
        typer.Option("--output", "-o", help="A .html, .pdf or .json file, or a table (.csv, ...); repeatable."),
    ] = [],  # noqa: B006
    base: Annotated[str | None, typer.Option(help="For a modal file: the interface on the base.")] = None,
    q_factor: Annotated[
        float | None, typer.Option("--Q", help="For a modal file: amplification of all modes; default 25.")
    ] = None,
    sine: Annotated[
        str | None, typer.Option(help='For a modal file: level in g, "5:1,100:1" (Hz:g), or a file.')
    ] = None,
    rate: Annotated[float | None, typer.Option(help="Sweep rate in octaves per minute; none: steady.")] = None,
    random: Annotated[
        str | None, typer.Option(help='For a modal file: density in g2/Hz, "20:0.01,2000:0.01", or a file.')
    ] = None,
    shock: Annotated[
        str | None, typer.Option(help='For a modal file: pulse, "half-sine:50:0.011" (g, seconds).')
    ] = None,
    directions: Annotated[str, typer.Option(help="Base directions, each a run of its own.")] = "x,y,z",
    at: Annotated[list[str], typer.Option("--at", help="Interface or node number that is observed; repeatable.")] = [],  # noqa: B006
    json: Annotated[
        bool, typer.Option("--json", help="Write the record as JSON to the terminal, for other programs.")
    ] = False,
) -> None:
    """Shake a structure on its base: sine, random, shock, transient.

    Results are loads, stresses, spectra and notches.

    Without -o, tower.toml gives tower.shake.html, .json and .csv. For a modal file, all other interfaces are observed.

    Example: floatframe shake tower.toml

    Example: floatframe shake tower.h5 --base foot --Q 25 --sine 5:1,100:1 --rate 2 --random
    20:0.01,80:0.04,350:0.04,2000:0.007
    """
    from floatframe.durability.shaking.page import shake_document
    from floatframe.durability.shaking.record import light_record, shake_record, shake_table
    from floatframe.durability.shaking.shake import shake
    from floatframe.errors import ModelError

    given = {"--base": base, "--Q": q_factor, "--sine": sine, "--rate": rate, "--random": random, "--shock": shock}
    if file.suffix == ".toml":
        from floatframe.durability.shaking.shake_file import read_shake

        named = [key for key, value in given.items() if value is not None] + ["--at"] * bool(at)
        if named:
            raise ModelError(f"{', '.join(named)}: only for a modal file; {file} contains these settings")
        job = read_shake(file)
    else:
        job = job_of_options(file, base, q_factor, sine, rate, random, shock, directions, at)
    inputs = (file, Path(job.source)) if job.source else (file,)
    default = [] if json else [file.with_suffix(f".shake{ending}") for ending in (".html", ".json", ".csv")]
    paths = output_files(outputs, default, (*DOCUMENTS, *TABLES), ModelError, overwrite_of=inputs)
    with stages() as clock, clock(f"{job.structure.name}: shaken"):
        result = shake(job)
    if json:
        light, _ = light_record(shake_record(result), "")
        if "curves" in light:
            light["curves"] = "omitted here; -o NAME.json writes them into NAME.npz"
        typer.echo(dumps(light | {"table": shake_table(result).record()}, indent=1))
    else:
        print_result(result)

    def with_curves(path: Path) -> dict[Path, bytes]:
        """Return the record, and its curves in an archive beside it."""
        beside = path.with_suffix(".npz")
        if beside in paths:  # the table
            beside = path.with_name(f"{path.stem}_curves.npz")
        light, curves = light_record(shake_record(result), beside.name)
        light |= {"table": shake_table(result).record()}
        files = {path: (dumps(light, separators=(",", ":")) + "\n").encode()}
        if curves:
            files[output_path(beside, None, ModelError, overwrite_of=inputs)] = npz_of(curves)
        return files

    write_outputs(
        paths, table=lambda: shake_table(result), document=lambda: shake_document(result), is_quiet=json,
        others={".json": with_curves},
    )  # fmt: skip


def npz_of(arrays: dict[str, Any]) -> bytes:
    """Return arrays as the bytes of an .npz file."""
    import io

    import numpy as np

    stream = io.BytesIO()
    np.savez_compressed(stream, **arrays)
    return stream.getvalue()


def job_of_options(
    file: Path, base: str | None, q_factor: float | None, sine: str | None, rate: float | None, random: str | None,
    shock: str | None, directions: str, at: list[str],
) -> "ShakeJob":  # fmt: skip
    """Return the shake job for a modal file, as defined by the options."""
    import cms
    from floatframe.durability.shaking.loads.levels import ACCELERATIONS
    from floatframe.durability.shaking.loads.pulses import pulse
    from floatframe.durability.shaking.loads.random_vibration import RandomTest
    from floatframe.durability.shaking.loads.shock import TimeTest
    from floatframe.durability.shaking.loads.sine import SineTest
    from floatframe.durability.shaking.shake import ShakeJob
    from floatframe.durability.shaking.structure.body import bases_of_body
    from floatframe.durability.shaking.structure.damping import Damping
    from floatframe.durability.shaking.structure.places import Observed
    from floatframe.errors import ModelError

    body = cms.read(file)
    wanted = tuple(part.strip() for part in directions.split(","))
    if rate is not None and sine is None:
        raise ModelError("--rate: belongs to --sine")
    shocks = []
    if shock is not None:
        try:
            kind, amplitude, duration = shock.split(":")
            t, a = pulse(kind, float(amplitude), float(duration))
        except ValueError as error:
            if isinstance(error, ModelError):
                raise
            raise ModelError(f'--shock {shock}: expected pulse:g:seconds, such as "half-sine:50:0.011"') from None
        words = f"{kind} of {float(amplitude):g} g, {1e3 * float(duration):g} ms"
        shocks.append(TimeTest("shock", t, a * ACCELERATIONS["g"], wanted, kind="shock", words=words))
    names = [interface.name for interface in body.interfaces]
    held = {name for each in bases_of_body(body, base) for name in each.holds}
    places = [
        Observed(name, interface=name)
        if name in names
        else Observed(f"node {name}", node=int(name) if name.isdecimal() else name)
        for name in at or [name for name in names if name not in held]
    ]
    return ShakeJob(
        body,
        base,
        damping=Damping(Q=25.0 if q_factor is None else q_factor),
        outputs=places,
        sine=() if sine is None else (SineTest("sine", level(sine, "g", "--sine"), wanted, rate),),
        random=() if random is None else (RandomTest("random", level(random, "g2/Hz", "--random"), wanted),),
        shock=tuple(shocks),
        source=str(file),
    )


def level(words: str, unit: str, where: str) -> "Level":
    """Return a level given on the command line: "Hz:level,Hz:level", or a file."""
    from floatframe.durability.shaking.loads.levels import Level, read_level
    from floatframe.errors import ModelError

    if ":" not in words or Path(words).is_file():
        return read_level(Path(words), unit, where)
    try:
        rows = [[float(number) for number in part.split(":")] for part in words.split(",")]
    except ValueError:
        raise ModelError(f'{where} {words}: expected "Hz:level,Hz:level" in {unit}, or a file of two columns') from None
    return Level.of(rows, unit, where)


def print_result(result: "ShakeResult") -> None:
    """Print conversions, main modes, largest outputs of every run, and notches."""
    from floatframe.durability.shaking.record import conversions, run_title, table_rows

    model, masses = result.model, result.masses
    for line in conversions(model):
        say(line)
    for base in model.bases:
        x = ", ".join(f"{value:.6g}" for value in base.point)
        say(f"base {base.name}: holds {', '.join(base.holds) or 'the body, to the ground'}; forces about [{x}]")
    say(f"damping: {result.job.damping.description}; uncertainty: {result.job.uncertainty.description}")
    main = [k for k in range(len(masses.frequencies)) if masses.share[k].max() > 0.02][:15]
    print_table(
        "Modes with the base held that move more than 2 % of a mass or inertia [%]",
        ("mode>", "Hz>", "damping>", *(f"{name.partition(':')[2]}>" for name in masses.directions[:6])),
        [
            (
                str(k + 1),
                f"{masses.frequencies[k]:.5g}",
                f"{masses.damping[k]:.4g}",
                *(f"{100 * s:.2f}" for s in masses.share[k, :6]),
            )
            for k in main
        ]
        + [("", "sum of all", "", *(f"{100 * s:.2f}" for s in masses.cumulative[-1, :6]))],
    )
    runs: dict[tuple[str, str, str], list[tuple[Any, ...]]] = {}
    for row in table_rows(result):
        runs.setdefault((row[1], row[0], row[2]), []).append(row)
    for (kind, test, direction), rows in runs.items():
        extra = [
            (name, c)
            for name, c in (("3 sigma>", 10), ("quasi-static>", 11), ("swept>", 12), ("notched>", 13))
            if any(r[c] is not None for r in rows)
        ]
        print_table(
            f"{run_title(kind.capitalize(), test)}, {direction}",
            ("output", "unit", f"{rows[0][7]}>", "at", "with uncertainty>", *(name for name, _ in extra)),
            [
                (
                    r[3],
                    r[5],
                    f"{r[6]:.5g}",
                    r[8],
                    f"{r[9]:.5g}",
                    *("" if r[c] is None else f"{r[c]:.5g}" for _, c in extra),
                )
                for r in rows[:SHOWN]
            ],
        )
        if len(rows) > SHOWN:
            say(f"... and {len(rows) - SHOWN} more outputs in the written files")
    for run in result.time:
        for name, v, d in zip(run.inputs, run.velocity_left, run.displacement_left, strict=True):
            if math.isnan(v):  # a force
                continue
            say(
                f"{run_title(run.kind, run.test)}, {name}: at the end the base has {v:.5g} "
                f"{model.units.length_symbol}/{model.units.time_symbol} and {d:.5g} {model.units.length_symbol}"
            )
        if run.synthesis is not None:
            say(
                f"{run_title(run.kind, run.test)}: spectrum reached within {run.synthesis.decibels.min():+.2f} to "
                f"{run.synthesis.decibels.max():+.2f} dB of its target"
            )
    notches = [
        (
            f"{run_title(kind, test)}, {direction}",
            f"{n.first:.5g} to {n.last:.5g}",
            f"{n.deepest:.5g}",
            f"{n.depth:.2f}",
            n.reason,
        )
        for (kind, test, direction), run in result.notched.items()
        for n in run.notches
    ]
    if notches:
        print_table("Notches", ("run", "Hz", "deepest at>", "dB>", "reason"), notches)
    for note in result.notes:
        typer.echo(f"note: {note}", err=True)
