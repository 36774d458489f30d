"""The commands that exchange a system with other programs: generate, robot, fmu."""

import json as json_module
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.console import guarded, print_table, say, stages
from cms.cli.outputs import output_file

if TYPE_CHECKING:
    from floatframe.files.importers.robot import Robot

__all__ = ["fmu_command", "generate_command", "import_command", "print_robot", "urdf_command"]


# the command generate: the equations of a system as code --------------------------------------------------------------


MOST_ROWS = 60  #: largest number of printed rows


@guarded
def generate_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML) of bodies in a tree.")],
    what: Annotated[
        list[str],
        typer.Option(
            "--what",
            help="inverse, residual, mass, forward, kinematics, jacobian or sensitivity; may be repeated.",
        ),
    ] = ["inverse"],  # noqa: B006
    language: Annotated[str, typer.Option("--language", help="c, python, casadi or matlab.")] = "c",
    parameters: Annotated[
        list[str],
        typer.Option(
            "--parameter",
            help="A number that stays a symbol: BODY/m, BODY (all ten), gravity, or a pattern; may be repeated.",
        ),
    ] = [],  # noqa: B006
    name: Annotated[str | None, typer.Option("--name", help="Prefix of the functions; default: the system.")] = None,
    output: Annotated[Path, typer.Option("--output", "-o", help="Folder to write.")] = Path(),
    json: Annotated[bool, typer.Option("--json", help="List the written files as JSON, for other programs.")] = False,
    fmu: Annotated[
        Path | None,
        typer.Option("--fmu", help="Write an FMU of compiled C instead, which needs nothing where it runs."),
    ] = None,
    fmi: Annotated[int, typer.Option("--fmi", help="With --fmu: version of FMI, 2 or 3.")] = 2,
    step: Annotated[float, typer.Option("--step", help="With --fmu: longest step in co-simulation [s].")] = 1e-3,
) -> None:
    """Write the equations of a system as code.

    The code holds its numbers; it computes forces, mass matrix, accelerations and derivatives.

    With --fmu, they become an FMU for model exchange and co-simulation: inputs are the forces along the joints, outputs
    are positions and rates. It is compiled by cc, or by the compiler in the environment variable CC.

    Example: floatframe generate robot.toml --what inverse --what mass --language c -o robot_code

    Example: floatframe generate robot.toml --fmu robot.fmu --fmi 3
    """
    from dataclasses import asdict

    from fe_models.foundation.paths import replace_files
    from floatframe.design.generation.generate import generate
    from floatframe.errors import ModelError
    from floatframe.files.system_file.read_system import read_system

    if fmu is not None:
        if (what, language, name, output, json) != (["inverse"], "c", None, Path(), False):
            raise ModelError("--fmu: writes forward dynamics in C; leave out --what, --language, --name, -o and --json")
        write_unit(system, fmu, fmi, step, parameters)
        return
    described = read_system(system)[0]
    names = {each: None if name is None else f"{name}_{each}" for each in what}
    codes = [
        generate(described, what=each, language=language, parameters=parameters, name=names[each]) for each in names
    ]
    files = {output / file: text.encode() for code in codes for file, text in code.files.items()}
    if any(path.resolve() == system.resolve() for path in files):
        raise ModelError(f"--output {output}: would overwrite {system}")
    try:
        output.mkdir(parents=True, exist_ok=True)
        replace_files(files)
    except OSError as error:
        raise ModelError(f"--output {output}: cannot be written: {error.strerror}") from error
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


def write_unit(system: Path, fmu: Path, fmi: int, step: float, parameters: list[str]) -> None:
    """Write a system as an FMU of generated C, and report its contents."""
    from floatframe.design.generation.units.generated_unit import generate_fmu
    from floatframe.files.system_file.read_system import read_system

    described, run = read_system(system)
    stop = 1.0 if run is None else run.t_end * described.units.time
    made = generate_fmu(described, fmu, fmi=fmi, step=step, parameters=parameters, stop_time=stop)
    shown = [each for each in made.variables if each.causality in ("input", "output", "parameter")]
    rows = [(each.name, each.causality, each.unit, f"{each.start:g}") for each in shown]
    print_table("Variables", ("", "", "unit", "start>"), rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        say(f"and {len(rows) - MOST_ROWS} more")
    say(f"FMI {fmi}.0 for {made.platform}, model exchange and co-simulation; its sources are in it")
    say(f"wrote {fmu} ({fmu.stat().st_size / 1e6:.2f} MB)")


# the commands import and urdf for robots, and the output of info for a robot ------------------------------------------


@guarded
def import_command(
    robot: Annotated[Path, typer.Argument(help="A description of a robot (.urdf).")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Folder to write; default: its name.")] = None,
    at: Annotated[list[str], typer.Option(help="JOINT=VALUE where it begins, rad or m; may be repeated.")] = [],  # noqa: B006
    free: Annotated[bool, typer.Option("--free", help="The root link moves freely; else it is the ground.")] = False,
    keep_fixed: Annotated[
        bool, typer.Option("--keep-fixed", help="Links fixed to each other stay bodies of their own.")
    ] = False,
    no_stops: Annotated[bool, typer.Option("--no-stops", help="Limits of joints do not act.")] = False,
    gravity: Annotated[float, typer.Option(help="Acceleration of free fall along -z, m/s².")] = 9.81,
    pictures: Annotated[str, typer.Option(help="What bodies look like: visual, collision or none.")] = "visual",
    package: Annotated[list[str], typer.Option(help="NAME=FOLDER of a package of meshes; may be repeated.")] = [],  # noqa: B006
    flexible: Annotated[
        list[str], typer.Option(help="LINK=FILE, a modal file in the place of a link; may be repeated.")
    ] = [],  # noqa: B006
    interface: Annotated[
        list[str], typer.Option(help="LINK.JOINT=NAME, the interface of a flexible link at a joint; may be repeated.")
    ] = [],  # noqa: B006
) -> None:
    """Read a robot (URDF, MJCF) as a system file.

    Its surfaces and modal files are written next to it.

    Example: floatframe import arm.urdf -o arm --at elbow=0.5
    """
    from floatframe.errors import UrdfError
    from floatframe.files.importers.read_urdf import read_urdf
    from floatframe.files.importers.robot_system import FlexibleLink, robot_system
    from floatframe.files.importers.system_tables import write_system

    found = read_urdf(robot)
    placed = {}
    for name, text in pairs("--at", at).items():
        try:
            placed[name] = float(text)
        except ValueError:
            raise UrdfError(f"--at {name}={text}: expected a number") from None
    interfaces: dict[str, dict[str, str]] = {}
    for words, name in pairs("--interface", interface).items():
        link, _, joint = words.partition(".")
        interfaces.setdefault(link, {})[joint] = name
    links = {
        link: FlexibleLink(Path(file), interfaces.pop(link, {})) for link, file in pairs("--flexible", flexible).items()
    }
    if interfaces:
        raise UrdfError(f"--interface: {', '.join(interfaces)}: not flexible; name its modal file by --flexible")
    made = robot_system(
        found, configuration=placed, is_free=free, gravity=(0.0, 0.0, -gravity), flexible=links,
        merge_fixed=not keep_fixed, stops=not no_stops, pictures=pictures,
        packages={name: Path(path) for name, path in pairs("--package", package).items()},
    )  # fmt: skip
    for note in found.notes:
        typer.echo(f"note: {note}", err=True)
    folder = output or Path(found.name)
    for path in write_system(made, folder):
        say(f"wrote {path}")


def pairs(option: str, given: list[str]) -> dict[str, str]:
    """Return NAME=VALUE options by name."""
    from floatframe.errors import UrdfError

    found = {}
    for words in given:
        name, sign, value = words.partition("=")
        if not (name and sign and value):
            raise UrdfError(f"{option} {words}: expected NAME=VALUE")
        found[name] = value
    return found


@guarded
def urdf_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML) of rigid bodies in a tree.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="URDF file to write.")] = None,
    effort: Annotated[float | None, typer.Option(help="Largest force or torque of joints with limits.")] = None,
    velocity: Annotated[float | None, typer.Option(help="Largest speed of joints with limits.")] = None,
) -> None:
    """Write a system as a URDF robot.

    Its surfaces are written next to it; features that URDF does not support are listed.

    Stops become limits, for which URDF also requires effort and velocity.

    Example: floatframe urdf arm.toml -o arm.urdf --effort 100 --velocity 2
    """
    from fe_models.foundation.paths import replace_files
    from floatframe.errors import UrdfError
    from floatframe.files.importers.robot import JointLimits
    from floatframe.files.importers.system_robot import robot_of_system, urdf_text
    from floatframe.files.system_file.read_system import read_system

    model, _ = read_system(system)
    path = output or system.with_suffix(".urdf")
    limits = {joint.name: JointLimits(effort=effort, velocity=velocity) for joint in model.joints}
    made = robot_of_system(model, limits=limits)
    files = {path: urdf_text(made.robot).encode(), **{path.parent / name: data for name, data in made.meshes.items()}}
    try:
        for each in files:
            each.parent.mkdir(parents=True, exist_ok=True)
        replace_files(files)
    except OSError as error:
        raise UrdfError(f"{path}: cannot be written: {error.strerror}") from error
    for note in made.notes:
        typer.echo(f"note: left out: {note}", err=True)
    for each in files:
        say(f"wrote {each}")


def print_robot(path: Path, *, as_json: bool) -> None:
    """Print links and joints of a robot."""
    from floatframe.files.importers.read_urdf import read_urdf

    robot = read_urdf(path)
    record = robot_record(robot)
    if as_json:
        import json as json_module

        typer.echo(json_module.dumps(record, indent=2, ensure_ascii=True))
        return
    print_table(
        "Robot",
        ("", ""),
        [
            ("name", robot.name),
            ("links", f"{len(robot.links)}, root {robot.root}"),
            ("joints", f"{len(robot.joints)}, {record['freedoms']} ways to move"),
            ("mass", f"{record['mass']:.6g} kg"),
            *(("note", note) for note in robot.notes),
        ],
    )
    print_table(
        "Links",
        ("link", "mass [kg]>", "principal moments [kg m²]", "pictures"),
        [
            (each["name"], f"{each['mass']:.6g}", ", ".join(f"{x:.4g}" for x in each["moments"]) or "none",
             ", ".join(each["pictures"]) or "none")
            for each in record["links"]
        ],
    )  # fmt: skip
    print_table(
        "Joints",
        ("joint", "type", "from", "to", "limits", "effort>", "velocity>", "follows"),
        [
            (
                each["name"], each["type"], each["parent"], each["child"],
                "" if each["lower"] is None else f"{each['lower']:.4g} to {each['upper']:.4g}",
                "" if each["effort"] is None else f"{each['effort']:.4g}",
                "" if each["velocity"] is None else f"{each['velocity']:.4g}", each["follows"] or "",
            )
            for each in record["joints"]
        ],
    )  # fmt: skip


def robot_record(robot: "Robot") -> dict[str, Any]:
    """Return the record of a robot for `info`; moments of inertia that no body can have are marked by a note."""
    import numpy as np

    from floatframe.files.importers.robot import MeshFile

    freedoms = {"fixed": 0, "planar": 3, "floating": 6}
    links = []
    for link in robot.links:
        tensor = None if link.inertial is None else link.inertial.tensor
        moments = [] if tensor is None else np.linalg.eigvalsh(tensor).tolist()
        pictures = [
            each.geometry.file if isinstance(each.geometry, MeshFile) else type(each.geometry).__name__.lower()
            for each in link.visuals
        ]
        links.append({"name": link.name, "mass": link.mass, "moments": moments, "pictures": pictures})
    return {
        "name": robot.name,
        "root": robot.root,
        "mass": sum(link.mass for link in robot.links),
        "freedoms": sum(freedoms.get(joint.type, 1) for joint in robot.joints if joint.mimic is None),
        "links": links,
        "joints": [
            {
                "name": joint.name, "type": joint.type, "parent": joint.parent, "child": joint.child,
                "lower": joint.limits.lower, "upper": joint.limits.upper, "effort": joint.limits.effort,
                "velocity": joint.limits.velocity, "follows": joint.mimic.joint if joint.mimic else None,
            }
            for joint in robot.joints
        ],
        "notes": list(robot.notes),
    }  # fmt: skip


# the command fmu: a system as an FMU for other programs ---------------------------------------------------------------


@guarded
def fmu_command(
    system: Annotated[Path, typer.Argument(help="System file (TOML), see docs/system_file.md.")],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="FMU to write.")] = None,
    fmi: Annotated[int, typer.Option("--fmi", help="Version of FMI, 2 or 3.")] = 2,
    inputs: Annotated[
        list[str], typer.Option("--input", "-i", help="forces.NAME.amplitude, joints.NAME.angle, a name of [inputs].")
    ] = [],  # noqa: B006
    outputs: Annotated[list[str], typer.Option("--out", "-m", help="A sensor, or joint.coordinate; repeatable.")] = [],  # noqa: B006
    parameters: Annotated[
        list[str], typer.Option("--parameter", "-p", help="NAME=KEY.PATH of a number in the file; repeatable.")
    ] = [],  # noqa: B006
) -> None:
    """Write a system as an FMU for co-simulation.

    Without -o, arm.toml gives arm.fmu. Inputs, outputs and parameters are those of the table [fmu], unless named here.
    Without both, they are the tables [inputs.NAME], constant forces and drives; all sensors; all numbers of bodies and
    forces. The FMU needs Python with floatframe on the machine where it runs.

    Example: floatframe fmu arm.toml -o arm.fmu --fmi 3

    Example: floatframe fmu arm.toml --input forces.motor.motor --out hinge.angle --parameter m=bodies.arm.mass
    """
    from floatframe.engine.kernels.entry import prepare
    from floatframe.errors import ModelError
    from floatframe.files.cosimulation.archive import write_fmu

    path = output_file(output, system.with_suffix(".fmu"), (".fmu",), ModelError, overwrite_of=(system,))
    pairs = [text.partition("=") for text in parameters]
    for text, (name, equals, key) in zip(parameters, pairs, strict=True):
        if not (name and equals and key):
            raise ModelError(f"--parameter {text}: expected NAME=KEY.PATH, such as m=bodies.arm.mass")
    with stages() as clock:
        with clock("compiled code (made at first use)"):
            prepare()
        with clock("FMU"):
            written = write_fmu(
                system, path, fmi=fmi, inputs=inputs or None, outputs=outputs or None,
                parameters={name: key for name, _, key in pairs} or None,
            )  # fmt: skip
    rows = [(v.name, v.causality, v.unit, f"{v.start:g}" if v.causality != "output" else "") for v in written.variables]
    print_table("Variables", ("", "", "unit", "start>"), rows[:MOST_ROWS])
    if len(rows) > MOST_ROWS:
        say(f"and {len(rows) - MOST_ROWS} more")
    say(f"FMI {fmi}.0 for {', '.join(written.platforms)}; it needs Python with floatframe where it runs")
    say(f"wrote {path} ({path.stat().st_size / 1e6:.2f} MB)")
