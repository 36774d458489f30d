"""The commands of the linearised system with inputs and outputs: linearize, response."""

import math
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cms.cli.arguments import SetValues
from cms.cli.console import guarded, print_table, say, say_written
from cms.cli.outputs import PICTURES, TABLES, output_file, write_outputs
from floatframe.cli.analyses import Axis, Center, Formulation, Speed, SystemArgument, linearized, read_in_formulation

if TYPE_CHECKING:
    from floatframe.analyses.linear.frequency_response import FrequencyResponse
    from floatframe.analyses.linear.linearization import LinearSystem

__all__ = ["linearize_command", "response_command"]

MOST_LEFT_OUT = 6  #: largest number of omitted columns that are listed individually

Inputs = Annotated[
    list[str],
    typer.Option(
        "--input", "-i", help="A name of [inputs], a force (motor.torque), joint.angle, body/interface:x; repeatable."
    ),
]
Outputs = Annotated[
    list[str],
    typer.Option("--out", help="A name of [outputs] or [sensors], sensor.column, or as --input; repeatable."),
]


@guarded
def linearize_command(
    system: SystemArgument,
    inputs: Inputs = [],  # noqa: B006
    outputs: Outputs = [],  # noqa: B006
    output: Annotated[Path | None, typer.Option("--output", "-o", help="File to write: .npz, .mat or .h5.")] = None,
    speed: Speed = 0.0,
    axis: Axis = "z",
    center: Center = "0,0,0",
    formulation: Formulation = None,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """State space A, B, C, D and M, C, K of the linearised system.

    The file names states, inputs and outputs; M, C, K are those of the independent motions.

    Inputs and outputs are those of the tables [inputs] and [outputs] of the system, unless named here: sensors by name,
    or one of their columns as sensor.column; a point as body/interface:component, with x, y, z, rx, ry, rz. With
    --formulation relative, the motions are joint coordinates and modes, without those that close loops. Without -o,
    crane.toml gives crane.npz.

    Example: floatframe linearize crane.toml -o crane.mat

    Example: floatframe linearize crane.toml --input jib/tip:z --out jib/tip:z
    """
    from floatframe.analyses.linear.state_space import WRITERS, write_state_space
    from floatframe.errors import ModelError

    model, form = read_in_formulation(system, formulation, set_values)
    read = (system, *model.files)
    path = output_file(output, system.with_suffix(".npz"), tuple(WRITERS), ModelError, overwrite_of=read)
    linear = linearized(
        model,
        speed,
        axis,
        center,
        inputs=inputs or None,
        outputs=outputs or None,
        formulation=form,
    )
    space = write_state_space(linear, path)
    print_left_out(linear)
    say(f"{linear.n_z} independent motions, {len(space.A)} states, {len(linear.inputs)} inputs, "
        f"{len(linear.outputs)} outputs")  # fmt: skip
    if not linear.inputs or not linear.outputs:
        say("name inputs and outputs in tables [inputs.NAME] and [outputs.NAME], or with --input and --out")
    say(f"states: {', '.join(space.states[: len(space.states) // 2])}, and their rates")
    say_written(path)


@guarded
def response_command(
    system: SystemArgument,
    band: Annotated[str, typer.Option(help='Frequencies "from:to" in Hz; default: around all modes.')] = "",
    inputs: Inputs = [],  # noqa: B006
    outputs: Outputs = [],  # noqa: B006
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="Picture (.png, .svg, .pdf) or table (.csv, ...).")
    ] = None,
    points: Annotated[int, typer.Option(min=2, help="Frequencies, besides those around resonances.")] = 400,
    speed: Speed = 0.0,
    axis: Axis = "z",
    center: Center = "0,0,0",
    formulation: Formulation = None,
    set_values: SetValues = [],  # noqa: B006
) -> None:
    """Frequency responses (Bode plots).

    They are those about the equilibrium, or about a steady rotation with --speed.

    Inputs and outputs as for linearize. Without -o, crane.toml gives crane.response.png.

    Example: floatframe response crane.toml --band 0.1:100

    Example: floatframe response crane.toml --input jib/tip:z --out jib/tip:z -o frf.csv
    """
    from floatframe.analyses.linear.frequency_response import frequency_response, resolved_frequencies
    from floatframe.errors import ModelError

    model, form = read_in_formulation(system, formulation, set_values)
    default, read = system.with_suffix(".response.png"), (system, *model.files)
    path = output_file(output, default, (*PICTURES, *TABLES), ModelError, overwrite_of=read)
    linear = linearized(
        model,
        speed,
        axis,
        center,
        inputs=inputs or None,
        outputs=outputs or None,
        formulation=form,
    )
    print_left_out(linear)
    seconds = model.units.time
    first, last = band_of(band, linear, seconds)
    response = frequency_response(linear, resolved_frequencies(linear, first * seconds, last * seconds, n=points))
    print_peaks(response, seconds)
    write_outputs(
        [path], table=lambda: response.to_table(seconds),
        figure=lambda: response.plot(time_unit=seconds),
    )  # fmt: skip


def print_left_out(linear: "LinearSystem") -> None:
    """Print the columns of sensors that are not linear about the steady motion."""
    for name, why in list(linear.left_out.items())[:MOST_LEFT_OUT]:
        say(f"omitted: {name}, not linear here: {why}")
    if len(linear.left_out) > MOST_LEFT_OUT:
        say(f"and {len(linear.left_out) - MOST_LEFT_OUT} more columns that are not linear here")


def band_of(text: str, linear: "LinearSystem", seconds: float) -> tuple[float, float]:
    """Return a band "from:to" in Hz; by default from a third of the lowest to three times the highest mode."""
    from fe_models.foundation.words import shortened
    from floatframe.analyses.linear.system_modes import system_modes
    from floatframe.errors import ModelError

    if not text:
        f = system_modes(linear).natural_frequencies / seconds
        f = f[f > 0]
        return (float(f.min()) / 3, float(f.max()) * 3) if len(f) else (0.1, 10.0)
    try:
        first, last = (float(part) for part in text.split(":"))
        if not 0 < first < last < math.inf:
            raise ValueError
    except ValueError:
        raise ModelError(
            f'--band {shortened(text)}: expected "from:to" in Hz, an ascending band above 0, such as 1:500'
        ) from None
    return first, last


def print_peaks(response: "FrequencyResponse", seconds: float) -> None:
    """Print the largest amplitude of each response and its frequency."""
    rows = []
    for o, out in enumerate(response.outputs):
        for i, name in enumerate(response.inputs):
            size = response.amplitudes[:, o, i]
            k = int(size.argmax())
            rows.append((f"{out} / {name}", response.units[o][i], f"{size[0]:.4g}", f"{size[k]:.4g}",
                         f"{response.frequencies[k] / seconds:.6g}"))  # fmt: skip
    low = response.frequencies[0] / seconds
    print_table("Responses", ("output / input", "unit", f"at {low:.3g} Hz>", "greatest>", "at Hz>"), rows)
