"""`cms export`: a modal file in the format of another program."""

from dataclasses import dataclass
from math import isfinite
from pathlib import Path

from cms.cli.console import output_path, say
from cms.errors import ExportError
from fe_models.foundation.words import nearest, quoted

__all__ = ["ExportRequest", "run_export"]


@dataclass(frozen=True)
class ExportRequest:
    """The arguments of `cms export`."""

    file: Path
    to: str
    units: str | None
    nodes: str
    output: Path | None
    loads: tuple[str, ...] = ()  #: "NAME=AMPLITUDE"


def run_export(request: ExportRequest) -> None:
    """Write the files, and report what the format does not hold.

    Raises
    ------
    CmsError
        If the format or the units are unknown or missing, the body does not fit, or the files cannot be written.
    """
    from cms.exchange.exporters.export import WRITERS, export_body
    from cms.exchange.exporters.formats import FORMATS

    if request.to not in WRITERS:
        raise ExportError(f"--to {quoted(request.to)}: unknown format{nearest(request.to, WRITERS)}")
    suffix = next(known.suffixes[0] for known in FORMATS if known.key == request.to and known.writes)
    default = request.file.with_name(f"{request.file.stem}_{request.to}{suffix}")
    path = output_path(request.output, default, ExportError, overwrite_of=(request.file,))
    exported = export_body(
        request.file, path, to=request.to, units=request.units, nodes=request.nodes, loads=loads_of(request)
    )
    units = exported.units
    for written in exported.files:
        say(f"wrote {written} ({written.stat().st_size / 1e6:.2f} MB)" if written.is_file() else f"wrote {written}")
    say(f"units: {units.name} ({units.length_symbol}, {units.mass_symbol}, {units.time_symbol})")
    for note in exported.notes:
        say(note)
    if exported.left_out:
        say(f"not held by this format: {'; '.join(exported.left_out)}")


def loads_of(request: ExportRequest) -> dict[str, float]:
    """Return the requested amplitudes by the names of their load cases."""
    loads = {}
    for text in request.loads:
        name, _, amplitude = text.rpartition("=")
        try:
            loads[name] = float(amplitude)
        except ValueError:
            name = ""
        if not name or not isfinite(loads[name]):
            raise ExportError(f"--load {text}: expected NAME=AMPLITUDE, such as weight=1")
    return loads
