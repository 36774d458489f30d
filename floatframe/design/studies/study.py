"""Parameter studies from a file: every point is a separate task, and a failed point is a row of the table.

study = read_study("crank_study.toml")
table = run_study(study)                     # rows: parameter values, and outputs or an error
"""

import logging
import os
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.paths import file_digest
from fe_models.foundation.presentation import presented
from fe_models.foundation.tasks.campaign import Campaign, campaign_digest, open_task_journal
from fe_models.foundation.tasks.notes import recorded_notes
from fe_models.foundation.tasks.workers import Workers
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.driven.inverse_dynamics import inverse_dynamics
from floatframe.analyses.driven.kinematics import kinematics
from floatframe.analyses.equilibrium import static_equilibrium
from floatframe.analyses.linear.linearization import linearize
from floatframe.analyses.linear.system_modes import SystemModes, system_modes
from floatframe.analyses.snapshot import snapshot
from floatframe.design.studies.study_file import TAKES, Output, Study
from floatframe.engine.compiling.file_frames import state_of_file
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError, ResultsError
from floatframe.files.system_file.bodies import ReadBodies
from floatframe.files.system_file.run_section import RunOptions, formulation_of, required_run
from floatframe.model.system import System
from floatframe.results.sensors import measurement_of
from floatframe.results.trajectory import Trajectory
from floatframe.simulation.integrate import integrate

__all__ = ["StudyRow", "StudyTable", "report_notes", "run_study", "sendable_study"]

log = logging.getLogger(__name__)
NUMBER = re.compile(r"(?<![\w'])\d[\d.e+-]*")  #: a number in a note, but not in a name


# a point of a study and its result ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class StudyRow:
    """Parameter values of a point, and its outputs or error."""

    values: tuple[Any, ...]
    outputs: tuple[float, ...]  #: NaN if the point failed
    units: tuple[str, ...]
    error: str = ""  #: reason of a failure
    is_lasting: bool = True  #: whether a repeated attempt would give the same result; False for a killed process
    notes: tuple[str, ...] = ()  #: warnings of the point


# study ----------------------------------------------------------------------------------------------------------------


def texts(value: Any) -> Iterator[str]:
    """Yield all texts in a value of a file that can be names of files."""
    if isinstance(value, str):
        if 0 < len(value) < 1000 and "\0" not in value:
            yield value
    elif isinstance(value, dict):
        for each in value.values():
            yield from texts(each)
    elif isinstance(value, list | tuple):
        for each in value:
            yield from texts(each)


# study ----------------------------------------------------------------------------------------------------------------


OF_MODES = {"frequency": "Hz", "damping": "-", "real": "1/s", "imaginary": "rad/s"}
KIND = "floatframe sweep journal 2"
EXTREMES: dict[str, Callable[[Array], float]] = {"least": np.nanmin, "greatest": np.nanmax}  #: over all modes


@presented
@dataclass(frozen=True)
class StudyTable(Tabular):
    """All points of a study, in order."""

    study: Study
    rows: tuple[StudyRow, ...]
    n_known: int = 0  #: number of rows taken from the journal

    @property
    def units(self) -> tuple[str, ...]:
        """Units of the outputs, from the first point that has them."""
        return next((row.units for row in self.rows if not row.error), ("",) * len(self.study.outputs))

    @property
    def n_failed(self) -> int:
        """Number of failed points."""
        return sum(bool(row.error) for row in self.rows)

    is_indexed = False

    def to_table(self) -> Table:
        """Return parameters, outputs and the reason of a failure by point; outputs of failed points are missing."""
        study = self.study
        names = [parameter.name for parameter in study.parameters] + [output.name for output in study.outputs]
        given = [of_one_kind(values) for values in zip(*(row.values for row in self.rows), strict=True)]
        rows = [
            (*values, *((None,) * len(row.outputs) if row.error else row.outputs), row.error)
            for values, row in zip(zip(*given, strict=True), self.rows, strict=True)
        ]
        units = dict(zip((output.name for output in study.outputs), self.units, strict=True))
        return Table.of_rows([*names, "error"], rows, units)

    def column(self, name: str) -> Array:
        """Return the values of an output at all points, (n_points,); NaN if a point failed."""
        names = [output.name for output in self.study.outputs]
        if name not in names:
            raise ModelError(f"study: no output {quoted(name)}{nearest(name, names)}")
        return np.array([row.outputs[names.index(name)] for row in self.rows])


def of_one_kind(values: Sequence[Any]) -> Sequence[Any]:
    """Return the values of a parameter if all are numbers, all texts or all booleans, else their texts."""
    kinds = {type(value) for value in values}
    return values if kinds <= {int, float} or kinds in ({str}, {bool}) else [str(value) for value in values]


def run_study(
    study: Study,
    *,
    workers: Workers = None,
    journal: str | os.PathLike[str] | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> StudyTable:
    """Compute all points of a study; the results do not depend on the workers.

    Parameters
    ----------
    study
        The study, from `read_study`.
    workers
        Workers that compute points (docs/cluster.md); default: those in the study, or one process per processor.
    journal
        A file to which every point is appended; points in it are not computed again. None: nothing is written.
    progress
        Called with the number of completed points and the total number.

    Raises
    ------
    ModelError, SystemFileError
        Before any work, if the system in its file is not valid, a parameter does not name a key of it, or an output
        does not exist.
    ResultsError
        If the journal belongs to another system, other outputs or another version of the program.
    WorkerError
        If no workers are available.
    """
    from floatframe.files.system_file.read_system import read_system

    points = list(study.points())
    check(study, points[0])
    files = read_system(study.system, study.given)[0].files
    kept = None
    if journal is not None:
        asked = (
            study.analysis, [p.path for p in study.parameters], [(o.of, o.take) for o in study.outputs],
            *([sorted(study.given.items())] if study.given else ()),
        )  # fmt: skip
        digest, source = campaign_digest(asked, files), f"the study of {study.system}"
        kept = open_task_journal(Path(journal), KIND, digest, source, ResultsError)
    campaign = Campaign(StudyPoint(sendable_study(study)), kept)
    rows = campaign.rows(
        points, study.workers if workers is None else workers, progress=progress,
        files=[os.path.abspath(name) for name in files],
    )  # fmt: skip
    report_notes(row.notes for row in rows)
    return StudyTable(study, tuple(rows), campaign.n_known)


def report_notes(notes: Iterable[Sequence[str]]) -> None:
    """Log, of the notes of all points, the first of those that differ only in their numbers, and how many they are."""
    found: dict[str, list[str]] = {}
    for of_point in notes:
        first: dict[str, str] = {}
        for note in of_point:
            first.setdefault(NUMBER.sub("#", note), note)
        for kind, note in first.items():
            found.setdefault(kind, []).append(note)
    for same in found.values():
        n = len(same) - 1
        log.warning("%s%s", same[0], f" (and at {n} more {'point' if n == 1 else 'points'})" if n else "")


def sendable_study(study: Study) -> Study:
    """Return the study as sent to workers: the system with its full path, without values, which may be many."""
    parameters = tuple(replace(parameter, values=()) for parameter in study.parameters)
    return replace(study, system=os.path.abspath(study.system), parameters=parameters)


def check(study: Study, point: tuple[Any, ...]) -> None:
    """Raise if the system, a key path or an output does not exist; run in this process before the long work."""
    from floatframe.files.system_file.read_system import read_system

    for parameter in study.parameters:
        if parameter.path in study.given:
            raise ModelError(f"--set {parameter.path}: parameter {quoted(parameter.name)} varies this key; remove it")
    plain, run = read_system(study.system, study.given)
    if study.analysis in MOTIONS:
        required_run(run, study.system, begins_there=True)
    try:
        system, _ = read_system(study.system, study.changes(point))
    except ReportedError as error:
        read_system_keys(study)
        if "unknown key" in str(error):
            raise
        system = plain  # the values of this point are impossible: its row will be a failure
    if study.analysis == "modes":
        for output in study.outputs:
            mode_and_part(output)
        return
    try:
        placed = as_placed(system)
    except Exception:  # if only this point fails and not the unchanged file, its row is a failure
        system, placed = plain, as_placed(plain)
    for output in study.outputs:
        output_value(output, system, placed)


def as_placed(system: System) -> Trajectory:
    """Return the assembled bodies as a motion with one time."""
    compiled = compiled_system(system)
    return snapshot(system, state_of_file(compiled, compiled.placed))


def read_system_keys(study: Study) -> None:
    """Raise `SystemFileError` if a key path does not exist."""
    from fe_models.foundation.parametric_file import read_parametric
    from floatframe.errors import SystemFileError

    for parameter in study.parameters:
        read_parametric(Path(study.system), SystemFileError, {parameter.path: parameter.values[0]})


@dataclass(frozen=True)
class StudyPoint:
    """The function that computes a point, which can be sent to another process."""

    study: Study
    read_bodies: ReadBodies = field(default_factory=dict, compare=False, repr=False)  #: kept from point to point

    def __call__(self, point: tuple[Any, ...]) -> StudyRow:
        """Return the row of a point."""
        from floatframe.files.system_file.read_system import read_system

        with recorded_notes() as notes:
            system, given = read_system(self.study.system, self.study.changes(point), read_bodies=self.read_bodies)
            if self.study.analysis == "modes":
                modes = system_modes(linearize(system, formulation=formulation_of(given)))
                found = [output_value_of_modes(output, modes, 1 / system.units.time) for output in self.study.outputs]
            else:
                motion = self.motion(system, given)
                found = [output_value(output, system, motion) for output in self.study.outputs]
        return StudyRow(point, tuple(value for value, _ in found), tuple(unit for _, unit in found), notes=tuple(notes))

    def failed(self, point: tuple[Any, ...], words: str, is_lasting: bool) -> StudyRow:
        """Return the row of a failed point."""
        n = len(self.study.outputs)
        return StudyRow(point, (float("nan"),) * n, ("",) * n, words, is_lasting)

    def key(self, point: tuple[Any, ...]) -> Any:
        """Return the values of a point, and digests of the files that they name."""
        digests = [file_digest(Path(self.study.system).parent / text) for text in texts(point)]
        return [point, [digest for digest in digests if digest]]

    def record(self, row: StudyRow) -> dict[str, Any] | None:
        """Return outputs and error of a row, unless a repeated attempt could give another result."""
        outputs = [float(value) for value in row.outputs]
        content = {"outputs": outputs, "units": row.units, "error": row.error, "notes": row.notes}
        return content if row.is_lasting else None

    def row(self, point: tuple[Any, ...], record: dict[str, Any]) -> StudyRow:
        """Return the row of a record."""
        outputs, units = tuple(record["outputs"]), tuple(record["units"])
        if not len(outputs) == len(units) == len(self.study.outputs) or not all(type(v) is float for v in outputs):
            raise ValueError("a record of another study")
        return StudyRow(point, outputs, units, str(record["error"]), notes=tuple(map(str, record.get("notes", ()))))

    def motion(self, system: System, given: RunOptions | None) -> Trajectory:
        """Return the motion of the analysis; an equilibrium is a motion with one time."""
        if self.study.analysis == "static":
            return equilibrium_of(system, formulation_of(given))
        run = required_run(given, self.study.system, begins_there=True)
        return MOTIONS[self.study.analysis](system, run)


def motion_of_run(system: System, run: RunOptions) -> Trajectory:
    """Return the integrated motion."""
    return integrate(
        system, run.integrator, run.t_end, run.h, output_every=run.output_every, watch=run.watch,
        state=run.start_state(system),
    )  # fmt: skip


def equilibrium_of(system: System, formulation: str) -> Trajectory:
    """Return the equilibrium at rest as a motion with one time."""
    rest = static_equilibrium(system, formulation=formulation)
    return snapshot(system, rest.state, rest.u_dot, rest.w)


MOTIONS: dict[str, Callable[[System, RunOptions], Trajectory]] = {
    "run": motion_of_run,
    "kinematics": lambda system, run: kinematics(system, run.output_times()),
    "inverse": lambda system, run: inverse_dynamics(system, run.output_times()).motion,
}


def output_value(output: Output, system: System, motion: Trajectory) -> tuple[float, str]:
    """Return the value of an output and its unit; `ModelError` with the choices if there is no such column."""
    values, unit = column_of(output, system, motion)
    return float(TAKES[output.take](values)), unit


def column_of(output: Output, system: System, motion: Trajectory) -> tuple[Array, str]:
    """Return the values over time from which an output is computed, (n_t,), and their unit."""
    try:
        found = measurement_of(system, motion, output.of)
        column = found.only()
    except ModelError as error:
        raise ModelError(f"output {output.name!r}: of = {quoted(output.of)}: {error}") from error
    return found.columns[column], found.units[column]


def output_value_of_modes(output: Output, modes: SystemModes, per_second: float) -> tuple[float, str]:
    """Return the value of an output of the modes about the equilibrium, and its unit."""
    part, which = mode_and_part(output)
    k = which if isinstance(which, int) else 1
    if k > len(modes.eigenvalues):
        raise ModelError(f"output {output.name!r}: of = {output.of!r}: the system has {len(modes.eigenvalues)} modes")
    values = {
        "frequency": modes.frequencies * per_second,
        "damping": modes.damping_ratios,
        "real": modes.eigenvalues.real * per_second,
        "imaginary": modes.eigenvalues.imag * per_second,
    }
    return float(EXTREMES[which](values[part]) if isinstance(which, str) else values[part][k - 1]), OF_MODES[part]


def mode_and_part(output: Output) -> tuple[str, int | str]:
    """Return the part and the mode ("least" or "greatest" over all) of an output; `ModelError` if it names neither."""
    part, _, number = output.of.partition(" ")
    if part in OF_MODES and number in EXTREMES:
        return part, number
    if part not in OF_MODES or not number.isdigit() or int(number) < 1:
        raise ModelError(
            f"output {output.name!r}: of = {output.of!r}: expected one of {', '.join(OF_MODES)} and the number of a "
            'mode, such as "frequency 1", or the least or greatest over all modes, such as "damping least"'
        )
    return part, int(number)
