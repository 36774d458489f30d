"""Compare mode sets of one body with its full model, each with several numbers of vibration modes."""

import os
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from importlib import metadata
from pathlib import Path
from typing import Any

import numpy as np

from cms.assessment.compare.comparison import Comparison, Drawing, SetResult
from cms.assessment.compare.coordinates import ReferenceBasis
from cms.assessment.compare.evaluation import SharedReference
from cms.assessment.compare.full_model import ReferenceSolution, read_full_model, reference_digest
from cms.assessment.compare.pulse import default_pulse
from cms.assessment.compare.reference import Question, full_results, reference_of, solution
from cms.assessment.compare.set_result import SetPart, counts_of_parts, joined_parts, set_part
from cms.assessment.compare.verdicts import answer, ranking
from cms.assessment.quality.reference.ports import Ports
from cms.assessment.quality.reference.transient import Snapshots
from cms.assessment.rendering.shape import surface_edges
from cms.errors import CompareError
from cms.modes.families.families import Families
from cms.modes.mode_sets import MODE_SETS
from cms.reduction.error_estimates import DAMPING
from fe_models.body.fe_body import FEBody
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.ranks.spread_matrix import whole_matrix
from fe_models.foundation.tasks.task_map import WorkerError
from fe_models.foundation.tasks.workers import Workers, tasks_of
from fe_models.foundation.words import nearest, quoted

__all__ = ["SetJudge", "SetTask", "compare_sets", "draw_modes", "reference_basis", "set_results", "thinned_surface"]


Stage = Callable[[str], AbstractContextManager[Any]]


def compare_sets(
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
    """Assess mode sets with several numbers of vibration modes against the full model.

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
        Highest frequency [Hz]; None: the frequency of elastic free mode n_reference.
    n_reference
        Number of elastic free modes in the band, where no band is given.
    damping
        Ratio of every mode in response and motion.
    pulse_at
        Interface on which the force pulse acts; by default the first.
    motion
        Reference motion for the deformation error; the response to the pulse by default.
    cache
        File that stores the solution of the full model for the next comparison; None: the solution is not stored.
    stage
        Function that is called with the name of each stage and returns a context manager for this stage.
    workers
        Workers that assess sets and numbers of modes (docs/cluster.md); each makes its own factorisation. None: this
        process assesses them, with the factorisation that solved the full model.
    source
        Function that makes the body; workers need it and `cache`.

    Raises
    ------
    CompareError
        If a set is unknown, no count is given, or the band holds no mode. A set that cannot be computed does not raise
        an error: its result gives the reason.
    BodyError
        If the body is a mechanism or not free.
    WorkerError
        If no workers are available.
    """
    if workers is not None and (source is None or cache is None):
        raise CompareError("workers: expected source, a function that makes the body, and cache")
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
                    results.append(joined_parts(name, [set_part(name, extra, counts, families, basis, reference)]))
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
    """Raise an error before any computation if the requested comparison is impossible."""
    if not options:
        raise CompareError(f"sets: expected at least one mode set; choices: {', '.join(sorted(MODE_SETS))}")
    for name in options:
        if name not in MODE_SETS:
            raise CompareError(f"sets: unknown mode set {quoted(name)}{nearest(name, MODE_SETS)}")
    if not counts or min(counts) < 0:
        raise CompareError(f"modes: expected numbers of modes, 0 or more, got {list(counts)}")


def progress_of(advance: Any) -> Callable[[int, int], None] | None:
    """Return the progress callback of a stage that reports its finished fraction; None without progress display."""
    return (lambda done, all_: advance(done / all_)) if callable(advance) else None


def provenance(body: FEBody) -> dict[str, str]:
    """Return a record of the source of the body and of the program versions."""
    versions = {f"version {name}": metadata.version(name) for name in ("numpy", "scipy")}
    try:
        versions["version floatframe"] = metadata.version("floatframe")
    except metadata.PackageNotFoundError:  # the program runs from a checkout that is not installed
        versions["version floatframe"] = "unknown"
    return {**dict(body.provenance), "version python": platform.python_version(), **versions}


class _Clock:
    """Times of the stages, together with the progress display of the caller."""

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


# surface of a body and its free modes, thinned to the resolution of a screen ------------------------------------------


MOST_TRIANGLES = 16_000  #: largest number of triangles of a surface on the screen
MOST_LINES = 20_000  #: largest number of lines of a body without a surface


def draw_modes(body: FEBody, Phi: Array) -> Drawing:
    """Return the surface of a body, or its lines if it has no surface, with the free modes.

    Parameters
    ----------
    Phi
        Modes over the dofs of the body, (n_dof, n_modes).
    """
    moved = np.moveaxis(body.translations(Phi), 2, 0)
    triangles = thinned_surface(body.nodes, body.surface)
    lines = sharp_edges(body.nodes, triangles) if len(triangles) else stiffness_lines(body)
    used, inverse = np.unique(np.concatenate([triangles.ravel(), lines.ravel()]), return_inverse=True)
    shapes = moved[:, used]
    largest = np.linalg.norm(shapes, axis=2).max(axis=1, initial=0.0)
    shapes = shapes / np.where(largest > 0, largest, 1.0)[:, None, None]
    return Drawing(
        nodes=body.nodes[used],
        triangles=inverse[: triangles.size].reshape(-1, 3).astype(np.int64),
        lines=inverse[triangles.size :].reshape(-1, 2).astype(np.int64),
        shapes=shapes,
        n_triangles_full=len(body.surface),
    )


def sharp_edges(nodes: Array, triangles: IntArray) -> IntArray:
    """Return the sharp edges of a surface as pairs of nodes, (n_lines, 2)."""
    ends, _, is_sharp = surface_edges(nodes, triangles)
    return ends[is_sharp]


def thinned_surface(nodes: Array, triangles: IntArray, most: int = MOST_TRIANGLES) -> IntArray:
    """Return at most about `most` triangles, whose corners are some of the given nodes, (n_tri, 3)."""
    if len(triangles) <= most:
        return triangles
    import pyvista as pv

    faces = np.hstack([np.full((len(triangles), 1), 3), triangles])
    mesh = pv.PolyData(nodes, faces.ravel())
    mesh.point_data["node"] = np.arange(len(nodes))
    thin = mesh.clean().decimate_pro(1 - most / len(triangles), preserve_topology=False)
    of_point = np.asarray(thin.point_data["node"]).round().astype(np.int64)
    return np.asarray(of_point[thin.faces.reshape(-1, 4)[:, 1:]])


def stiffness_lines(body: FEBody) -> IntArray:
    """Return pairs of nodes that a stiffness connects, (n_lines, 2): the elements of a body of beams or springs."""
    rows = whole_matrix(body.K).tocoo()
    node = body.dofs[:, 0]
    a, b = node[rows.row], node[rows.col]
    pairs = np.unique(np.stack([a, b], axis=1)[a < b], axis=0)
    has_length = np.linalg.norm(body.nodes[pairs[:, 0]] - body.nodes[pairs[:, 1]], axis=1) > 0 if len(pairs) else []
    pairs = pairs[has_length] if len(pairs) else pairs
    return pairs[:MOST_LINES].astype(np.int64)


# mode sets of a comparison as tasks: a worker makes the body and its families once, and assesses many parts with them.
# The result of a part does not depend on earlier parts of its worker.


@dataclass(frozen=True, eq=False)
class SetTask:
    """Task of a worker: a mode set with some of the numbers of modes."""

    name: str
    options: Mapping[str, Any]
    counts: tuple[int, ...]


class SetJudge:
    """Function that assesses a task; the body and all derived data remain in the worker for the next task.

    Parameters
    ----------
    source
        Function that makes the coupled body; it can be sent to another process.
    cache
        Full path of the file with the solution of the full model.
    digest
        Digest of this solution.
    question
        Key of the request for this solution.
    damping
        Ratio of every mode in response and motion.
    """

    def __init__(self, source: Callable[[], FEBody], cache: str, digest: str, question: str, damping: float) -> None:
        self.given = (source, cache, digest, question, damping)
        self.made: tuple[Families, ReferenceBasis, SharedReference] | None = None

    def __reduce__(self) -> tuple[Any, ...]:
        return SetJudge, self.given

    def __call__(self, task: SetTask) -> SetPart:
        """Assess one part of a mode set."""
        if self.made is None:
            self.made = self.make()
        self.made[0].forget_vibration_modes()
        return set_part(task.name, dict(task.options), task.counts, *self.made)

    def make(self) -> tuple[Families, ReferenceBasis, SharedReference]:
        """Return the mode families of the body, the reference basis, and the reference."""
        source, cache, digest, question, damping = self.given
        body = source()
        if reference_digest(body, question) != digest:
            raise WorkerError("a worker made a different body from this job; let all workers read the same files")
        full = read_full_model(Path(cache), digest)
        if full is None:
            raise WorkerError(f"{cache}: it has changed since this comparison began; start it again")
        families = Families(body)
        return families, reference_basis(families, full), reference_of(families, full, damping)


def reference_basis(families: Families, full: ReferenceSolution) -> ReferenceBasis:
    """Return the reference basis that all sets share."""
    ports = Ports.of_body(families.body)
    return ReferenceBasis(families, ports, full.columns, full.rigid.shape[1], float(full.omega2[0]))


def set_results(
    judge: SetJudge,
    options: Mapping[str, Mapping[str, Any]],
    counts: Sequence[int],
    workers: Workers,
    progress: Callable[[int, int], None] | None = None,
) -> list[SetResult]:
    """Return the results of all sets. Their parts are tasks for the workers."""
    tasks = [SetTask(name, extra, part) for name, extra in options.items() for part in counts_of_parts(name, counts)]
    with tasks_of(workers, len(tasks), threads=None) as where:
        parts = where.map(judge, tasks, progress=progress, files=[os.path.abspath(judge.given[1])])
    return [
        joined_parts(name, [part for task, part in zip(tasks, parts, strict=True) if task.name == name])
        for name in options
    ]
