"""Mode sets of a comparison as tasks: a worker makes the body and its families once, and judges many parts with them.

What a part gives does not depend on those that its worker judged before.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cms.assessment.compare.comparison import SetResult
from cms.assessment.compare.coordinates import ReferenceBasis
from cms.assessment.compare.evaluation import Reference
from cms.assessment.compare.full_model import FullModel, read_full_model, reference_digest
from cms.assessment.compare.reference import reference_of
from cms.assessment.compare.set_result import SetPart, counts_of_parts, joined_parts, set_part
from cms.assessment.quality.reference.ports import Ports
from cms.modes.families.families import Families
from fe_models.body.fe_body import FEBody
from fe_models.foundation.tasks.task_map import WorkerError
from fe_models.foundation.tasks.workers import Workers, tasks_of

__all__ = ["SetJudge", "SetTask", "reference_basis", "set_results"]


@dataclass(frozen=True, eq=False)
class SetTask:
    """A mode set with some of the numbers of modes."""

    name: str
    options: Mapping[str, Any]
    counts: tuple[int, ...]


class SetJudge:
    """The function that judges a task; the body and all that follows from it stay in the worker for the next one.

    Parameters
    ----------
    source
        Makes the coupled body; can be sent to another process.
    cache
        Full path of the file with the solution of the full model.
    digest
        Of that solution.
    question
        Key of the question that it answers.
    damping
        Ratio of every mode in response and motion.
    """

    def __init__(self, source: Callable[[], FEBody], cache: str, digest: str, question: str, damping: float) -> None:
        self.given = (source, cache, digest, question, damping)
        self.made: tuple[Families, ReferenceBasis, Reference] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return SetJudge, self.given

    def __call__(self, task: SetTask) -> SetPart:
        """Return a part of a set, judged."""
        if self.made is None:
            self.made = self.make()
        self.made[0].forget_vibration_modes()
        return set_part(task.name, dict(task.options), task.counts, *self.made)

    def make(self) -> tuple[Families, ReferenceBasis, Reference]:
        """Return families of the body, the basis of the reference, and the reference."""
        source, cache, digest, question, damping = self.given
        body = source()
        if reference_digest(body, question) != digest:
            raise WorkerError("a worker makes another body of the same job; let all workers share the files of the job")
        full = read_full_model(Path(cache), digest)
        if full is None:
            raise WorkerError(f"{cache}: it has changed since this comparison began; start it again")
        families = Families(body)
        return families, reference_basis(families, full), reference_of(families, full, damping)


def reference_basis(families: Families, full: FullModel) -> ReferenceBasis:
    """Return the basis that all sets share."""
    ports = Ports.of_body(families.body)
    return ReferenceBasis(families, ports, full.columns, full.rigid.shape[1], float(full.omega2[0]))


def set_results(
    judge: SetJudge,
    options: Mapping[str, Mapping[str, Any]],
    counts: Sequence[int],
    workers: Workers,
    progress: Callable[[int, int], None] | None = None,
) -> list[SetResult]:
    """Return the results of all sets, whose parts are tasks for workers."""
    tasks = [SetTask(name, extra, part) for name, extra in options.items() for part in counts_of_parts(name, counts)]
    with tasks_of(workers, len(tasks), threads=None) as where:
        parts = where.map(judge, tasks, progress=progress, files=[os.path.abspath(judge.given[1])])
    return [
        joined_parts(name, [part for task, part in zip(tasks, parts, strict=True) if task.name == name])
        for name in options
    ]
