"""The commands of `cms`; each imports what it needs when it runs, so that `cms --help` answers at once."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.console import commands, guarded, output_path, print_table, say, stages, vector_words

if TYPE_CHECKING:
    from cms.cli.console import Stages
    from cms.job import Job
    from cms.reduced_body import ReducedBody

__all__ = ["app"]

app = commands("cms", "Component mode synthesis: a meshed part becomes a small, exact, portable flexible body.")

ModalFile = Annotated[Path, typer.Argument(help="A modal file, as cms reduce writes it.")]
Output = Annotated[Path | None, typer.Option("--output", "-o", help="Modal file to write.")]


@app.command("reduce")
@guarded
def reduce_command(
    job: Annotated[Path, typer.Argument(help="Job file (TOML), see docs/job_file.md.")],
    output: Output = None,
) -> None:
    """Reduce a finite element body to a modal file.

    Without -o the modal file stands beside the job file: rod.toml gives rod.h5.

    Example: cms reduce rod.toml -o rod.h5
    """
    from cms.errors import JobError
    from cms.job import read_job

    read = read_job(job)
    inputs = (job, *(path for path in (read.body.mesh, read.body.matrices) if path is not None))
    path = output_path(output, job.with_suffix(".h5"), JobError, overwrite_of=inputs)
    reduce_and_write(read, path)


def reduce_and_write(job: "Job", path: Path) -> "ReducedBody":
    """Run a job, write its modal file, and print what was done."""
    from cms.cli.reduce_job import reduce_job
    from cms.modal_file import write

    reports: list[Any] = []
    try:
        with stages() as clock:
            reduced = reduce_job(job, clock, on_report=reports.append)
            with clock("write"):
                write(reduced, path)
    finally:  # a mesh that is refused is better understood with its numbers
        for report in reports:
            print_table("Mesh", ("", ""), report.rows())
    print_body(reduced)
    print_times(clock)
    say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")
    return reduced


@app.command("info")
@guarded
def info_command(
    file: ModalFile,
    json: Annotated[bool, typer.Option("--json", help="Write the same record as JSON, for other programs.")] = False,
    units: Annotated[str | None, typer.Option(help="Show numbers in another unit system, such as m-kg-s.")] = None,
) -> None:
    """Show what is in a modal file: mass, inertia, units, frame, modes, interfaces, load cases, provenance.

    Example: cms info rod.h5 --json

    Example: cms info rod.h5 --units m-kg-s
    """
    if json:
        typer.echo(info_record(file, units))
        return
    from cms.modal_file import digest, read

    print_body(read(file, units=units), everything=True)
    say(f"digest {digest(file)}")


@app.command("frame")
@guarded
def frame_command(
    file: ModalFile,
    to: Annotated[str, typer.Option("--to", help="Body frame: tisserand, buckens or nodal.")],
    at: Annotated[str | None, typer.Option("--at", help="Interface that carries a nodal frame.")] = None,
    origin: Annotated[str | None, typer.Option(help="Origin of the frame in mesh coordinates, x,y,z.")] = None,
    axes: Annotated[str | None, typer.Option(help="Axes of the frame in mesh axes, x,y,z;x,y,z;x,y,z.")] = None,
    damping: Annotated[
        float | None, typer.Option(help="Ratio of the new modes; default: the damping of the file, carried over.")
    ] = None,
    units: Annotated[str | None, typer.Option(help="Write numbers in another unit system, such as m-kg-s.")] = None,
    geometric: Annotated[
        bool, typer.Option("--geometric-stiffness/--no-geometric-stiffness", help="Carry it over, or leave it out.")
    ] = True,
    output: Output = None,
) -> None:
    """Convert a modal file to another body frame, from the file alone; its modes are diagonalised afresh.

    Without -o the file stands beside the old one: rod.h5 gives rod_tisserand.h5.

    Example: cms frame rod.h5 --to tisserand -o rod_t.h5

    Example: cms frame rod.h5 --to nodal --at big_end
    """
    from cms.cli.frame import FrameRequest, run_frame

    print_body(run_frame(FrameRequest(file, to, at, origin, axes, damping, units, output, geometric)))


def info_record(file: Path, units: str | None = None) -> str:
    """Return what is in a modal file as JSON text."""
    import json

    from cms.cli.record import body_record
    from cms.modal_file import digest, read

    return json.dumps({**body_record(read(file, units=units)), "digest": digest(file)}, indent=2)


@app.command("view")
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
    """Draw a mode on the real surface of the body, as a picture or a film; needs no display.

    Without -o and --animate the picture stands beside the modal file: rod.h5 gives rod_mode3.png.

    Example: cms view rod.h5 --mode 3 -o m3.png

    Example: cms view rod.h5 --mode 3 --animate m3.gif
    """
    from cms.modal_file import read
    from cms.rendering import SceneError
    from cms.view import animate_mode, view_mode

    picture = output
    if output is None and animate is None:
        picture = file.with_name(f"{file.stem}_mode{mode}.png")
    targets = [output_path(path, "", SceneError, overwrite_of=(file,)) for path in (picture, animate) if path]
    body = read(file)
    with stages() as clock:
        if picture is not None:
            with clock("draw"):
                view_mode(body, mode, picture, scale=scale)
        if animate is not None:
            with clock("film") as advance:
                animate_mode(body, mode, animate, scale=scale, on_frame=lambda done, all_: advance(done / all_))
    for path in targets:
        say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")


@app.command("modes")
@guarded
def modes_command(
    job: Annotated[Path, typer.Argument(help="Job file (TOML), see docs/job_file.md.")],
    json: Annotated[bool, typer.Option("--json", help="Write the list as JSON, for other programs.")] = False,
) -> None:
    """List the modes of a job in words: which columns and shapes, in which order, in which frame; writes no file.

    Example: cms modes rod.toml
    """
    from cms.cli.modes import list_modes

    list_modes(job, as_json=json)


@app.command("check")
@guarded
def check_command(
    file: ModalFile,
    job: Annotated[Path | None, typer.Option("--job", "-j", help="Job file of the full model to compare with.")] = None,
    band: Annotated[
        float | None, typer.Option(help="Highest frequency of interest [Hz]; default: highest kept mode over 1.5.")
    ] = None,
    json: Annotated[bool, typer.Option("--json", help="Write the records as JSON, for other programs.")] = False,
) -> None:
    """Judge a modal file: one verdict per check, the reason, and what to do; exit code 1 if one fails.

    Without a job the file is asked whether it says one thing; with its job it is compared with the full model.

    Example: cms check rod.h5

    Example: cms check rod.h5 --job rod.toml --json
    """
    from cms.cli.check import check_file

    raise typer.Exit(check_file(file, job, band=band, as_json=json))


@app.command("frf")
@guarded
def frf_command(
    file: ModalFile,
    excited: Annotated[str, typer.Option("--from", help="Interface the force acts on.")],
    answering: Annotated[str, typer.Option("--to", help="Interface whose motion is shown.")],
    band: Annotated[str, typer.Option(help="Frequencies [Hz], lowest:highest or lowest:highest:number.")],
    component: Annotated[
        list[str] | None,
        typer.Option("--component", "-c", help="Motion, or motion/force, as uz or uz/ry; repeat for more [ux uy uz]."),
    ] = None,
    damping: Annotated[
        float | None, typer.Option(help="Ratio of every free-free mode; default: the file's own, 0.01 with --job.")
    ] = None,
    inertance: Annotated[bool, typer.Option("--inertance", help="Acceleration instead of displacement.")] = False,
    job: Annotated[Path | None, typer.Option("--job", "-j", help="Job file of the full model to draw over it.")] = None,
    output: Annotated[
        list[Path] | None, typer.Option("--output", "-o", help="Picture (.png .svg .pdf) or table (.csv); repeatable.")
    ] = None,
) -> None:
    """Frequency response of the free body from a force at one interface to the motion of another, in mesh axes.

    Example: cms frf rod.h5 --from big_end --to small_end --band 10:5000 -c uz -o frf.png

    Example: cms frf rod.h5 --from big_end --to small_end --band 10:5000 --job rod.toml -o frf.png -o frf.csv
    """
    from cms.cli.frf import FrfRequest, run_frf

    run_frf(
        FrfRequest(file, excited, answering, band, tuple(component or ()), damping, inertance, job, tuple(output or ()))
    )


@app.command("compare")
@guarded
def compare_command(
    job: Annotated[Path, typer.Argument(help="Job file (TOML) of the body, see docs/job_file.md.")],
    sets: Annotated[
        str, typer.Option(help="Mode sets with commas between.")
    ] = "guyan,craig-bampton,craig-bampton-ir,rubin",
    modes: Annotated[
        str, typer.Option(help="Numbers of vibration modes: from:to, from:to:step, or a list with commas.")
    ] = "0:20",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Folder of the report; default: beside the job.")
    ] = None,
    band: Annotated[float | None, typer.Option(help="Highest frequency that counts [Hz].")] = None,
    reference_modes: Annotated[int, typer.Option(help="Without --band: elastic free modes that count.")] = 10,
    load: Annotated[
        list[str] | None,
        typer.Option(help="Neighbour at an interface, for loaded sets: NAME:mass=1.2,stiffness=1e4; repeatable."),
    ] = None,
    pulse_at: Annotated[str | None, typer.Option(help="Interface the force pulse of the motion acts on.")] = None,
    motion: Annotated[
        Path | None, typer.Option(help="Reference motion instead of the pulse: .npz with u (n_dof, n_t) and t in s.")
    ] = None,
    stills: Annotated[int, typer.Option(min=0, help="Still pictures of mode shapes in the report.")] = 4,
) -> None:
    """Compare mode sets with the full model: which one is good enough, with how few modes, and why.

    The full model is solved once and kept in the folder of the report, so that a repeat is quick.

    Example: cms compare rod.toml --sets craig-bampton,craig-bampton-ir,rubin --modes 0:30 -o compare

    Example: cms compare rod.toml --sets rubin,benfield-hruda --load small_end:mass=1e-3 --band 5000
    """
    from cms.cli.compare import CompareRequest, run_compare

    run_compare(
        CompareRequest(job, sets, modes, output, band, reference_modes, tuple(load or ()), pulse_at, motion, stills)
    )


@app.command("split")
@guarded
def split_command(
    job: Annotated[Path, typer.Argument(help="Job file (TOML) of the whole body.")],
    n: Annotated[int | None, typer.Option("--parts", "-n", help="Number of parts of equal length.")] = None,
    at: Annotated[str | None, typer.Option(help="Instead of -n: places of the cuts along the axis, as 40,80.")] = None,
    axis: Annotated[
        str | None, typer.Option(help="Direction across which is cut: x, y, z or x,y,z; default: the longest.")
    ] = None,
    cut: Annotated[str, typer.Option(help="Interfaces at the cuts: rigid or distributing.")] = "rigid",
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder to write to.")] = None,
    reduce: Annotated[bool, typer.Option("--reduce", help="Reduce the parts at once.")] = False,
) -> None:
    """Split a body into parts with an interface at each cut, so that large deflections are carried by several frames.

    Writes a job for every part, and a system file that joins them. Without -o: rod.toml gives the folder rod_parts.

    Example: cms split blade.toml -n 4 --reduce

    Example: cms split rod.toml --at 40,80 --axis x
    """
    from cms.cli.split import SplitRequest, direction_of, places_of, split_job
    from cms.job import read_job

    files = split_job(SplitRequest(job, n, places_of(at), direction_of(axis), cut, output))
    for path in files:
        say(f"wrote {path}")
    if reduce:
        for path in files[:-1]:
            reduce_and_write(read_job(path), path.with_suffix(".h5"))


@app.command("demo")
@guarded
def demo_command(
    folder: Annotated[Path, typer.Argument(help="Folder for the files of the demo.")] = Path("demo"),
) -> None:
    """Run the whole line on a shipped connecting rod: reduce, info, view, run, plot, animate; about a minute.

    Example: cms demo
    """
    from cms.cli.demo import run_demo

    run_demo(folder)


def print_body(body: "ReducedBody", *, everything: bool = False) -> None:
    """Print mass properties, modes and interfaces of a body; provenance too if everything is wanted."""
    from cms.cli.record import body_record, body_size

    record = body_record(body)
    length, mass, inertia = (
        body.units.length_symbol, body.units.mass_symbol, f"{body.units.mass_symbol} {body.units.length_symbol}²"
    )  # fmt: skip
    frame = record["frame"]
    tensor, largest = record["inertia_about_center_of_mass"], record["principal_moments"][-1]
    size = body_size(body)
    rows = [
        ("name", record["name"]),
        ("units", f"{body.units.name} (force {body.units.force_symbol}, stress {body.units.stress_symbol})"),
        ("frame B", frame["kind"] + (f" at {frame['at']}" if frame["at"] else "")),
        ("origin of B", f"{vector_words(frame['origin'], size)} {length} (mesh coordinates)"),
        *[(f"{a} axis of B", f"{vector_words(axis, 1.0)} (mesh axes)") for a, axis in turned_axes(frame["axes"])],
        ("mass", f"{record['mass']:.6g} {mass}"),
        ("centre of mass", f"{vector_words(record['center_of_mass']['B'], size)} {length} (in B)"),
        ("", f"{vector_words(record['center_of_mass']['mesh'], size)} {length} (mesh coordinates)"),
        ("inertia about it", f"{vector_words(tensor[0], largest)} {inertia} (axes of B)"),
        ("", vector_words(tensor[1], largest)),
        ("", vector_words(tensor[2], largest)),
        ("principal moments", f"{vector_words(record['principal_moments'])} {inertia}"),
        ("mass moments", "exact" if record["moments_are_exact"] else "approximate (from bare matrices)"),
        ("kept nodes", f"{record['kept_nodes']}, {record['surface_triangles']} triangles of surface"),
        ("stress of modes", stress_words(record["stress"])),
        ("geometric stiffness", "spin, accelerations, interface loads" if record["geometric_stiffness"] else "none"),
        *([("quadratic modes", "second order at the kept nodes")] if record["quadratic_modes"] else []),
    ]
    print_table("Body", ("", ""), rows)
    print_table(
        "Modes (the frame B held)",
        ("mode>", "Hz>", "damping>", "energy from"),
        [
            (mode["number"], hertz(mode["frequency_hz"]), percent(mode["damping_ratio"]), mode["label"])
            for mode in record["modes"]
        ],
    )
    free = ", ".join(hertz(f) for f in record["free_frequencies_hz"])
    say(f"Free-free frequencies [Hz]: {free or 'none'}\n")
    if selected := record["provenance"].get("mode set selected"):
        say(f"Selected: {selected}\n")
    print_table(
        "Interfaces",
        ("name", "kind", "nodes>", f"position in B [{length}]"),
        [(i["name"], i["kind"], i["nodes"], vector_words(i["position"], size)) for i in record["interfaces"]],
    )
    force = body.units.force_symbol
    if record["load_cases"]:
        print_table(
            "Load cases (of amplitude 1, in B)",
            ("name", "kind", f"force [{force}]", f"torque about the origin [{force} {length}]"),
            [
                (c["name"], c["kind"], vector_words(c["force"], scale), vector_words(c["torque"], scale * size))
                for c, scale in ((case, load_scale(case, record["mass"])) for case in record["load_cases"])
            ],
        )
    if everything:
        print_table("Provenance", ("", ""), list(record["provenance"].items()))


def turned_axes(axes: Any) -> list[tuple[str, Any]]:
    """Return the axes of B by name, columns of their matrix; none where they are those of the mesh."""
    columns = [[row[k] for row in axes] for k in range(3)]
    unit = [[float(i == k) for i in range(3)] for k in range(3)]
    return [] if columns == unit else list(zip("xyz", columns, strict=True))


def load_scale(case: Any, mass: float) -> float:
    """Return the size of the forces of a load case, also of one in balance: by its resultant and its modal forces."""
    return max(map(abs, [*case["force"], *(h * mass**0.5 for h in case["modal_forces"])]), default=0.0)


def stress_words(stress: Any) -> str:
    """Return where the stress of the modes is known."""
    places = ["at the kept nodes"] if stress["nodal"] else []
    places += [f"at {stress['points']} points"] if stress["points"] else []
    return " and ".join(places) or "not kept"


def print_times(clock: "Stages") -> None:
    """Print the time of each stage."""
    rows = [(name, f"{seconds:.2f}") for name, seconds in clock.seconds.items()]
    print_table("Time", ("stage", "s>"), [*rows, ("all", f"{sum(clock.seconds.values()):.2f}")])


def hertz(value: float | None) -> str:
    """Return a frequency with six digits; a shape without mass has none."""
    return "static" if value is None else f"{value:.6g}"


def percent(value: float | None) -> str:
    """Return a damping ratio in percent."""
    return "" if not value else f"{100 * value:.3g} %"
