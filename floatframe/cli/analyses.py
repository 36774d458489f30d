"""The commands that analyse a system without a motion: static, modes, campbell."""

import json as json_module
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cms.cli.arguments import SetValues, changes_of
from cms.cli.console import guarded, output_path, print_table, say, say_written, stages, vector_words
from cms.cli.outputs import PICTURES, TABLES, output_file, output_files, write_outputs

if TYPE_CHECKING:
    from floatframe.analyses.linear.linearization import LinearSystem
    from floatframe.analyses.linear.parameter_study import Locus
    from floatframe.analyses.linear.system_modes import SystemModes
    from floatframe.analyses.snapshot import Equilibrium
    from floatframe.model.system import System
    from floatframe.pictures.body_colors import BodyColor

__all__ = ["campbell_command", "check_command", "modes_command", "static_command"]

MOST_SPEEDS = 10_000
GREATEST_SPEED = 1e100

SystemArgument = Annotated[Path, typer.Argument(help="System file (TOML), see docs/system_file.md.")]
Json = Annotated[bool, typer.Option("--json", help="Write the same record as JSON, for other programs.")]
Speed = Annotated[float, typer.Option(help="Speed of a steady rotation of the whole system [rad/time unit].")]
Axis = Annotated[str, typer.Option(help='Axis of the rotation in ground axes: x, y, z or "0.6,0,0.8".')]
Center = Annotated[str, typer.Option(help='A point of the axis: "x,y,z".')]
Formulation = Annotated[
    str | None,
    typer.Option("--formulation", help="absolute or relative (joint) coordinates; default: as in [run], or absolute."),
]
Modes = Annotated[int, typer.Option("--modes", "-n", help="How many modes, by ascending frequency.")]


@guarded
def check_command(
    system: SystemArgument,
    json: Json = False,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Check a system before its run.

    Reported are mobility and redundant constraints, placement, vibrations at the start and the step sizes that resolve
    them, functions of time that the steps do not resolve, modes and stiffening of flexible bodies. Exit code 0: the
    run can begin (warnings are printed), 1: it would be refused, 2: the file cannot be read.

    Example: floatframe check crane.toml
    """
    from cms.assessment.quality.record import has_failed, worst
    from cms.cli.verdicts.check import print_records
    from floatframe.analyses.system_check import check_system
    from floatframe.files.system_file.read_system import read_system
    from floatframe.integrators.registry import has_fixed_steps

    model, run = read_system(system, changes_of(set_values))
    tell_left_out(model)
    if run is None:
        records = check_system(model)
    else:
        fixed = has_fixed_steps(run.integrator)
        records = check_system(model, t_end=run.t_end, h=run.h, state=run.start_state(model), has_fixed_steps=fixed)
    if json:
        record = {"system": model.name, "verdict": worst(records), "records": [each.as_dict() for each in records]}
        typer.echo(json_module.dumps(record, indent=2))
    else:
        print_records(f"Check of {model.name}", model.name, records)
    raise typer.Exit(int(has_failed(records)))


@guarded
def static_command(
    system: SystemArgument,
    formulation: Formulation = None,
    json: Json = False,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Equilibrium at rest: positions, reactions, stability.

    Example: floatframe static crane.toml
    """
    from floatframe.analyses.equilibrium import static_equilibrium
    from floatframe.analyses.linear.linearization import linearize
    from floatframe.analyses.linear.system_modes import system_modes
    from floatframe.engine.compiling.system import compiled_system
    from floatframe.errors import ModelError

    model, form = read_in_formulation(system, formulation, set_values)
    rest = static_equilibrium(model, formulation=form)
    try:
        is_stable = system_modes(linearize(model, rest, formulation=form)).is_stable
    except ModelError:  # there are no degrees of freedom
        is_stable = True
    record = equilibrium_record(model, rest) | {"is_stable": is_stable}
    if json:
        typer.echo(json_module.dumps(record, indent=2))
        return
    units = model.units
    print_table(
        "Equilibrium",
        ("body", f"origin [{units.length_symbol}]", "rotation vector [rad]", "largest modal coordinate>"),
        [
            (
                b["name"],
                vector_words(b["position"], compiled_system(model).length),
                vector_words(b["rotation_vector"]),
                f"{b['largest_q']:.4g}",
            )
            for b in record["bodies"]
        ],
    )
    if record["reactions"]:
        force = max(abs(value) for r in record["reactions"] for value in r["force"])
        moment = max(
            force * compiled_system(model).length, *(abs(value) for r in record["reactions"] for value in r["moment"])
        )
        print_table(
            "Reactions on markers A, ground axes",
            (
                "joint or spring",
                f"force [{units.force_symbol}]",
                f"moment [{units.force_symbol} {units.length_symbol}]",
            ),
            [
                (r["name"], vector_words(r["force"], force), vector_words(r["moment"], moment))
                for r in record["reactions"]
            ],
        )
    if record["sensors"]:
        print_table(
            "Sensors",
            ("", "unit", "value>"),
            [(name, column["unit"], f"{column['value']:.6g}") for name, column in record["sensors"].items()],
        )
    say(f"{'stable' if is_stable else 'unstable: the smallest disturbance grows'}; forces out of balance by "
        f"{record['residual']:.1e} of those at work, {record['n_iterations']} iterations")  # fmt: skip


@guarded
def modes_command(
    system: SystemArgument,
    speed: Speed = 0.0,
    axis: Axis = "z",
    center: Center = "0,0,0",
    n_modes: Modes = 20,
    animate: Annotated[
        list[int], typer.Option("--animate", "-a", min=1, help="Make a film of this mode; repeatable.")
    ] = [],  # noqa: B006
    output: Annotated[
        Path | None,
        typer.Option("--output", "-o", help="Table (.csv, ...); with --animate film (.gif, .mp4) or picture (.png)."),
    ] = None,
    color: Annotated[str, typer.Option(help="Colour of the film: displacement or von-mises.")] = "displacement",
    formulation: Formulation = None,
    json: Json = False,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Vibration modes: frequency, damping, shape.

    The modes are those about the equilibrium, or about a steady rotation with --speed.

    With --animate 3 and without -o the film of mode 3 of crane.toml is crane.mode3.gif.

    Example: floatframe modes crane.toml -o modes.csv

    Example: floatframe modes crane.toml --animate 1 --animate 2

    Example: floatframe modes rotor.toml --speed 100 --axis z
    """
    from fe_models.foundation.words import nearest
    from floatframe.analyses.linear.system_modes import system_modes
    from floatframe.errors import ModelError
    from floatframe.pictures.body_colors import BODY_COLORS

    if color not in BODY_COLORS:
        raise ModelError(f"--color {color}: expected one of {', '.join(BODY_COLORS)}{nearest(color, BODY_COLORS)}")
    is_table = output is not None and output.suffix.lower() in TABLES
    if output is not None and not is_table and len(animate) != 1:
        raise ModelError(
            f"--output {output}: expected a table ({', '.join(TABLES)}), or --animate with the number of one mode, got "
            f"{len(animate)}"
        )
    model, form = read_in_formulation(system, formulation, set_values)
    inputs = (system, *model.files)
    tables = output_files([output] if is_table and output else None, [], TABLES, ModelError, overwrite_of=inputs)
    films = {k: output_path(None if is_table else output, system.with_suffix(f".mode{k}.gif"), ModelError,
                            overwrite_of=inputs, needs_file=True) for k in animate}  # fmt: skip
    linear = linearized(model, speed, axis, center, formulation=form)
    modes = system_modes(linear)
    per_second = 1 / model.units.time
    record: dict[str, Any] = {
        "system": model.name,
        "speed": speed,
        "is_stable": modes.is_stable,
        "modes": [
            {
                "number": k + 1,
                "frequency_hz": float(modes.frequencies[k] * per_second),
                "damping_ratio": float(modes.damping_ratios[k]),
                "eigenvalue": [float(value.real * per_second), float(value.imag * per_second)],
                "energy_shares": dict(zip(modes.bodies, map(float, modes.energy_shares[k]), strict=True)),
            }
            for k, value in enumerate(modes.eigenvalues[:n_modes])
        ],
    }
    if json:
        typer.echo(json_module.dumps(record, indent=2))
        films = {}
    else:
        print_table(
            f"Modes of {model.name}" + (f" at {speed:g} rad/{model.units.time_symbol}" if speed else ""),
            ("mode>", "Hz>", "damping>", "moves (share of the kinetic energy)"),
            [(m["number"], f"{m['frequency_hz']:.6g}", damping_words(m), moving_words(m)) for m in record["modes"]],
        )
        left = len(modes.eigenvalues) - len(record["modes"])
        say(f"{'stable' if modes.is_stable else 'unstable'}; {linear.n_z} independent motions"
            + (f", {left} more modes (--modes)" if left > 0 else ""))  # fmt: skip
    write_outputs(tables, table=lambda: modes.to_table(model.units.time), record=record, is_quiet=json)
    for k, path in films.items():
        draw_mode_film(model, linear.equilibrium, modes, k, path, BODY_COLORS[color])


@guarded
def campbell_command(
    system: SystemArgument,
    speeds: Annotated[str, typer.Option(help='Speeds "from:to:number" [rad/time unit].')],
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Picture (.png, .svg, .pdf) or table (.csv, ...).")
    ] = None,
    axis: Axis = "z",
    center: Center = "0,0,0",
    n_modes: Modes = 12,
    outputs: Annotated[
        list[str], typer.Option("--out", help="A name of [outputs] or [sensors], sensor.column; repeatable.")
    ] = [],  # noqa: B006
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Campbell diagram of a rotating system.

    It shows frequencies over the speed, with the steady values of outputs.

    Outputs are those of the table [outputs] of the system, unless named. Their steady values at the speeds, such as
    bearing forces, are printed, and written as columns of a table or as panels below the diagram.

    Example: floatframe campbell rotor.toml --speeds 0:200:21 --axis z -o rotor.png

    Example: floatframe campbell rotor.toml --speeds 0:200:21 --out bearing --out "tip.x" -o rotor.csv
    """
    from floatframe.analyses.linear.parameter_study import campbell
    from floatframe.analyses.linear.plots import campbell_figure
    from floatframe.errors import ModelError

    model, _ = read_in_formulation(system, None, set_values)
    inputs = (system, *model.files)
    path = output_file(output, system.with_suffix(".png"), (*PICTURES, *TABLES), ModelError, overwrite_of=inputs)
    values = speed_range(speeds)
    with stages() as clock, clock("modes over the speed") as advance:
        locus = campbell(
            model, values, axis=vector(axis, "--axis"), center=vector(center, "--center"), n_modes=n_modes,
            outputs=outputs or None, progress=lambda done, all_: advance(done / all_),
        )  # fmt: skip
    if locus.outputs:
        print_steady(locus, model.units.time_symbol)
    time = model.units.time
    write_outputs([path], table=lambda: locus.to_table(time), figure=lambda: campbell_figure(locus, time_unit=time))


def print_steady(locus: "Locus", time: str) -> None:
    """Print the steady values of outputs at the first and last speed, and the value of largest magnitude."""
    rows = []
    for name, unit, values in zip(locus.outputs, locus.output_units, locus.steady.T, strict=True):
        k = int(abs(values).argmax())
        rows.append((name, unit, *(f"{values[j]:.5g}" for j in (0, -1, k)), f"{locus.values[k]:.5g}"))
    first, last = f"{locus.values[0]:g}", f"{locus.values[-1]:g}"
    print_table(
        f"Outputs over the speed [rad/{time}]",
        ("output", "unit", f"at {first}>", f"at {last}>", "largest>", "at>"),
        rows,
    )


def draw_mode_film(
    model: "System", about: "Equilibrium", modes: "SystemModes", k: int, path: Path, color: "BodyColor"
) -> None:
    """Draw a mode into a film, or into a picture if the file name has the ending of one."""
    from floatframe.pictures.mode_film import animate_mode, draw_mode

    with stages(remaining=True) as clock, clock(f"film of mode {k}") as advance:
        if path.suffix.lower() == ".png":
            draw_mode(model, about, modes, k, path, color=color)
        else:
            animate_mode(model, about, modes, k, path, color=color, on_frame=lambda done, all_: advance(done / all_))
    say_written(path)


def read_in_formulation(path: Path, formulation: str | None, set_values: Sequence[str] = ()) -> "tuple[System, str]":
    """Return the system of a file with the values of --set, and its formulation: the option, [run], or absolute."""
    from floatframe.files.system_file.read_system import read_system
    from floatframe.files.system_file.run_section import formulation_of

    system, run = read_system(path, changes_of(set_values))
    tell_left_out(system)
    if system.fmus:
        names = ", ".join(unit.name for unit in system.fmus)
        typer.echo(f"note: units of other programs (fmus: {names}) act only in runs; they are ignored here", err=True)
    return system, formulation_of(run) if formulation is None else formulation


def tell_left_out(system: "System") -> None:
    """Report bodies whose geometric stiffness was omitted because it would have been very large."""
    from floatframe.model.bodies.flexible_body import FlexibleBody

    for body in system.bodies:
        if isinstance(body, FlexibleBody) and body.stiffening == "auto":
            if why := body.reduced.provenance.get("geometric stiffness"):
                typer.echo(f"note: body {body.name!r}: {why}", err=True)


def linearized(
    system: "System",
    speed: float,
    axis: str,
    center: str,
    *,
    inputs: Sequence[str] | None = (),
    outputs: Sequence[str] | None = (),
    formulation: str = "absolute",
) -> "LinearSystem":
    """Return the system linearised about rest, or about a steady rotation."""
    import numpy as np

    from floatframe.analyses.equilibrium import steady_rotation
    from floatframe.analyses.linear.linearization import linearize
    from floatframe.analyses.steady.turning_drives import turning_with
    from floatframe.model.checked_values import unit_vector

    omega = speed * np.asarray(unit_vector("--axis", vector(axis, "--axis")))
    system = turning_with(system, omega)
    about = steady_rotation(system, omega, center=vector(center, "--center"), formulation=formulation)
    return linearize(system, about, inputs=inputs, outputs=outputs, formulation=formulation)


def vector(text: str, where: str) -> tuple[float, float, float]:
    """Return three numbers from "x", "y", "z" or "a,b,c"."""
    from floatframe.errors import ModelError

    named = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0)}
    if text in named:
        return named[text]
    try:
        a, b, c = (float(part) for part in text.split(","))
    except ValueError:
        raise ModelError(f'{where} {text}: expected x, y, z or three numbers "a,b,c"') from None
    return a, b, c


def speed_range(text: str) -> Any:
    """Return speeds from "from:to:number"."""
    import numpy as np

    from fe_models.foundation.words import shortened
    from floatframe.errors import ModelError

    try:
        first, last, number = text.split(":")
        ends, n = (float(first), float(last)), int(number)
    except ValueError:
        ends, n = (0.0, 0.0), 0
    if not 1 <= n <= MOST_SPEEDS or not max(map(abs, ends)) <= GREATEST_SPEED:
        raise ModelError(
            f'--speeds {shortened(text)}: expected "from:to:number", such as 0:200:21, and up to {MOST_SPEEDS} speeds'
        )
    values = np.linspace(*ends, n)
    return values


def equilibrium_record(system: "System", rest: "Equilibrium") -> dict[str, Any]:
    """Return an equilibrium in plain types: positions of the bodies, reactions in ground axes, measurements."""
    import numpy as np

    from floatframe.analyses.snapshot import snapshot
    from floatframe.engine.compiling.system import compiled_system
    from floatframe.engine.kernels.model import ELEMENT
    from floatframe.model.rotations import rotation_log, rotation_matrix
    from floatframe.results.sensors import measured

    model, names = compiled_system(system).model, compiled_system(system).connection_names
    bodies = []
    for i, name in enumerate(compiled_system(system).body_names):
        q = rest.state.q[model.bodies.q0[i] : model.bodies.q0[i + 1]]
        bodies.append(
            {
                "name": name,
                "position": rest.state.r[i].tolist(),
                "rotation_vector": rotation_log(rotation_matrix(rest.state.p[i])).tolist(),
                "largest_q": float(np.abs(q).max(initial=0.0)),
                "q": q.tolist(),
            }
        )
    reactions = []
    for c, name in enumerate(names):
        if model.connections.law[c] == ELEMENT:  # the unknowns of an element are its own; sensors show them
            continue
        w = rest.w[model.connections.w0[c] : model.connections.w0[c + 1]]
        reactions.append(
            {"name": name, "force": w[:3].tolist(), "moment": (w[3:6] if len(w) >= 6 else np.zeros(3)).tolist()}
        )
    return {
        "system": system.name,
        "units": system.units.name,
        "bodies": bodies,
        "reactions": reactions,
        "sensors": {
            f"{found.sensor} {name}": {"unit": found.units[name], "value": float(values[0])}
            for found in measured(system, snapshot(system, rest)).values()
            for name, values in found.columns.items()
        },
        "residual": rest.residual,
        "n_iterations": rest.n_iterations,
    }


def damping_words(mode: dict[str, Any]) -> str:
    """Return the damping ratio of a mode in percent, or its behaviour if it does not oscillate."""
    ratio = mode["damping_ratio"]
    if ratio < -1e-9:
        return f"grows, {mode['eigenvalue'][0]:.4g} /s"
    if mode["frequency_hz"] == 0:
        return f"decays, {-mode['eigenvalue'][0]:.4g} /s" if ratio > 0 else ""
    return f"{100 * ratio:.3g} %" if ratio > 1e-9 else ""


def moving_words(mode: dict[str, Any]) -> str:
    """Return the bodies that carry the kinetic energy of a mode, as text."""
    shares = sorted(mode["energy_shares"].items(), key=lambda item: -item[1])
    return ", ".join(f"{name} {100 * share:.0f} %" for name, share in shares[:3] if share >= 0.005)
