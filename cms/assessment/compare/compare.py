"""Compare mode sets of one body with its full model, each with several numbers of vibration modes."""

import platform
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from importlib import metadata
from pathlib import Path
from typing import Any

from cms.assessment.compare.comparison import Comparison
from cms.assessment.compare.drawing import draw_modes
from cms.assessment.compare.pulse import default_pulse
from cms.assessment.compare.reference import Question, full_results, reference_of, solution
from cms.assessment.compare.set_result import set_result
from cms.assessment.compare.set_tasks import SetJudge, reference_basis, set_results
from cms.assessment.compare.verdicts import answer, ranking
from cms.assessment.quality.of_reduction.frf import DAMPING
from cms.assessment.quality.reference.transient import Snapshots
from cms.errors import CompareError
from cms.modes.families.families import Families
from cms.modes.mode_sets import MODE_SETS
from fe_models.body.fe_body import FEBody
from fe_models.foundation.tasks.workers import Workers
from fe_models.foundation.words import nearest, quoted

__all__ = ["compare"]

Stage = Callable[[str], AbstractContextManager[Any]]


def compare(
    body: FEBody,
    sets: Sequence[str] | Mapping[str, Mapping[str, Any]],
    counts: Sequence[int],
    *,
    band: float | None = None,
    n_reference: int = 10,
    damping: float = DAMPING,
    pulse_at: str | None = None,
    motion: Snapshots | None = None,
    cache: Path | None = None,
    stage: Stage | None = None,
    workers: Workers = None,
    source: Callable[[], FEBody] | None = None,
) -> Comparison:
    """Judge mode sets with several numbers of vibration modes against the full model.

    (1) the full model once: free modes, static responses, response of the interfaces, a short motion
    (2) every set once, with the most modes, from the same families and their one factorisation
    (3) all of it in small coordinates, where the sets with fewer modes are subspaces
    (4) records of every subspace; verdicts from the records

    Parameters
    ----------
    body
        A coupled body with an interface.
    sets
        Names in `MODE_SETS`, or name -> options other than n_modes.
    counts
        Numbers of vibration modes.
    band
        Highest frequency [Hz]; None: that of elastic free mode n_reference.
    n_reference
        Number of elastic free modes in the band, where no band is given.
    damping
        Ratio of every mode in response and motion.
    pulse_at
        Interface the force pulse of the motion acts on; the first by default.
    motion
        Reference motion for the deformation error; the response to the pulse by default.
    cache
        File that keeps the solution of the full model for the next comparison; None: nothing is kept.
    stage
        Called with the name of each stage, gives a context manager around it.
    workers
        Where sets and numbers of modes are judged (docs/cluster.md), with a factorisation in every worker; None: here,
        with the one that solved the full model.
    source
        Makes the body; sent to the workers, which need it and a cache.

    Raises
    ------
    CompareError
        If a set is unknown, no count is given, or the band holds no mode. A set that cannot be made does not raise: its
        result says why.
    BodyError
        If the body is a mechanism or not free.
    WorkerError
        If no workers can be had.
    """
    if workers is not None and (source is None or cache is None):
        raise CompareError("workers: they need source, a function that makes the body, and a cache")
    options = {name: dict(sets[name]) if isinstance(sets, Mapping) else {} for name in sets}
    check_request(options, counts)
    question = Question(default_pulse(body, pulse_at), damping, band, n_reference, motion)
    clock = _Clock(stage)
    with Families(body) as families:
        with clock("full model"):
            solved = solution(families, question, n_expected=max(counts), cache=cache)
            full = solved.full
            reference = reference_of(families, full, damping)
        results = []
        if workers is None:
            basis = reference_basis(families, full)
            for name, extra in options.items():
                with clock(name):
                    results.append(set_result(name, extra, counts, families, basis, reference))
    if source is not None and cache is not None and workers is not None:
        judge = SetJudge(source, str(cache.absolute()), solved.digest, question.key, damping)
        with clock("mode sets") as advance:
            results = set_results(judge, options, counts, workers, progress_of(advance))
    order = ranking(results)
    with clock("surface"):
        drawing = draw_modes(body, full.Phi)
    return Comparison(
        name=body.name,
        units=body.units,
        n_dof=body.n_dof,
        n_nodes=len(body.nodes),
        interfaces=tuple((i.name, i.kind, len(i.nodes)) for i in body.interfaces),
        full=full_results(reference, question, solved),
        sets=tuple(results),
        ranking=order,
        sentence=answer(results, order, full.band / body.units.time),
        drawing=drawing,
        seconds=clock.seconds,
        provenance=provenance(body),
    )


def check_request(options: Mapping[str, Any], counts: Sequence[int]) -> None:
    """Refuse what cannot be compared, before any work."""
    if not options:
        raise CompareError(f"sets: expected at least one mode set; choices: {', '.join(sorted(MODE_SETS))}")
    for name in options:
        if name not in MODE_SETS:
            raise CompareError(f"sets: unknown mode set {quoted(name)}{nearest(name, MODE_SETS)}")
    if not counts or min(counts) < 0:
        raise CompareError(f"modes: expected numbers of modes, 0 or more, got {list(counts)}")


def progress_of(advance: Any) -> Callable[[int, int], None] | None:
    """Return what shows the progress of a stage that takes the finished fraction, if it takes one."""
    return (lambda done, all_: advance(done / all_)) if callable(advance) else None


def provenance(body: FEBody) -> dict[str, str]:
    """Record where the body came from, and versions."""
    versions = {f"version {name}": metadata.version(name) for name in ("numpy", "scipy")}
    try:
        versions["version floatframe"] = metadata.version("floatframe")
    except metadata.PackageNotFoundError:  # run from a checkout that is not installed
        versions["version floatframe"] = "unknown"
    return {**dict(body.provenance), "version python": platform.python_version(), **versions}


class _Clock:
    """Seconds of the stages, beside what the caller shows of them."""

    def __init__(self, stage: Stage | None) -> None:
        self.seconds: dict[str, float] = {}
        self._stage = stage or (lambda name: nullcontext())

    def __call__(self, name: str) -> "_Timed":
        return _Timed(self, name, self._stage(name))


class _Timed:
    def __init__(self, clock: _Clock, name: str, inner: AbstractContextManager[Any]) -> None:
        self._clock, self._name, self._inner = clock, name, inner

    def __enter__(self) -> Any:
        self._began = time.perf_counter()
        return self._inner.__enter__()

    def __exit__(self, *failure: Any) -> None:
        self._inner.__exit__(*failure)
        self._clock.seconds[self._name] = time.perf_counter() - self._began
