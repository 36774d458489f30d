"""The flexible body of a job in the description of a case: reduced as one, or in parts."""

import tempfile
from pathlib import Path
from typing import Self

from cms.cli.split import SplitRequest, split_job
from cms.jobs.job import Job, read_job
from cms.jobs.reduce_job import reduce_job
from cms.reduced_body.reduced_body import ReducedBody
from floatframe.laboratory.cases import Case

__all__ = ["BodyShelf"]


class BodyShelf:
    """Reduced bodies of one job by case, each made once; a context manager, whose folder has the jobs of parts.

    With stiffening or without it is the same body.
    """

    def __init__(self, job: str | Path, cut: str = "rigid") -> None:
        """Name the job; nothing is read yet."""
        self.job, self.cut = Path(job), cut
        self._made: dict[tuple[str, int, str, int], tuple[ReducedBody, ...]] = {}
        self._folder = tempfile.TemporaryDirectory(prefix="laboratory-")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
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
            self._made[key] = tuple(reduce_job(changed_job(read_job(path), case)) for path in jobs)
        return self._made[key]

    def part_jobs(self, n: int) -> list[Path]:
        """Return the jobs of the parts, written on first use."""
        folder = Path(self._folder.name) / f"parts_{n}"
        files = sorted(folder.glob("part_*.toml")) if folder.exists() else split_job(
            SplitRequest(self.job.resolve(), n, kind=self.cut, folder=folder))[:-1]  # fmt: skip
        return sorted(files, key=lambda path: int(path.stem.rpartition("_")[2]))


def changed_job(job: Job, case: Case) -> Job:
    """Return the job with mode set, number of modes and frame of a case; the rest stays as it is."""
    kind, _, at = case.frame.partition(":")
    section = job.reduction.model_dump(exclude_unset=True)
    for key in ("cutoff", "at", "dofs", "origin", "axes", "select"):
        section.pop(key, None)
    section |= {"set": case.mode_set, "n_modes": case.n_modes, "frame": kind, **({"at": at} if at else {})}
    return job.model_copy(update={"reduction": type(job.reduction).model_validate(section)})
