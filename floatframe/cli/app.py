"""The commands of `floatframe`; each imports its modules when it runs, so that --help responds at once."""

import time
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

import floatframe.cli.analyses as analyses
import floatframe.cli.driven as driven
import floatframe.cli.durability as durability
import floatframe.cli.exchange as exchange
import floatframe.cli.export as export
import floatframe.cli.fits as fits
import floatframe.cli.linear as linear
import floatframe.cli.prepare as prepare
import floatframe.cli.spectra as spectra
import floatframe.cli.studies as studies
import floatframe.cli.view as view
from cms.cli.arguments import SetValues, changes_of
from cms.cli.console import (
    INTERRUPTED,
    commands,
    guarded,
    output_path,
    print_error,
    print_table,
    register,
    say_written,
    stages,
)
from cms.cli.demo import demo_command
from cms.cli.outputs import PICTURES, output_file, write_outputs
from cms.cli.schema import schema_command_of
from cms.cli.show import show_command

if TYPE_CHECKING:
    from collections.abc import Callable

    from cms.body.reduced_body import ReducedBody
    from fe_models.foundation.stages import Stages
    from floatframe.results.trajectory import Trajectory
    from floatframe.simulation.integrate import Progress

__all__ = ["app"]

app = commands(
    "floatframe",
    "Flexible multibody dynamics: bodies from modal files, joints and forces become motion.",
    hints={
        "eig": "floatframe modes FILE",
        "study": "floatframe compare FILE",
        "machine": "floatframe example NAME",
        "bode": "floatframe response FILE",
        "simulate": "floatframe run FILE",
        "reduce": "cms reduce FILE",
        "urdf": "floatframe export FILE --to urdf",
        "fmu": "floatframe export FILE --to fmu",
        "generate": "floatframe export FILE --to c (or python, casadi, matlab, fmu-c)",
    },
)

ResultsFile = Annotated[Path, typer.Argument(help="A results file, as floatframe run writes it.")]


@guarded
def run_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML), see docs/system_file.md.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Results file to write.")] = None,
    formulation: Annotated[
        str | None,
        typer.Option("--formulation", help="absolute or relative (joint) coordinates; default: as in [run]."),
    ] = None,
    watch: Annotated[
        str | None,
        typer.Option(
            "--watch",
            help="Reaction to steps that make the motion inaccurate or add energy: stop, tell or off; default: as in "
            "[run], else stop.",
        ),
    ] = None,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Compute the motion of a system.

    Without -o, the results are written next to the system file: swing.toml gives swing.h5. A file with another `kind`
    (sweep, optimization, laboratory, shake, fatigue) is run by the command for it; --set changes the system of a sweep.

    Example: floatframe run swing.toml -o swing.h5

    Example: floatframe run swing.toml --set length=0.4 --set run.h=1e-4
    """
    from fe_models.foundation.toml_file import read_toml
    from floatframe.errors import ResultsError, SystemFileError
    from floatframe.files.cosimulation.coupled_motion import co_simulate
    from floatframe.files.system_file.read_system import read_system
    from floatframe.files.system_file.run_section import required_run
    from floatframe.integrators.relative import in_formulation
    from floatframe.simulation.integrate import integrate

    kind = read_toml(system, SystemFileError).get("kind", "system")
    if kind in OTHER_KINDS:
        if formulation or watch or (set_values and kind != "sweep"):
            raise SystemFileError(
                f"{system}: kind = {kind!r}: --formulation and --watch belong to systems, --set to systems and sweeps"
            )
        changes = {"set_values": set_values} if set_values else {}
        OTHER_KINDS[kind](system, **changes, **({} if output is None else {"outputs": [output]}))
        return
    model, given = read_system(system, changes_of(set_values))
    analyses.tell_left_out(model)
    options = required_run(given, system, begins_there=not model.fmus)
    integrator = options.integrator if formulation is None else in_formulation(options.integrator, formulation)
    inputs = (system, *model.files)
    path = output_path(output, system.with_suffix(".h5"), ResultsError, overwrite_of=inputs, needs_file=True)
    compute(
        model.name,
        path,
        lambda on_progress: (
            co_simulate(
                model, integrator, options.t_end, options.h, options.coupling, output=path,
                output_every=options.output_every, progress=on_progress,
            )
            if model.fmus
            else integrate(
                model, integrator, options.t_end, options.h, output=path, output_every=options.output_every,
                progress=on_progress, watch=options.watch if watch is None else watch, state=options.start_state(model),
            )
        ),
    )  # fmt: skip


#: what `floatframe run` does with files of other kinds than systems
OTHER_KINDS: "dict[str, Callable[..., None]]" = {
    "sweep": studies.sweep_command,
    "optimization": fits.optimize_command,
    "laboratory": studies.compare_command,
    "shake": durability.shake_command,
    "fatigue": durability.fatigue_command,
}


@guarded
def resume_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML) of the run that was interrupted.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Results file of that run.")] = None,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Continue an interrupted run.

    The motion is that of an uninterrupted run.

    Without -o, the results are next to the system file: swing.toml gives swing.h5.

    Example: floatframe resume swing.toml -o swing.h5
    """
    from floatframe.errors import ResultsError
    from floatframe.files.system_file.read_system import read_system
    from floatframe.simulation.integrate import resume

    if system.suffix in (".h5", ".segments"):
        raise ResultsError(
            f"{system}: expected the system file (TOML) of the run, got its results; name them with -o: floatframe "
            f"resume {system.with_suffix('').with_suffix('.toml').name} -o {system}"
        )
    model, _ = read_system(system, changes_of(set_values))
    path = output or system.with_suffix(".h5")
    compute(model.name, path, lambda on_progress: resume(model, path, progress=on_progress))


def compute(name: str, path: Path, run: "Callable[[Callable[[Progress], None]], Trajectory]") -> None:
    """Run a motion with a progress bar; print a summary, or the location of the partial results if interrupted."""
    from floatframe.results.results_file import segments_folder, segments_words

    try:
        with stages(remaining=True) as clock:
            load_kernels(clock)
            with clock(f"{name}: motion") as advance:

                def on_progress(progress: "Progress") -> None:
                    advance(progress.n_steps / progress.n_total)

                trajectory = run(on_progress)
    except KeyboardInterrupt:
        segments = segments_folder(path.resolve())
        kept = f"{segments_words(segments)}; floatframe resume continues it"
        print_error(f"interrupted; {kept if segments.is_dir() else 'nothing was written'}")
        raise typer.Exit(INTERRUPTED) from None
    print_run(trajectory)
    say_written(path)


def load_kernels(clock: "Stages") -> None:
    """Load the compiled code; report if it is being compiled, which happens once after an installation."""
    began = time.perf_counter()
    with clock("compiled code (made at first use)"):
        from floatframe.engine.kernels.compiler.choice import words
        from floatframe.engine.kernels.entry import prepare

        is_new = prepare()
    if is_new:
        seconds = time.perf_counter() - began
        typer.echo(
            f"note: compiled the code of the motion in {seconds:.0f} s ({words()}); later runs find it ready. Other "
            "formulations and schemes are compiled at their first use, or all at once by floatframe prepare",
            err=True,
        )


def print_run(trajectory: "Trajectory") -> None:
    """Print a summary of a motion, its cost and its accuracy."""
    from floatframe.results.export import run_record
    from floatframe.results.sensors.left_out import share_words

    record = run_record(trajectory, spectra.known_system(trajectory))
    units = trajectory.units
    second, length = units.time_symbol, units.length_symbol
    energy = f"{units.force_symbol} {length}"
    run = record["run"]
    rows = [
        ("system", record["system"]),
        ("units", units.name),
        ("bodies", ", ".join(body_words(body) for body in record["bodies"])),
        ("integrator", integrator_words(run)),
        ("step", step_words(run, second)),
        ("time", f"{record['t_first']:.6g} to {record['t_last']:.6g} {second}, {record['n_outputs']} outputs"),
        ("steps", str(record["n_steps"])),
    ]
    if not record["is_complete"]:
        rows.append(("note", f"this run did not reach its end, {run.get('t_end', 0):.6g} {second}"))
    summary = record["summary"]
    if summary.get("n_rejected"):
        rows.append(("rejected steps", f"{summary['n_rejected']}, repeated with shorter steps"))
    if "n_iterations" in summary:
        each = summary["n_iterations"] / max(summary["n_steps"], 1)
        rows.append(("Newton iterations", f"{summary['n_iterations']} ({each:.2f} a step)"))
    for event in summary.get("events", ()):
        done = ["run stopped"] * event["stop"] + [f"{name} on" for name in event["switch_on"]]
        done += [f"{name} off" for name in event["switch_off"]]
        done += [f"impulse {value:.6g} at {name}" for name, value in event.get("impulse", {}).items()]
        rows.append(("event", f"{event['name']} at {event['t']:.9g} {second}: {', '.join(done) or 'recorded'}"))
    for name, largest in summary.get("left_out", {}).items():
        words = share_words(largest["share"], largest["t"])
        rows.append(("left out by modes", f"body {name!r}: {words} {second}"))
    if "wall_time" in summary:
        rows.append(("wall time", f"{summary['wall_time']:.2f} s"))
    rows.append(("energy defect", f"{record['energy_defect']:.2e} of {record['energy_scale']:.6g} {energy}"))
    print_table("Run", ("", ""), rows)
    print_table(
        f"Energy [{energy}]",
        ("", "start>", "end>"),
        [(name, *(f"{v:.6g}" for v in pair)) for name, pair in record["energy"].items() if pair and any(pair)],
    )
    for title, is_of_a_frame in (
        ("Notes on the steps of the run", False),
        ("Bodies that left the range of their linear frame", True),
    ):
        notes = [note for note in trajectory.validity if note.is_of_a_frame == is_of_a_frame]
        if notes:
            print_table(
                title,
                ("body", "what", "limit>", "largest>", f"from [{second}]>", "what to do"),
                [
                    (note.body, note.kind, f"{note.limit:g}", f"{note.largest:.3g}", f"{note.t_first:.6g}", note.action)
                    for note in notes
                ],
            )
    if record["drift"]:
        print_table(
            "Joints: largest drift",
            ("joint", f"{length}>", "rad>", f"{length}/{second}>", f"rad/{second}>"),
            [(name, *(f"{value:.1e}" for value in drift.values())) for name, drift in record["drift"].items()],
        )

    if record["sensors"]:
        print_table(
            "Sensors",
            ("", "unit", "least>", "greatest>", "last>", f"peak at [{second}]>"),
            [
                (
                    name,
                    column["unit"],
                    *(f"{column[key]:.6g}" for key in ("least", "greatest", "last")),
                    peak_words(column),
                )
                for name, column in record["sensors"].items()
            ],
        )
    if record["places"]:
        places = [(name, each) for name, words in record["places"].items() for each in words]
        print_table("Places of sensors on flexible bodies", ("", "place"), places)


def peak_words(column: dict[str, Any]) -> str:
    """Return the time of the largest magnitude of a measured quantity, with the node or instance where it was."""
    numbers = [f"{name} {value}" for name, value in column["peak"].items() if name != "t"]
    return ", ".join([f"{column['peak']['t']:.6g}", *numbers])


def body_words(body: dict[str, Any]) -> str:
    """Return name, number of modes and stiffening of a body, as text."""
    stiffened = ", stiffened" if body["is_stiffened"] else ""
    return f"{body['name']} ({body['n_modes']} modes{stiffened})"


def step_words(run: dict[str, Any], second: str) -> str:
    """Return the step size as text; if the error controls the step, its upper limit."""
    if run.get("error_tolerance") is not None:
        return f"as the error allows, up to {run['h']:.6g} {second}"
    return f"{run['h']:.6g} {second}"


def integrator_words(run: dict[str, Any]) -> str:
    """Return the integrator and its parameters."""
    known = {
        "integrator",
        "t_start",
        "t_end",
        "h",
        "output_every",
        "floatframe",
        "digest",
        "gravity",
        "system_file",
        "system_file_digest",
        "changes",
        "watch",
    }
    options = ", ".join(f"{key} = {value}" for key, value in run.items() if key not in known and value is not None)
    return f"{run.get('integrator', '')} ({options})"


@guarded
def info_command(
    file: Annotated[Path, typer.Argument(help="A results file (.h5) or a robot (.urdf).")],
    json: Annotated[bool, typer.Option("--json", help="Write the same record as JSON, for other programs.")] = False,
) -> None:
    """Contents of a results file, energy balance, joint drift.

    For a robot, its links and joints are shown; `floatframe check` tells of a system file.

    Example: floatframe info swing.h5 --json
    """
    from floatframe.errors import ResultsError
    from floatframe.results.trajectory import read_trajectory

    if file.suffix == ".toml":
        raise ResultsError(f"{file}: expected a results file (.h5) or a robot (.urdf); try floatframe check {file}")
    if file.suffix == ".urdf":
        exchange.print_robot(file, as_json=json)
        return
    trajectory = read_trajectory(file)
    if json:
        import json as json_module

        from floatframe.results.export import run_record

        record = run_record(trajectory, spectra.known_system(trajectory))
        typer.echo(json_module.dumps(record, indent=2, ensure_ascii=True))
        return
    print_run(trajectory)


@guarded
def plot_command(
    file: ResultsFile,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Picture to write (.png, .svg, .pdf).")] = None,
    sensors: Annotated[
        list[str],
        typer.Option("--sensor", "-s", help="Only this sensor, sensor.column or joint.coordinate; * and ? are wild."),
    ] = [],  # noqa: B006
    kind: Annotated[
        str,
        typer.Option("--as", help="Spectra: psd, amplitude, octave, third-octave, orders, waterfall; default: time."),
    ] = "",
    resolution: Annotated[float | None, typer.Option(help="For spectra: distance of lines [Hz].")] = None,
    rotation: Annotated[str, typer.Option(help="For orders: sensor with the angle or speed of the rotation.")] = "",
) -> None:
    """Plot a motion.

    The plots show positions, energies, elastic displacement, reactions, energy error, joint drift and sensors.

    Without -o, the picture is written next to the results: swing.h5 gives swing.png. More than eight panels go into
    pages: swing.png, swing-2.png, or one .pdf.

    Example: floatframe plot swing.h5 -o swing.png

    Example: floatframe plot swing.h5 --sensor tip --sensor hinge.angle

    Example: floatframe plot swing.h5 --sensor "tip*" --as psd
    """
    from cms.errors import CmsError
    from floatframe.errors import ResultsError
    from floatframe.pictures.animation import bodies_of, require_modal_files
    from floatframe.pictures.overview import overview_pages
    from floatframe.results.sensor_choice import chosen_measurements
    from floatframe.results.sensor_plots import sensor_pages
    from floatframe.results.sensors import measured
    from floatframe.results.trajectory import read_trajectory

    trajectory = read_trajectory(file)
    read = (file, *trajectory.files)
    path = output_file(output, file.with_suffix(".png"), PICTURES, ResultsError, overwrite_of=read)
    if kind:
        spectra.plot_as(trajectory, sensors, kind, path, resolution=resolution, rotation=rotation)
        return
    has_bodies = True
    try:
        require_modal_files(trajectory)
    except CmsError as error:  # the motion can be plotted without its bodies
        typer.echo(f"note: elastic displacement is omitted: {error}", err=True)
        has_bodies = False
    system = spectra.known_system(trajectory)
    bodies = bodies_of(trajectory, system) if has_bodies else {}
    if sensors:
        if system is None:
            raise ResultsError(
                "--sensor: the system file of the run does not exist any more, or the run was made in Python"
            )
        chosen = chosen_measurements(system, trajectory, sensors)
        figures = sensor_pages(chosen, title=system.name, time_symbol=system.units.time_symbol)
    else:
        found = [] if system is None else [*measured(system, trajectory).values()]
        figures = overview_pages(trajectory, bodies, found)
    write_outputs([path], figure=lambda: figures)


@guarded
def animate_command(
    file: ResultsFile,
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Film to write (.gif or .mp4).")] = None,
    speed: Annotated[
        float | None, typer.Option(help="Seconds of motion per second of film; default: automatic.")
    ] = None,
    magnification: Annotated[
        float | None, typer.Option(help="Magnification of elastic displacement; default: automatic.")
    ] = None,
    fps: Annotated[float, typer.Option(help="Frames per second.")] = 25.0,
    color: Annotated[str, typer.Option(help="Colour of flexible bodies: displacement or von-mises.")] = "displacement",
) -> None:
    """Film of the deformed bodies, coloured by displacement or stress.

    It needs no display.

    Without -o, the film is written next to the results: swing.h5 gives swing.gif.

    Example: floatframe animate swing.h5 -o swing.mp4

    Example: floatframe animate swing.h5 --color von-mises
    """
    from fe_models.foundation.words import nearest
    from floatframe.errors import ResultsError
    from floatframe.model.bodies.rigid_body import RigidBody
    from floatframe.pictures.animation import animate, bodies_of, require_modal_files
    from floatframe.pictures.body_colors import BODY_COLORS
    from floatframe.results.trajectory import read_trajectory

    if color not in BODY_COLORS:
        raise ResultsError(f"--color {color}: expected one of {', '.join(BODY_COLORS)}{nearest(color, BODY_COLORS)}")
    trajectory = read_trajectory(file)
    path = output_path(
        output, file.with_suffix(".gif"), ResultsError, overwrite_of=(file, *trajectory.files), needs_file=True
    )
    require_modal_files(trajectory)
    system = spectra.known_system(trajectory)
    bodies: dict[str, ReducedBody | RigidBody] = {**bodies_of(trajectory, system)}
    if system is not None:  # boxes with the inertia of rigid bodies, instead of cubes
        bodies |= {body.name: body for body in system.bodies if isinstance(body, RigidBody)}
    with stages(remaining=True) as clock, clock("film") as advance:
        animate(
            trajectory, bodies, path, fps=fps, speed=speed, magnification=magnification, color=BODY_COLORS[color],
            system=system, on_frame=lambda done, all_: advance(done / all_),
        )  # fmt: skip
    say_written(path)


register(
    app,
    {
        "Start": {"demo": demo_command, "example": prepare.example_command, "check": analyses.check_command},
        "Compute": {
            "run": run_command,
            "resume": resume_command,
            "static": analyses.static_command,
            "modes": analyses.modes_command,
            "campbell": analyses.campbell_command,
            "response": linear.response_command,
            "linearize": linear.linearize_command,
            "kinematics": driven.kinematics_command,
            "inverse": driven.inverse_command,
        },
        "Look": {
            "info": info_command,
            "plot": plot_command,
            "animate": animate_command,
            "view": view.view_command,
            "spectrum": spectra.spectrum_command,
            "show": show_command,
        },
        "Vary": {
            "sweep": studies.sweep_command,
            "optimize": fits.optimize_command,
            "compare": studies.compare_command,
            "gradient": studies.gradient_command,
        },
        "Assess": {
            "shake": durability.shake_command,
            "fatigue": durability.fatigue_command,
            "identify": fits.identify_command,
        },
        "Exchange": {
            "import": exchange.import_command,
            "export": export.export_command,
        },
        "Setup": {
            "prepare": prepare.prepare_command,
            "schema": schema_command_of("floatframe"),
        },
    },
)
