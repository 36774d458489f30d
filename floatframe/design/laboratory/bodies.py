"""The flexible body of a job in the description of a case: reduced as one, in parts, or not reduced at all."""

import tempfile
from collections.abc import Iterable
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import Self

from cms.body.reduced_body import ReducedBody
from cms.cli.split import SplitRequest, split_job
from cms.jobs.body_of_job import job_body
from cms.jobs.job import Job, read_job
from cms.jobs.mode_set_of_job import job_mode_set, reduction_of
from cms.jobs.parts_of_job import moving_frame_of
from cms.modes.families.families import Families
from cms.pipeline import Plan, reduced, states_of_job
from cms.reduction.geometric_stiffness.unit_states import UnitStates, require_geometric_stiffness
from fe_models.body.fe_body import FEBody
from fe_models.foundation.errors import ReportedError
from floatframe.design.laboratory.cases import Case
from floatframe.design.laboratory.full_model import FullModel, all_dofs

__all__ = ["BodyShelf"]


class BodyShelf:
    """Reduced bodies of one job by case, each made once; a context manager, whose folder has the jobs of parts.

    The finite element model of a job is built and factorised once: all mode sets, numbers of modes and frames share its
    families, and vibration modes are sought once, as many as the largest case asks for. With stiffening or without it
    is the same body.
    """

    def __init__(self, job: str | Path, cut: str = "rigid", *, cases: Iterable[Case] = ()) -> None:
        """Name the job, and the cases that will be asked for; nothing is read yet."""
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
            If the job cannot be reduced so, or cut into so many parts.
        """
        key = (case.mode_set, case.n_modes, case.frame, case.parts)
        if key not in self._made:
            jobs = [self.job] if case.parts == 1 else self.part_jobs(case.parts)
            self._made[key] = tuple(self._reduced(path, case) for path in jobs)
        return self._made[key]

    def unreduced(self, asked: FullModel) -> ReducedBody:
        """Return the body with all of its dofs.

        Raises
        ------
        CmsError, FeModelsError, ModelError
            If the job cannot be read, or the body has more dofs than may be.
        """
        families = self._families_of(self.job)
        modes = all_dofs(families.body, asked.most_dofs)
        job = changed_job(read_job(self.job), Case(frame="tisserand"))
        states = self._states_of(self.job, job, families, 0)  # of a reference however many modes there are
        return reduced(job, families, modes, states)

    def model(self) -> FEBody:
        """Return the coupled finite element model of the whole body."""
        return self._families_of(self.job).body

    def part_jobs(self, n: int) -> list[Path]:
        """Return the jobs of the parts, written on first use."""
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
            with suppress(ReportedError):  # found once, the others are its first ones; too many are told where they are
                job_mode_set(families, reduction_of(largest, families.body))
        modes = job_mode_set(families, reduction_of(job, families.body))
        return reduced(job, families, modes, self._states_of(path, job, families, len(modes.labels)))

    def _families_of(self, path: Path) -> Families:
        if path not in self._families:
            self._families[path] = self._stack.enter_context(Families(job_body(read_job(path))))
        return self._families[path]

    def _states_of(self, path: Path, job: Job, families: Families, n_modes: int) -> UnitStates | None:
        """Return the static states of the unit loads, which differ by the frame alone; None where none are wanted."""
        if not Plan.of_stiffness(job, families.body).needs_states(n_modes):
            return None
        require_geometric_stiffness(families.body)
        key = (path, repr((moving_frame_of(job), job.reduction.geometric_stiffness)))
        if key not in self._states:
            self._states[key] = states_of_job(job, families)
        return self._states[key]


def changed_job(job: Job, case: Case) -> Job:
    """Return the job with mode set, number of modes and frame of a case; the rest stays as it is."""
    kind, _, at = case.frame.partition(":")
    section = job.reduction.model_dump(exclude_unset=True)
    for key in ("cutoff", "at", "dofs", "origin", "axes", "select"):
        section.pop(key, None)
    section |= {"set": case.mode_set, "n_modes": case.n_modes, "frame": kind, **({"at": at} if at else {})}
    return job.model_copy(update={"reduction": type(job.reduction).model_validate(section)})
