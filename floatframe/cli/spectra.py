"""Spectra of sensors and of measured files, as pictures and tables: the commands spectrum and plot --as."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cms.cli.console import guarded, print_table
from cms.cli.outputs import PICTURES, TABLES, output_file, write_outputs

if TYPE_CHECKING:
    from floatframe.files.signals.analysis import SpectrumRequest
    from floatframe.files.signals.signals import Signal, Signals
    from floatframe.model.system import System
    from floatframe.results.trajectory import Trajectory

__all__ = ["plot_as", "sensor_signals", "spectrum_command"]

ENDINGS = (*TABLES, *PICTURES)
MOST_ROWS = 40  #: largest number of printed rows


@guarded
def spectrum_command(
    file: Annotated[Path, typer.Argument(help="A results file (.h5), or measured signals (.csv, .mat, .rsp, ...).")],
    sensors: Annotated[
        list[str],
        typer.Option("--sensor", "-s", help="Sensor, sensor.column, joint.coordinate or channel; * and ? are wild."),
    ] = [],  # noqa: B006
    kind: Annotated[
        str,
        typer.Option("--as", help="psd, amplitude, octave, third-octave, orders, waterfall or response."),
    ] = "psd",
    output: Annotated[
        Path | None, typer.Option("--output", "-o", help="A table (.csv, .json, ...) or a picture (.png, ...).")
    ] = None,
    resolution: Annotated[float | None, typer.Option(help="Distance of lines in Hz; of orders: in orders.")] = None,
    window: Annotated[
        str, typer.Option(help="hann, flattop, rectangular, hamming, blackman, blackman-harris.")
    ] = "hann",
    rms: Annotated[bool, typer.Option("--rms", help="Amplitudes as rms; default: peak.")] = False,
    rotation: Annotated[str, typer.Option(help="Channel with angle or speed of the rotation, for orders.")] = "",
    max_order: Annotated[float, typer.Option(min=0.1, help="Highest order.")] = 10.0,
    input_name: Annotated[str, typer.Option("--input", help="Input channel of a response.")] = "",
    rate: Annotated[float | None, typer.Option(help="Sampling rate to resample to first [Hz].")] = None,
) -> None:
    """Spectra of sensors of a motion, or of measured channels.

    Without -o, the table is written next to the file: swing.h5 gives swing.psd.csv.

    Example: floatframe spectrum swing.h5 --sensor tip.z --as third-octave -o tip.json

    Example: floatframe spectrum rotor.h5 -s housing.z --as orders --rotation shaft.angle -o orders.png

    Example: floatframe spectrum road.rsp -s "FL*" --as psd --resolution 0.5
    """
    from floatframe.errors import ResultsError
    from floatframe.files.signals.analysis import SpectrumRequest

    signals, extra, inputs = chosen_signals(file, sensors, (rotation, input_name), rate)
    path = output_file(output, file.with_suffix(f".{kind}.csv"), ENDINGS, ResultsError, overwrite_of=inputs)
    request = SpectrumRequest(window, resolution, rms, extra[0], extra[1], max_order)
    write_spectra(signals, kind, request, path, title=file.name)


def chosen_signals(
    file: Path, names: list[str], others: tuple[str, ...], rate: float | None
) -> "tuple[Signals, list[Signal | None], tuple[Path, ...]]":
    """Return the chosen channels of a results file or measured file, the channels `others`, and the files read."""
    if file.suffix.lower() == ".h5" or file.is_dir():
        from floatframe.results.trajectory import read_trajectory

        trajectory = read_trajectory(file)
        signals = sensor_signals(trajectory, names, rate)
        found = [sensor_signals(trajectory, [name], rate)[1] if name else None for name in others]
        return signals, found, (file, *map(Path, trajectory.files))
    from dataclasses import replace
    from fnmatch import fnmatchcase

    import numpy as np

    from fe_models.foundation.words import nearest, quoted
    from floatframe.errors import SignalError
    from floatframe.files.signals.analysis import even_signals
    from floatframe.files.signals.read_signals import read_signals

    whole = even_signals(read_signals(file), rate)
    for note in whole.notes:
        typer.echo(f"note: {note}", err=True)
    picked = [k for k, name in enumerate(whole.names) if not names or any(fnmatchcase(name, each) for each in names)]
    missing = [each for each in names if not any(fnmatchcase(name, each) for name in whole.names)]
    if missing:
        raise SignalError(f"{file}: no channel {', '.join(map(quoted, missing))}{nearest(missing[0], whole.names)}")
    extra = [whole[name] if name else None for name in others]
    values = np.stack([whole.values[:, k] for k in picked], axis=1)
    names_kept, units = tuple(whole.names[k] for k in picked), tuple(whole.units[k] for k in picked)
    return replace(whole, values=values, names=names_kept, units=units), extra, (file,)


def sensor_signals(trajectory: "Trajectory", names: list[str], rate: float | None = None) -> "Signals":
    """Return the measurements of chosen sensors (default: all) at equidistant times; notes are printed."""
    from floatframe.errors import ResultsError
    from floatframe.files.signals.analysis import even_signals, signals_of
    from floatframe.files.system_file.recorded_system import recorded_system
    from floatframe.results.sensor_choice import chosen_measurements
    from floatframe.results.sensors import measured

    system = recorded_system(trajectory)
    if system is None:
        raise ResultsError(
            "the system file of the run does not exist any more, or the run was made in Python: no sensors are known"
        )
    found = chosen_measurements(system, trajectory, names) if names else [*measured(system, trajectory).values()]
    signals = even_signals(signals_of(found, system.units), rate)
    for note in signals.notes:
        typer.echo(f"note: {note}", err=True)
    return signals


def known_system(trajectory: "Trajectory") -> "System | None":
    """Return the system of a motion from the file its results name; None, with a note, if that cannot be read."""
    from cms.errors import CmsError
    from floatframe.errors import FloatframeError
    from floatframe.files.system_file.recorded_system import recorded_system

    try:
        return recorded_system(trajectory)
    except (FloatframeError, CmsError) as error:
        typer.echo(f"note: sensors are omitted: {error}", err=True)
        return None


def plot_as(
    trajectory: "Trajectory", names: list[str], kind: str, path: Path, *, resolution: float | None, rotation: str
) -> None:
    """Draw the spectra of sensors, for plot --as."""
    from floatframe.files.signals.analysis import SpectrumRequest

    turning = sensor_signals(trajectory, [rotation])[1] if rotation else None
    request = SpectrumRequest(resolution=resolution, rotation=turning)
    write_spectra(sensor_signals(trajectory, names), kind, request, path, title=trajectory.head.system)


def write_spectra(signals: "Signals", kind: str, request: "SpectrumRequest", path: Path, *, title: str) -> None:
    """Write spectra of all channels as picture or table, and print a summary."""
    from floatframe.files.signals.analysis import spectra_of, spectral_table
    from floatframe.files.signals.spectra import Spectrum
    from floatframe.pictures.spectrum_plots import plot_spectra

    spectra = spectra_of(signals, kind, request)
    rows = [
        (s.name, s.kind, s.unit, f"{s.values.max():.6g}", f"{s.frequencies[s.values.argmax()]:.6g}",
         f"{s.resolution:.4g}", str(s.n_averages))
        for s in spectra[:MOST_ROWS]
        if isinstance(s, Spectrum)
    ]  # fmt: skip
    if rows:
        heads = ("", "kind", "unit", "greatest>", "at Hz>", "resolution Hz>", "averages>")
        print_table("Spectra", heads, rows)
    write_outputs([path], table=lambda: spectral_table(spectra), figure=lambda: plot_spectra(spectra, title=title))
