"""The command view, which writes pages."""

from pathlib import Path
from typing import Annotated

import typer

from cms.cli.console import guarded, say, say_written, stages
from cms.cli.outputs import output_file
from floatframe.cli.analyses import Axis, Center, Speed, linearized, read_in_formulation

__all__ = ["view_command"]


@guarded
def view_command(
    file: Annotated[
        Path, typer.Argument(help="A results file (.h5): its motion. A system file (.toml): its modes, or with --rest.")
    ],
    output: Annotated[Path | None, typer.Option("--output", "-o", help="Page to write (.html).")] = None,
    sensors: Annotated[
        list[str],
        typer.Option("--sensor", "-s", help="Plot this sensor, sensor.column or joint.coordinate; * and ? are wild."),
    ] = [],  # noqa: B006
    color: Annotated[str, typer.Option(help="Colour at first: displacement or von-mises.")] = "displacement",
    magnification: Annotated[
        float | None, typer.Option(help="Initial magnification of deformation; default: automatic.")
    ] = None,
    largest: Annotated[float, typer.Option("--largest", help="Size limit of the page [MB].")] = 10.0,
    rest: Annotated[bool, typer.Option("--rest", help="For a system file: only its equilibrium.")] = False,
    n_modes: Annotated[int, typer.Option("--modes", "-n", min=1, help="How many modes, by frequency.")] = 20,
    speed: Speed = 0.0,
    axis: Axis = "z",
    center: Center = "0,0,0",
) -> None:
    """3D page of a motion, modes or an equilibrium.

    The view can be turned while it plays. The page needs no network.

    The page opens in every browser, also on a phone. It shows the machine in 3D with slider, speed, colours by
    displacement or stress, named views, and plots. Without -o, it is written next to the file: swing.h5 gives
    swing.html.

    Example: floatframe view swing.h5 -o motion.html

    Example: floatframe view swing.h5 --sensor "wheel*" --color von-mises

    Example: floatframe view crane.toml -o modes.html
    """
    from floatframe.errors import ModelError, ResultsError
    from floatframe.pictures.viewer.modes_view import view_modes
    from floatframe.pictures.viewer.motion_view import require_color, view
    from floatframe.results.trajectory import read_trajectory

    require_color(color)
    if file.suffix.lower() in (".npz", ".mat"):
        raise ResultsError(f"{file}: a state space contains no bodies; give the system file from which it was made")
    is_system = file.suffix.lower() == ".toml"
    if rest and not is_system:
        raise ResultsError(f"--rest: {file} is a motion; the equilibrium is that of a system file (.toml)")
    if is_system:
        from floatframe.analyses.linear.system_modes import system_modes

        if sensors:
            raise ResultsError(f"--sensor: plots are those of a motion; expected results (.h5), got {file}")
        model, _ = read_in_formulation(file, None)
        path = page_path(output, file, (file, *model.files))
        with stages(remaining=True) as clock, clock("page"):
            linear = linearized(model, speed, axis, center)
            if rest:
                page = view(linear.equilibrium, path, system=model, color=color, largest=largest,
                            magnification=magnification)  # fmt: skip
            else:
                if magnification is not None:
                    raise ModelError("--magnification: amplitude of a mode is arbitrary; choose it in the page")
                page = view_modes(model, linear.equilibrium, system_modes(linear), path, n_modes=n_modes, color=color,
                                  largest=largest)  # fmt: skip
    else:
        trajectory = read_trajectory(file)
        path = page_path(output, file, (file, *trajectory.files))
        with stages(remaining=True) as clock, clock("page"):
            page = view(trajectory, path, sensors=sensors, color=color, magnification=magnification, largest=largest)
    for note in page.notes:
        say(note)
    say_written(page.path, page.size)


def page_path(output: Path | None, file: Path, inputs: tuple[Path | str, ...]) -> Path:
    """Return the path of the page."""
    from floatframe.errors import ResultsError

    return output_file(output, file.with_suffix(".html"), (".html", ".htm"), ResultsError, overwrite_of=inputs)
