"""The command `floatframe export`: motions and systems in the forms of other programs."""

import inspect
import json as json_module
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Annotated, Any

import typer

from cms.cli.console import guarded, output_path, print_table, say, say_written, stages
from cms.cli.outputs import TABLES, output_file, write_outputs

__all__ = ["TARGETS", "export_command"]

MOST_ROWS = 60  #: largest number of printed rows

MOTION, ROBOT = "Of a motion: csv, json, mat, npz, parquet, rpc, vtk", "Of a system: urdf"
UNIT, CODE = "Of a system: fmu, fmu-c", "Of a system: c, python, casadi, matlab; --parameter: fmu and fmu-c too"


@guarded
def export_command(
    context: typer.Context,
    file: Annotated[Path, typer.Argument(help="A results file (.h5) or a system file (.toml).")],
    to: Annotated[
        str | None,
        typer.Option(
            help="csv, json, mat, npz, parquet, rpc, vtk of a motion; urdf, fmu, fmu-c, c, python, casadi, matlab of a "
            "system; default: as -o ends.",
            autocompletion=lambda: list(TARGETS),
        ),
    ] = None,
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="File to write; for c, python, casadi and matlab a folder.")
    ] = None,
    sensors: Annotated[
        list[str],
        typer.Option(
            "--sensor",
            "-s",
            help="Only this sensor, sensor.column or joint.coordinate; * and ? are wild (not vtk).",
            rich_help_panel=MOTION,
        ),
    ] = [],  # noqa: B006
    every: Annotated[
        int | None,
        typer.Option(min=1, help="Use every n-th output time only (vtk).", rich_help_panel=MOTION),
    ] = None,
    effort: Annotated[
        float | None, typer.Option(help="Largest force or torque of joints with limits.", rich_help_panel=ROBOT)
    ] = None,
    velocity: Annotated[
        float | None, typer.Option(help="Largest speed of joints with limits.", rich_help_panel=ROBOT)
    ] = None,
    fmi: Annotated[int | None, typer.Option(help="Version of FMI, 2 (default) or 3.", rich_help_panel=UNIT)] = None,
    inputs: Annotated[
        list[str],
        typer.Option(
            "--input",
            "-i",
            help="forces.NAME.amplitude, joints.NAME.angle, a name of [inputs] (fmu); repeatable.",
            rich_help_panel=UNIT,
        ),
    ] = [],  # noqa: B006
    outputs: Annotated[
        list[str],
        typer.Option("--out", help="A sensor, or joint.coordinate (fmu); repeatable.", rich_help_panel=UNIT),
    ] = [],  # noqa: B006
    step: Annotated[
        float | None,
        typer.Option(help="Longest step in co-simulation (fmu-c) [s], default 1e-3.", rich_help_panel=UNIT),
    ] = None,
    parameters: Annotated[
        list[str],
        typer.Option(
            "--parameter",
            help="A number that can be changed: fmu: NAME=KEY.PATH; others: BODY/m, BODY (all ten), gravity, or a "
            "pattern; repeatable.",
            rich_help_panel=CODE,
        ),
    ] = [],  # noqa: B006
    what: Annotated[
        list[str],
        typer.Option(
            help="inverse (default), residual, mass, forward, kinematics, jacobian or sensitivity; repeatable.",
            rich_help_panel=CODE,
        ),
    ] = [],  # noqa: B006
    name: Annotated[
        str | None, typer.Option(help="Prefix of the functions; default: the system.", rich_help_panel=CODE)
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="List the written files as JSON, for other programs.", rich_help_panel=CODE)
    ] = False,
) -> None:
    """Write a motion or a system for other programs.

    Motions become tables of all sensors (csv, json, mat, npz, parquet), signals of a test rig (rpc: .rsp, .drv, .tim),
    or deformed surfaces with stress for ParaView (vtk: .pvd). Without -o, a table is written next to the results:
    swing.h5 gives swing.csv.

    Systems become a URDF robot (urdf), an FMU for co-simulation that needs Python with floatframe (fmu), and, if their
    bodies form a tree, an FMU of compiled C that needs nothing (fmu-c) or the equations as code (c, python, casadi,
    matlab). fmu-c is compiled by cc, or by the compiler in the environment variable CC. Inputs, outputs and parameters
    of an fmu are those of the table [fmu], unless named here.

    Example: floatframe export swing.h5 --sensor "wheel*" -o drive.rsp

    Example: floatframe export swing.h5 -o swing.pvd --every 10

    Example: floatframe export arm.toml -o arm.urdf --effort 100 --velocity 2

    Example: floatframe export arm.toml --to fmu --input forces.motor.motor --out hinge.angle --parameter
    m=bodies.arm.mass

    Example: floatframe export robot.toml --to c --what inverse --what mass -o robot_code
    """
    key = target_of(file, to, output)
    write = TARGETS[key].write
    options = {
        "sensors": sensors, "every": every, "effort": effort, "velocity": velocity, "fmi": fmi, "inputs": inputs,
        "outputs": outputs, "step": step, "parameters": parameters, "what": what, "name": name, "json": json,
    }  # fmt: skip
    given = {name: value for name, value in options.items() if not (value is None or value == [] or value is False)}
    require_options(key, given, {each.name: each.opts[0] for each in context.command.params if each.name in options})
    write(file, output, **given)


@dataclass(frozen=True)
class ExportTarget:
    """A form that `floatframe export` writes; the keyword arguments of `write` are its options."""

    write: Callable[..., None]
    endings: tuple[str, ...]  #: endings of its files; empty: it writes a folder
    reads: str  #: kind of file that it is made from


def target_of(file: Path, to: str | None, output: Path | None) -> str:
    """Return the name of the target: `to`, or the one whose files end as the output does.

    Raises
    ------
    ModelError
        If there is no such target, it is not made from such a file, or the output name does not determine it.
    """
    from fe_models.foundation.words import nearest
    from floatframe.errors import ModelError
    from floatframe.results.trajectory import read_trajectory

    given = SYSTEM if file.suffix.lower() == ".toml" else RESULTS
    fitting = {key: each for key, each in TARGETS.items() if each.reads == given}
    if to is None:
        if given == RESULTS and output is None:
            return "csv"
        ending = "" if output is None else output.suffix.lower()
        for key, each in fitting.items():
            if ending in each.endings:
                return key
        if output is not None:
            read = (file, *read_trajectory(file).files) if given == RESULTS else (file,)
            output_path(output, None, ModelError, overwrite_of=read)
        endings = ", ".join(dict.fromkeys(ending for each in fitting.values() for ending in each.endings))
        raise ModelError(
            f"{'--to: missing' if output is None else f'--output {output}'}: expected --to with one of "
            f"{', '.join(fitting)}, or a file name that ends in {endings}"
        )
    if to not in TARGETS:
        raise ModelError(f"--to {to}: unknown target{nearest(to, TARGETS)}")
    if to not in fitting:
        made = f"floatframe run {file} writes one" if given == SYSTEM else f"expected one of {', '.join(fitting)}"
        raise ModelError(f"--to {to}: needs {TARGETS[to].reads}, got {given} {file}; {made}")
    return to


def require_options(key: str, given: Iterable[str], flags: Mapping[str, str]) -> None:
    """Reject options that belong to other targets.

    Raises
    ------
    ModelError
        If there is one.
    """
    from floatframe.errors import ModelError

    known = {name: inspect.signature(each.write).parameters for name, each in TARGETS.items()}
    for option in given:
        if option not in known[key]:
            owners = ", ".join(name for name in TARGETS if option in known[name])
            has = ", ".join(flags[name] for name in known[key] if name in flags)
            raise ModelError(f"{flags[option]}: belongs to --to {owners}; --to {key} has {has}")


# targets made of a motion ---------------------------------------------------------------------------------------------


def write_table(file: Path, output: Path | None, ending: str, *, sensors: Sequence[str] = ()) -> None:
    """Write all columns of a motion as a table, or those of some sensors."""
    from floatframe.cli.spectra import known_system
    from floatframe.errors import ResultsError
    from floatframe.pictures.animation import bodies_of
    from floatframe.results.export import motion_table, sensor_table
    from floatframe.results.sensor_choice import chosen_measurements
    from floatframe.results.trajectory import read_trajectory

    trajectory = read_trajectory(file)
    path = output_file(
        output, file.with_suffix(ending), (ending,), ResultsError, overwrite_of=(file, *trajectory.files)
    )
    system = known_system(trajectory)
    if sensors and system is None:
        raise ResultsError(
            "--sensor: the system file of the run does not exist any more, or the run was made in Python"
        )
    if system is None or not sensors:
        bodies = bodies_of(trajectory, system)
        write_outputs([path], table=lambda: motion_table(trajectory, bodies, system))
    else:
        write_outputs([path], table=lambda: sensor_table(trajectory, chosen_measurements(system, trajectory, sensors)))


def write_signals(file: Path, output: Path | None, *, sensors: Sequence[str] = ()) -> None:
    """Write the sensors of a motion as signals of a test rig."""
    from floatframe.cli.spectra import sensor_signals
    from floatframe.errors import ResultsError
    from floatframe.files.signals.rpc_file import write_rpc
    from floatframe.results.trajectory import read_trajectory

    trajectory = read_trajectory(file)
    path = output_file(
        output, file.with_suffix(SIGNALS[0]), SIGNALS, ResultsError, overwrite_of=(file, *trajectory.files)
    )
    write_rpc(sensor_signals(trajectory, [*sensors]), path)
    say_written(path)


def write_surfaces(file: Path, output: Path | None, *, every: int = 1) -> None:
    """Write the deformed surfaces of a motion, with their stress, for ParaView."""
    from floatframe.cli.spectra import known_system
    from floatframe.errors import ResultsError
    from floatframe.pictures.animation import bodies_of
    from floatframe.results.export import export_vtk
    from floatframe.results.trajectory import read_trajectory

    trajectory = read_trajectory(file)
    path = output_file(
        output, file.with_suffix(".pvd"), (".pvd",), ResultsError, overwrite_of=(file, *trajectory.files)
    )
    bodies = bodies_of(trajectory, known_system(trajectory))
    with stages(remaining=True) as clock, clock("surfaces") as advance:
        written = export_vtk(trajectory, bodies, path, every=every, on_frame=lambda done, all_: advance(done / all_))
    say(f"wrote {path} and {len(written) - 1} surfaces in {path.with_suffix('')}")


# targets made of a system ---------------------------------------------------------------------------------------------


def write_robot(file: Path, output: Path | None, *, effort: float | None = None, velocity: float | None = None) -> None:
    """Write a tree of rigid bodies as a URDF robot, with its surfaces; what URDF does not support is listed."""
    from floatframe.errors import UrdfError
    from floatframe.files.importers.robot import JointLimits
    from floatframe.files.importers.system_robot import robot_of_system, urdf_text
    from floatframe.files.system_file.read_system import read_system

    model, _ = read_system(file)
    path = output or file.with_suffix(".urdf")
    limits = {joint.name: JointLimits(effort=effort, velocity=velocity) for joint in model.joints}
    made = robot_of_system(model, limits=limits)
    files = {path: urdf_text(made.robot).encode(), **{path.parent / name: data for name, data in made.meshes.items()}}
    write_files(files, path, UrdfError, inputs=(file, *model.files))
    for note in made.notes:
        typer.echo(f"note: omitted: {note}", err=True)
    for each in files:
        say(f"wrote {each}")


def write_unit(
    file: Path, output: Path | None, *, fmi: int = 2, inputs: Sequence[str] = (), outputs: Sequence[str] = (),
    parameters: Sequence[str] = (),
) -> None:  # fmt: skip
    """Write a system as an FMU for co-simulation that runs it by Python."""
    from floatframe.engine.kernels.entry import prepare
    from floatframe.errors import ModelError
    from floatframe.files.cosimulation.archive import write_fmu

    path = output_file(output, file.with_suffix(".fmu"), (".fmu",), ModelError, overwrite_of=(file,))
    pairs = [text.partition("=") for text in parameters]
    for text, (name, equals, key) in zip(parameters, pairs, strict=True):
        if not (name and equals and key):
            raise ModelError(f"--parameter {text}: expected NAME=KEY.PATH, such as m=bodies.arm.mass")
    with stages() as clock:
        with clock("compiled code (made at first use)"):
            prepare()
        with clock("FMU"):
            written = write_fmu(
                file, path, fmi=fmi, inputs=inputs or None, outputs=outputs or None,
                parameters={name: key for name, _, key in pairs} or None,
            )  # fmt: skip
    print_variables(written.variables)
    say(f"FMI {fmi}.0 for {', '.join(written.platforms)}; it needs Python with floatframe where it runs")
    say_written(path)


def write_compiled_unit(
    file: Path, output: Path | None, *, fmi: int = 2, step: float = 1e-3, parameters: Sequence[str] = ()
) -> None:
    """Write a tree as an FMU of compiled C for model exchange and co-simulation."""
    from floatframe.design.generation.units.generated_unit import generate_fmu
    from floatframe.errors import ModelError
    from floatframe.files.system_file.read_system import read_system

    path = output_file(output, file.with_suffix(".fmu"), (".fmu",), ModelError, overwrite_of=(file,))
    described, run = read_system(file)
    stop = 1.0 if run is None else run.t_end * described.units.time
    made = generate_fmu(described, path, fmi=fmi, step=step, parameters=parameters, stop_time=stop)
    print_variables([each for each in made.variables if each.causality in ("input", "output", "parameter")])
    say(f"FMI {fmi}.0 for {made.platform}, model exchange and co-simulation; its sources are in it")
    say_written(path)


def print_variables(variables: Sequence[Any]) -> None:
    """Print the variables of an FMU."""
    rows = [(v.name, v.causality, v.unit, "" if v.causality == "output" else f"{v.start:g}") for v in variables]
    print_table("Variables", ("", "", "unit", "start>"), rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        say(f"and {len(rows) - MOST_ROWS} more")


def write_code(
    file: Path, output: Path | None, language: str, *, what: Sequence[str] = ("inverse",), name: str | None = None,
    parameters: Sequence[str] = (), json: bool = False,
) -> None:  # fmt: skip
    """Write the equations of a tree as code, which contains the numbers of the system."""
    from floatframe.design.generation.generate import generate
    from floatframe.errors import ModelError
    from floatframe.files.system_file.read_system import read_system

    folder = Path() if output is None else output
    described = read_system(file)[0]
    names = {each: None if name is None else f"{name}_{each}" for each in what}
    codes = [
        generate(described, what=each, language=language, parameters=parameters, name=names[each]) for each in names
    ]
    files = {folder / path: text.encode() for code in codes for path, text in code.files.items()}
    write_files(files, folder, ModelError, inputs=(file, *described.files))
    if json:
        record = {
            "files": [str(path) for path in files],
            "functions": {
                code.name: {
                    "what": code.what, **asdict(code.operations),
                    "general additions": code.general[0], "general multiplications": code.general[1],
                    "parameters": dict(zip(code.parameter_names, code.parameter_values.tolist(), strict=True)),
                }
                for code in codes
            },
        }  # fmt: skip
        typer.echo(json_module.dumps(record, indent=2, ensure_ascii=True))
        return
    print_table(
        "Operations of a call, and of the same recursion with all zeros and ones",
        ("function", "additions>", "multiplications>", "divisions>", "sines, cosines>", "general + >", "general * >"),
        [
            (code.name, *(str(n) for n in (
                code.operations.additions, code.operations.multiplications, code.operations.divisions,
                code.operations.functions, *code.general)))
            for code in codes
        ],
    )  # fmt: skip
    for path in files:
        say(f"wrote {path}")


def write_files(
    files: Mapping[Path, bytes], output: Path, error: type[Exception], *, inputs: Iterable[str | Path]
) -> None:
    """Write files and their folders; all files are complete, or none is written.

    Raises
    ------
    error
        If a file is one of the inputs, or cannot be written.
    """
    from fe_models.foundation.paths import replace_files, same_file

    for source in map(Path, inputs):
        if any(same_file(path, source) for path in files):
            raise error(f"--output {output}: would overwrite {source}, which is an input; choose another name")
    try:
        for path in files:
            path.parent.mkdir(parents=True, exist_ok=True)
        replace_files(files)
    except OSError as reason:
        raise error(f"--output {output}: cannot be written: {reason.strerror}") from reason


RESULTS, SYSTEM = "a results file (.h5)", "a system file (.toml)"
SIGNALS = (".rsp", ".drv", ".tim", ".rpc")

#: targets by name
TARGETS: dict[str, ExportTarget] = {
    **{each[1:]: ExportTarget(partial(write_table, ending=each), (each,), RESULTS) for each in TABLES},
    "rpc": ExportTarget(write_signals, SIGNALS, RESULTS),
    "vtk": ExportTarget(write_surfaces, (".pvd",), RESULTS),
    "urdf": ExportTarget(write_robot, (".urdf",), SYSTEM),
    "fmu": ExportTarget(write_unit, (".fmu",), SYSTEM),
    "fmu-c": ExportTarget(write_compiled_unit, (".fmu",), SYSTEM),
    **{
        each: ExportTarget(partial(write_code, language=each), (), SYSTEM)
        for each in ("c", "python", "casadi", "matlab")
    },
}
