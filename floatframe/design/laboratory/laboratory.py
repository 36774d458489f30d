"""Comparison of descriptions of a flexible body in a mechanism with a reference: error, cost, cause of the error.

(1) every case is reduced, put into the system and run; an earlier short run excludes compilation from the cost
(2) error of each column of each sensor: root mean square of its difference from the reference, divided by the range of
    the reference; the error of a case is the largest error of its columns
(3) causes of the error of a case: *truncation* is its distance from the case of the same family with the most modes;
    *description* is the distance of that case from the reference (body frame, stiffening, number of parts, the basis
    itself). The larger one fails first; notes state when the body left the linear range of its frame
"""

import logging
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Self

import numpy as np

from cms.assessment.quality.record import plain
from cms.body.reduced_body import ReducedBody
from cms.cli.split import SplitRequest, split_job
from cms.jobs.body_of_job import job_body
from cms.jobs.job import Job, read_job
from cms.jobs.mode_set_of_job import frame_of, job_mode_set, reduction_of
from cms.modes.families.families import Families
from cms.pipeline import Plan, reduced, states_of_job
from cms.reduction.geometric_stiffness.unit_states import UnitStates, require_geometric_stiffness
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields
from fe_models.foundation.stages import Stages
from floatframe.design.laboratory.cases import Case
from floatframe.design.laboratory.exact_beam import ExactBeam, with_exact_beams
from floatframe.design.laboratory.full_model import FullModel, all_dofs
from floatframe.design.laboratory.substitution import with_body
from floatframe.errors import ModelError
from floatframe.integrators.integrator import Integrator
from floatframe.model.system import System
from floatframe.results.sensors import measured
from floatframe.simulation.integrate import integrate

__all__ = ["BodyShelf", "CaseResult", "LaboratoryResult", "Reference", "study"]


LEAST_RANGE = 1e-6  #: range of a column, relative to the largest column of its sensor, below which it does not move


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Reference:
    """Columns of a reference over time.

    Parameters
    ----------
    words
        Description of the reference.
    t
        Times, (n_t,).
    columns
        Values over time, (n_t,) each, by "sensor column".
    """

    words: str
    t: Array
    columns: Mapping[str, Array]


@dataclass(frozen=True, eq=False)
class Run:
    """A motion of the mechanism with one description of the body."""

    system: System
    columns: Mapping[str, Array]  #: columns of the selected sensors
    t: Array  #: (n_t,)
    seconds: float  #: processor time [s]
    notes: tuple[str, ...]  #: notes on bodies beyond the linear range of their frame

    def reference(self, words: str) -> Reference:
        """Return the measured columns as a reference."""
        return Reference(words, self.t, self.columns)


@dataclass(frozen=True, eq=False)
class CaseResult:
    """The result of a case."""

    case: Case
    n_q: int = 0  #: number of modal coordinates of all parts
    n_u: int = 0  #: number of velocities of the system, including rigid motion
    #: error of each column, relative to the range of the reference
    errors: Mapping[str, float] = field(default_factory=dict)
    truncation: float = float("nan")  #: distance from the same description with the most modes
    description: float = float("nan")  #: error of that description with the most modes, relative to the reference
    seconds: float = float("nan")  #: processor time of the run [s]
    notes: tuple[str, ...] = ()  #: notes on bodies beyond the linear range of their frame
    failure: str = ""  #: reason why the case has no motion

    @property
    def error(self) -> float:
        """The largest error of all columns; NaN where the case failed."""
        return max(self.errors.values(), default=float("nan"))

    @property
    def worst(self) -> str:
        """The column with the largest error."""
        return max(self.errors, key=lambda name: self.errors[name], default="")

    @property
    def fails_first(self) -> str:
        """The dominant cause of the error: "truncation" or "description"; "" if unknown."""
        if not np.isfinite(self.description):
            return ""
        return "truncation" if self.truncation > self.description else "description"


@presented
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class LaboratoryResult(Tabular):
    """All cases, compared with the reference.

    Parameters
    ----------
    name
        Name of the laboratory.
    reference
        Description of the reference.
    columns
        Compared columns.
    cases
        The results of the cases.
    settled
        Error of the reference itself; None if unknown.
    """

    name: str
    reference: str
    columns: tuple[str, ...]
    cases: tuple[CaseResult, ...]
    settled: float | None = None

    is_indexed = False

    def to_table(self) -> Table:
        """Return one row per case."""
        rows = self.table()
        return Table.of_rows(list(rows[0]), [tuple(row.values()) for row in rows], meta={"reference": self.reference})

    def table(self) -> list[dict[str, Any]]:
        """Return one row per case, in plain types."""
        return [
            {
                "mode_set": r.case.mode_set,
                "frame": r.case.frame,
                "stiffening": r.case.stiffening,
                "parts": r.case.parts,
                "n_modes": r.case.n_modes,
                "n_q": r.n_q,
                "n_u": r.n_u,
                "error": plain(r.error),
                "worst": r.worst,
                **{f"error {name}": plain(r.errors.get(name, float("nan"))) for name in self.columns},
                "truncation": plain(r.truncation),
                "description": plain(r.description),
                "fails_first": r.fails_first,
                "seconds": plain(r.seconds),
                "notes": "; ".join(r.notes),
                "failure": r.failure,
            }
            for r in self.cases
        ]


def study(
    system: System,
    body: str,
    job: str | Path,
    cases: Sequence[Case],
    *,
    integrator: Integrator,
    t_end: float,
    h: float,
    reference: Case | FullModel | ExactBeam | Reference,
    sensors: Sequence[str] | None = None,
    cut: str = "rigid",
    watch: str = "stop",
    stages: Stages | None = None,
    on_case: Callable[[CaseResult], None] | None = None,
) -> LaboratoryResult:
    """Run a mechanism with every description of one flexible body, and compare with a reference.

    Parameters
    ----------
    system
        The mechanism, with sensors; its flexible body is only a placeholder.
    body
        Name of that flexible body.
    job
        Job file of its reduction; mode set, number of modes and frame come from the cases.
    cases
        The descriptions of the body to compare.
    integrator
        Integrator of all runs.
    t_end
        End of the motion [s].
    h
        Step of all runs [s].
    reference
        A case that is finer than the others, the whole finite element model, geometrically exact beams (a body of
        lines), or columns from elsewhere.
    sensors
        Names of the sensors that are compared; None: all.
    cut
        Interfaces at the cuts of parts, "rigid" or "distributing"; rigid ones keep sections plane and undistorted, so
        that parts of a solid are somewhat stiffer than the whole.
    watch
        What a run does if its steps distort the motion (`floatframe.integrate`).
    stages
        Shows the progress of each case and records its duration; None: a new one is made.
    on_case
        Called with each result, for progress.

    Raises
    ------
    ModelError
        If the system has no such body or sensor, or the reference has no column that is compared.
    CmsError
        If the reference case cannot be reduced or run; other cases that fail become rows with the reason.
    """
    stages = stages or Stages()
    names = [sensor.name for sensor in system.sensors]
    wanted = list(names if sensors is None else sensors)
    unknown = [name for name in wanted if name not in names]
    if not wanted or unknown:
        choices, got = ", ".join(names) or "none", ", ".join(unknown) or "none"
        raise ModelError(f"study: sensors: expected some of {choices}; got {got}")
    if not cases:
        raise ModelError("study: expected at least one case")
    found: dict[Case, Run] = {}
    settled: dict[str, float] = {}
    every = [*cases, reference] if isinstance(reference, Case) else cases

    with BodyShelf(job, cut, cases=every) as shelf, quiet():

        def moved(changed: System) -> Run:
            if not found:
                integrate(changed, integrator, h, h, watch=watch)  # compiles
            begun = time.process_time()
            motion = integrate(changed, integrator, t_end, h, watch=watch)
            seconds = time.process_time() - begun
            chosen = [sensor for sensor in changed.sensors if sensor.name in wanted]
            columns = {f"{name} {key}": values for name, each in measured(changed, motion, chosen).items()  # type: ignore[arg-type]
                       for key, values in each.columns.items()}  # fmt: skip
            notes = tuple(note.words for note in motion.validity)
            return Run(changed, columns, np.asarray(motion.t), seconds, notes)

        def run(case: Case) -> None:
            with stages(f"reduce {case.description}, {case.n_modes} modes"):
                changed = with_body(system, body, shelf.reduced(case), stiffening=case.stiffening)
            with stages(f"run {case.description}, {case.n_modes} modes"):
                found[case] = moved(changed)

        if isinstance(reference, Case):
            run(reference)
            told = found[reference].reference(f"{reference.description}, {reference.n_modes} modes")
        elif isinstance(reference, FullModel):
            with stages("full model"):
                whole = shelf.unreduced(reference)
                told = moved(with_body(system, body, [whole], stiffening=whole.geometric is not None)).reference(
                    f"{reference.description}, {whole.n_q} shapes"
                )
        elif isinstance(reference, ExactBeam):
            coarse, fine = (with_exact_beams(system, body, shelf.model(), k * reference.elements) for k in (1, 2))
            with stages("exact beams"):
                before, after = moved(coarse), moved(fine)
            told = after.reference(f"{reference.description}, twice {reference.elements} elements")
            settled = {name: distance(before.columns[name], values, float(np.ptp(values)) or 1.0) / 3
                       for name, values in told.columns.items()}  # fmt: skip
            lost = [name for name in wanted if name not in {sensor.name for sensor in fine.sensors}]
            if lost:
                told = replace(told, words=f"{told.words} (without {', '.join(lost)}, which they do not have)")
        else:
            told = reference
        failures: dict[Case, str] = {}
        results: list[CaseResult] = []
        for case in cases:
            if case not in found:
                try:
                    run(case)
                except ReportedError as error:
                    failures[case] = str(error)
            if on_case is not None:
                on_case(CaseResult(case, failure=failures.get(case, "")))
    compared = compared_columns(told, [each.columns for each in found.values()])
    for case in cases:
        if case in failures:
            results.append(CaseResult(case, failure=failures[case]))
            continue
        changed, columns, t = (here := found[case]).system, here.columns, here.t
        at = {name: np.interp(t, told.t, told.columns[name]) for name in compared}
        scale = {name: float(np.ptp(told.columns[name])) for name in compared}
        richest = max((each for each in found if each.family == case.family), key=lambda each: each.n_modes)
        rich = found[richest].columns
        results.append(
            CaseResult(
                case,
                sum(flexible.reduced.n_q for flexible in changed.bodies if hasattr(flexible, "reduced")),
                sum(6 + (flexible.reduced.n_q if hasattr(flexible, "reduced") else 0) for flexible in changed.bodies),
                {name: distance(columns[name], at[name], scale[name]) for name in compared},
                max(distance(columns[name], rich[name], scale[name]) for name in compared),
                max(distance(rich[name], at[name], scale[name]) for name in compared),
                here.seconds,
                here.notes,
            )
        )
    limit = max((settled[name] for name in compared), default=0.0) if settled else None
    return LaboratoryResult(system.name, told.words, tuple(compared), tuple(results), limit)


@contextmanager
def quiet() -> Iterator[None]:
    """Suppress log messages about frames and steps, which the table contains."""
    log = logging.getLogger("floatframe")
    level = log.level
    log.setLevel(logging.ERROR)
    try:
        yield
    finally:
        log.setLevel(level)


def compared_columns(reference: Reference, found: Sequence[Mapping[str, Array]]) -> list[str]:
    """Return the columns that exist in the reference and in every case, and that move in the reference."""
    everywhere = [name for name in reference.columns if all(name in columns for columns in found)]
    largest: dict[str, float] = {}
    for name in everywhere:
        sensor = name.rpartition(" ")[0]
        largest[sensor] = max(largest.get(sensor, 0.0), float(np.ptp(reference.columns[name])))
    moving = [name for name in everywhere
              if np.ptp(reference.columns[name]) > LEAST_RANGE * largest[name.rpartition(" ")[0]]]  # fmt: skip
    if not moving:
        known = ", ".join(found[0]) if found else "none"
        raise ModelError(
            f"study: expected a moving column of the reference among those of the sensors; the reference has "
            f"{', '.join(reference.columns)}, the sensors have {known}"
        )
    return moving


def distance(a: Array, b: Array, scale: float) -> float:
    """Return the root mean square of the difference divided by a scale; infinite if a motion is not finite."""
    if not (np.isfinite(a).all() and np.isfinite(b).all()):
        return float("inf")
    return float(np.sqrt(np.mean((a - b) ** 2)) / scale)


# the flexible body of a job in the description of a case: reduced as one, in parts, or not reduced at all -------------


class BodyShelf:
    """Reduced bodies of one job, each computed once for its case; a context manager with a folder for jobs of parts.

    The finite element model of a job is built and factorised once. All mode sets, numbers of modes and frames share its
    families, and vibration modes are computed once, for the case with the most modes. Cases with and without stiffening
    share one reduced body.
    """

    def __init__(self, job: str | Path, cut: str = "rigid", *, cases: Iterable[Case] = ()) -> None:
        """Store the job and the cases that may be requested; nothing is read yet."""
        self.job, self.cut = Path(job), cut
        self._most: dict[str, int] = {}
        for case in cases:
            self._most[case.mode_set] = max(case.n_modes, self._most.get(case.mode_set, 0))
        self._made: dict[tuple[str, int, str, int], tuple[ReducedBody, ...]] = {}
        self._families: dict[Path, Families] = {}
        self._begun: set[tuple[Path, str]] = set()
        self._states: dict[tuple[Path, str], UnitStates] = {}
        self._stack = ExitStack()
        self._folder = tempfile.TemporaryDirectory(prefix="laboratory-")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()
        self._folder.cleanup()

    def reduced(self, case: Case) -> tuple[ReducedBody, ...]:
        """Return the body, or its parts in their order.

        Raises
        ------
        CmsError, FeModelsError
            If the job cannot be reduced as the case requires, or cannot be cut into its number of parts.
        """
        key = (case.mode_set, case.n_modes, case.frame, case.parts)
        if key not in self._made:
            jobs = [self.job] if case.parts == 1 else self.part_jobs(case.parts)
            self._made[key] = tuple(self._reduced(path, case) for path in jobs)
        return self._made[key]

    def unreduced(self, asked: FullModel) -> ReducedBody:
        """Return the unreduced body with all its dofs.

        Raises
        ------
        CmsError, FeModelsError, ModelError
            If the job cannot be read, or the body has too many dofs.
        """
        families = self._families_of(self.job)
        modes = all_dofs(families.body, asked.most_dofs)
        job = changed_job(read_job(self.job), Case(frame="tisserand"))
        plan = Plan.of_stiffness(job, families.body)
        states = self._states_of(self.job, job, plan, families, 0)  # needed with any number of modes
        return reduced(job, plan, families, modes, states, Stages())

    def model(self) -> FEBody:
        """Return the coupled finite element model of the whole body."""
        return self._families_of(self.job).body

    def part_jobs(self, n: int) -> list[Path]:
        """Return the jobs of the parts, which are written at the first request."""
        folder = Path(self._folder.name) / f"parts_{n}"
        files = sorted(folder.glob("part_*.toml")) if folder.exists() else split_job(
            SplitRequest(self.job.resolve(), n, kind=self.cut, folder=folder))[:-1]  # fmt: skip
        return sorted(files, key=lambda path: int(path.stem.rpartition("_")[2]))

    def _reduced(self, path: Path, case: Case) -> ReducedBody:
        job = changed_job(read_job(path), case)
        families = self._families_of(path)
        most = self._most.get(case.mode_set, 0)
        if most > case.n_modes and (path, case.mode_set) not in self._begun:
            self._begun.add((path, case.mode_set))
            largest = job.model_copy(update={"reduction": job.reduction.model_copy(update={"n_modes": most})})
            with suppress(ReportedError):  # smaller cases take the first of these modes; too many fail below
                job_mode_set(families, reduction_of(largest, families.body))
        modes = job_mode_set(families, reduction_of(job, families.body))
        plan = Plan.of_stiffness(job, families.body)
        states = self._states_of(path, job, plan, families, len(modes.labels))
        return reduced(job, plan, families, modes, states, Stages())

    def _families_of(self, path: Path) -> Families:
        if path not in self._families:
            self._families[path] = self._stack.enter_context(Families(job_body(read_job(path))))
        return self._families[path]

    def _states_of(self, path: Path, job: Job, plan: Plan, families: Families, n_modes: int) -> UnitStates | None:
        """Return the static states for unit loads, which depend only on the frame; None if they are not required."""
        if not plan.needs_states(n_modes):
            return None
        require_geometric_stiffness(families.body)
        key = (path, repr((frame_of(job), job.reduction.geometric_stiffness)))
        if key not in self._states:
            self._states[key] = states_of_job(job, families)
        return self._states[key]


def changed_job(job: Job, case: Case) -> Job:
    """Return the job with mode set, number of modes and frame of a case, otherwise unchanged."""
    kind, _, at = case.frame.partition(":")
    section = job.reduction.model_dump(exclude_unset=True)
    for key in ("cutoff", "at", "dofs", "origin", "axes", "select"):
        section.pop(key, None)
    section |= {"set": case.mode_set, "n_modes": case.n_modes, "frame": kind, **({"at": at} if at else {})}
    return job.model_copy(update={"reduction": type(job.reduction).model_validate(section)})
