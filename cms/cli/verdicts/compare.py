"""The command `cms compare`: mode sets of a job compared with its full model; table, HTML, JSON and CSV."""

from collections.abc import Mapping
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cms.cli.console import print_table, say, say_written, stages
from cms.errors import CompareError
from fe_models.foundation.formats import by_suffix
from fe_models.foundation.words import nearest, quoted

if TYPE_CHECKING:
    from cms.assessment.compare.comparison import Comparison

__all__ = ["CompareRequest", "parse_load", "parse_sets", "run_compare"]

LOAD_KEYS = ("mass", "inertia", "stiffness", "rotational_stiffness")
FILES = {kind: f"comparison.{kind}" for kind in ("html", "json", "csv", "pdf")}
CACHE = "full_model.npz"
#: headings of the deciding records in the table
SHORT = {
    "frequency-error": "frequency",
    "mac": "1-MAC",
    "static-interface": "static",
    "static-inertia": "inertia",
    "static-load-cases": "load cases",
    "frequency-response": "response",
    "deformation-error": "\u03b5(t)",
}


@dataclass(frozen=True)
class CompareRequest:
    """Arguments of the command `cms compare`."""

    job: Path
    sets: str
    modes: str
    output: Path | None
    band: float | None
    n_reference: int
    loads: tuple[str, ...]
    pulse_at: str | None
    motion: Path | None
    stills: int
    workers: str | None
    changes: Mapping[str, Any]  #: values of parameters of the job


def run_compare(request: CompareRequest) -> None:
    """Run the comparison, print the verdicts, and write the report.

    Raises
    ------
    CompareError
        If the requested comparison is impossible.
    """
    from cms.assessment.compare.mode_counts import mode_counts
    from cms.jobs.job import read_job
    from cms.jobs.studies.comparison_of_job import compare
    from fe_models.foundation.tasks.workers import checked_workers

    require_job(request.job)
    job = read_job(request.job, request.changes) if request.changes else request.job
    counts = mode_counts(request.modes)
    names = parse_sets(request.sets)
    if request.band is not None and not request.band > 0:
        raise CompareError(f"--band {request.band:g}: expected a frequency above 0 Hz")
    if request.n_reference < 1:
        raise CompareError(f"--reference-modes {request.n_reference}: expected 1 or more")
    loads = [parse_load(text) for text in request.loads]
    workers = None if request.workers is None else checked_workers(request.workers)
    folder = output_folder(request.output or request.job.with_name(f"{request.job.stem}_comparison"))
    reports: list[Any] = []
    try:
        with stages() as clock:
            comparison = compare(
                job, names, counts, band=request.band, n_reference=request.n_reference, loads=loads,
                pulse_at=request.pulse_at, motion=request.motion, cache=folder / CACHE, workers=workers, stages=clock,
                on_report=reports.append,
            )  # fmt: skip
            with clock("report"):
                written = write_report(folder, comparison, request.stills)
    finally:
        for report in reports:
            print_table(report.title, ("", ""), report.rows())
    print_comparison(comparison)
    for path in written:
        say_written(path)


def require_job(path: Path) -> None:
    """Raise `CompareError` for a modal file or the file of a model; the message names the file to give."""
    if path.suffix.lower() == ".toml":
        return
    from cms.cli.exchange import FORMATS

    if path.suffix.lower() in (".h5", ".hdf5"):
        raise CompareError(
            f"{path}: a modal file holds no full model to compare with; give the job (.toml) it was made from, or "
            f"judge the file alone: cms check {path}"
        )
    if path.suffix.lower() in by_suffix(known for known in FORMATS if known.holds != "matrices"):
        raise CompareError(
            f"{path}: expected a job file (.toml) that names this file, its interfaces and units; see docs/job_file.md"
        )


def parse_sets(text: str) -> tuple[str, ...]:
    """Return the names of mode sets in a text separated by commas, each name once.

    Raises
    ------
    CompareError
        If a name is unknown or repeated.
    """
    from cms.modes.mode_sets import MODE_SETS

    names = [name.strip() for name in text.split(",") if name.strip()]
    if not names:
        raise CompareError(
            f"--sets {quoted(text)}: expected names of mode sets with commas between{nearest('', MODE_SETS)}"
        )
    for name in names:
        if name not in MODE_SETS:
            raise CompareError(f"--sets {text!r}: unknown mode set {quoted(name)}{nearest(name, MODE_SETS)}")
        if names.count(name) > 1:
            raise CompareError(f"--sets {text!r}: {name!r} stands there twice")
    return tuple(names)


def parse_load(text: str) -> Any:
    """Return the load "INTERFACE:mass=1.2,stiffness=1e4" as made by `cms.modes.point_load`.

    Raises
    ------
    CompareError
        If the text does not have this form.
    """
    from cms.modes.families.interface_loads import point_load

    name, _, rest = text.partition(":")
    values: dict[str, float] = {}
    for part in filter(None, (word.strip() for word in rest.split(","))):
        key, _, number = (word.strip() for word in part.partition("="))
        if key not in LOAD_KEYS:
            raise CompareError(f"--load {text!r}: unknown key {quoted(key)}{nearest(key, LOAD_KEYS)}")
        try:
            values[key] = float(number)
        except ValueError:
            raise CompareError(f"--load {text!r}: {key} = {number!r}; expected a number") from None
    if not name or not values:
        raise CompareError(f"--load {text!r}: expected INTERFACE:mass=…,stiffness=…, of {', '.join(LOAD_KEYS)}")
    return point_load(name, **values)


def output_folder(path: Path) -> Path:
    """Return the folder of the report, which is created if its parent exists.

    Raises
    ------
    CompareError
        If the path is a file, or the folder cannot be created.
    """
    if path.exists() and not path.is_dir():
        raise CompareError(f"--output {path}: this is a file; expected a folder for the report")
    try:
        path.mkdir(exist_ok=True)
    except OSError as error:
        raise CompareError(f"--output {path}: cannot be made: {error.strerror}; choose another folder") from error
    return path


def write_report(folder: Path, comparison: "Comparison", stills: int) -> list[Path]:
    """Write HTML, JSON, CSV and, if reportlab is installed, PDF; return their paths."""
    from cms.assessment.report import comparison_document, comparison_json
    from fe_models.foundation.documents.write import document_content
    from fe_models.foundation.paths import replace_files

    document = comparison_document(comparison, stills=stills)
    contents = {
        folder / FILES["html"]: document_content(document, ".html"),
        folder / FILES["json"]: comparison_json(comparison).encode(),
        folder / FILES["csv"]: comparison.to_table().content(".csv"),
    }
    if find_spec("reportlab") is not None:
        contents[folder / FILES["pdf"]] = document_content(document, ".pdf")
    replace_files(contents)
    return list(contents)


def print_comparison(comparison: "Comparison") -> None:
    """Print the answer, the verdicts with their values, and the reasons."""
    from cms.assessment.compare.verdicts import DECIDING
    from cms.assessment.report.formatting import hertz, seconds, share
    from cms.assessment.report.parts import MARKS

    full = comparison.full
    say(f"{comparison.sentence}\n")
    rows = []
    for result in comparison.sets:
        point = result.detail
        numbers = ["", "", *[""] * len(DECIDING)]
        if point is not None:
            numbers = [str(point.n_modes), str(point.n_q), *(share(point.record(name).value) for name in DECIDING)]
        rows.append((result.name, MARKS[result.verdict].split()[0], *numbers, seconds(result.seconds)))
    headings = ("set", "", "modes>", "coord.>", *(f"{SHORT[name]}>" for name in DECIDING), "time>")
    title = f"Mode sets of {comparison.name} up to {hertz(full.band_hz)} Hz ({full.n_band} elastic free modes)"
    shown = [k for k in range(len(headings)) if k < 2 or any(row[k] not in ("", "\u2013") for row in rows)]
    print_table(title, [headings[k] for k in shown], [[row[k] for k in shown] for row in rows], is_named=True)
    for result in comparison.sets:
        say(f"{result.name}: {result.sentence}")
    source = "taken from an earlier comparison" if full.was_cached else "solved"
    say(f"\nfull model {source} in {seconds(comparison.seconds['full model'])}")
