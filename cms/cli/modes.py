"""The commands `cms modes` and `cms view`: a description of the modes of a job, and pictures and films of modes."""

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.arguments import ModalFile
from cms.cli.console import guarded, hertz, output_path, print_table, say, say_written, stages, vector_words

if TYPE_CHECKING:
    from cms.body.reduced_body import ReducedBody
    from cms.modes.mode_set import ModeSet

__all__ = ["list_modes", "mode_record", "view_command"]


# `cms view`: pictures and films of modes on the real surface ----------------------------------------------------------


@guarded
def view_command(
    file: ModalFile,
    mode: Annotated[int, typer.Option("--mode", "-m", help="Number of the mode, as cms info lists them.")] = 1,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Picture to write (.png).")] = None,
    animate: Annotated[Path | None, typer.Option("--animate", "-a", help="Film to write (.gif or .mp4).")] = None,
    scale: Annotated[
        float | None, typer.Option(help="Largest displacement drawn, as a share of the body's diagonal; default 0.09.")
    ] = None,
) -> None:
    """Picture or film of a mode on the surface of the body.

    It needs no display.

    Without -o and --animate, the picture is written beside the modal file: rod.h5 gives rod_mode3.png.

    Example: cms view rod.h5 --mode 3 -o m3.png

    Example: cms view rod.h5 --mode 3 --animate m3.gif
    """
    from cms.assessment.rendering import SceneError
    from cms.assessment.report.view import animate_mode, view_mode
    from cms.body.modal_file.file import read

    picture = output
    if output is None and animate is None:
        picture = file.with_name(f"{file.stem}_mode{mode}.png")
    wanted = [path for path in (picture, animate) if path]
    targets = [output_path(path, "", SceneError, overwrite_of=(file,), needs_file=True) for path in wanted]
    body = read(file)
    with stages() as clock:
        if picture is not None:
            with clock("draw"):
                view_mode(body, mode, picture, scale=scale)
        if animate is not None:
            with clock("film") as advance:
                animate_mode(body, mode, animate, scale=scale, on_frame=lambda done, all_: advance(done / all_))
    for path in targets:
        say_written(path)


# modes ----------------------------------------------------------------------------------------------------------------


FRAME_WORDS = {
    "tisserand": "mean axes: the elastic shapes carry no linear and no angular momentum",
    "nodal": "attached to nodes: six dofs there do not deform",
    "buckens": "best fit: the elastic shapes have no mean translation and rotation of the nodes",
}


def list_modes(path: Path, *, as_json: bool, changes: Mapping[str, Any]) -> None:
    """Compute the mode set and the reduced body of a job, and print their contents without writing a file."""
    from cms.jobs.body_of_job import job_body
    from cms.jobs.job import read_job
    from cms.jobs.mode_set_of_job import frame_of, job_mode_set, reduction_of
    from cms.reduction.reduction import reduce

    job = read_job(path, changes)
    with stages() as clock:
        body = job_body(job, clock)
        with clock(f"mode set {job.reduction.set}"):
            modes = job_mode_set(body, reduction_of(job, body))
        with clock("reduce"):
            reduced = reduce(body, modes, frame=frame_of(job, held=body.is_held), stress=False, geometric=False)
    record = mode_record(modes, reduced)
    if as_json:
        typer.echo(json.dumps(record, indent=2))
    else:
        print_modes(record)


def mode_record(modes: "ModeSet", reduced: "ReducedBody") -> dict[str, Any]:
    """Return the columns of a mode set and the modes of its reduced body, in plain types; frequencies in Hz."""
    from cms.assessment.quality.body_record import body_record

    dropped = reduced.provenance.get("mode set redundant", "none").split("; ")
    reduced_record = body_record(reduced)
    return {
        "body": reduced.name,
        "set": modes.name,
        "options": dict(modes.options),
        "columns": [
            {
                "number": k + 1,
                "label": label,
                "frequency_hz": None if math.isnan(frequency) else float(frequency / reduced.units.time),
                "dropped": label in dropped,
            }
            for k, (label, frequency) in enumerate(zip(modes.labels, modes.frequencies, strict=True))
        ],
        "rigid_body_motions_removed": int(reduced.provenance.get("mode set rigid-body motions removed", 0)),
        "frame": reduced_record["frame"],
        "modes": reduced_record["modes"],
        "free_frequencies_hz": reduced_record["free_frequencies_hz"],
    }


def print_modes(record: dict[str, Any]) -> None:
    """Print a record from `mode_record`."""
    columns, n_dropped = record["columns"], sum(column["dropped"] for column in record["columns"])
    say(f"Body {record['body']}, mode set {record['set']}: {len(columns)} columns, in this order")
    print_table(
        "Columns of the mode set",
        ("column>", "Hz>", "what it is", ""),
        [(c["number"], hertz(c["frequency_hz"]), c["label"], "dropped" if c["dropped"] else "") for c in columns],
    )
    frame, n_rigid = record["frame"], record["rigid_body_motions_removed"]
    at = f" at interface {frame['at']}" if frame["at"] else ""
    say(f"{n_dropped} redundant columns dropped; {n_rigid} rigid-body motions removed, which the frame carries.")
    say(f"Frame B: {frame['kind']}{at} ({FRAME_WORDS.get(frame['kind'], 'see docs/theory.md')});")
    say(f"origin at {vector_words(frame['origin'])} in mesh coordinates.\n")
    print_table(
        "Modes of the reduced body, the frame B held, by ascending frequency; static shapes last",
        ("mode>", "Hz>", "energy from"),
        [(mode["number"], hertz(mode["frequency_hz"]), mode["label"]) for mode in record["modes"]],
    )
    free = ", ".join(hertz(f) for f in record["free_frequencies_hz"])
    say(f"The free body (no frame held) vibrates at [Hz]: {free or 'none'}")
    options = [(key, value) for key, value in record["options"].items()]
    print_table("Options", ("", ""), options)
