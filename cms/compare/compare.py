"""Compare mode sets of one body with its full model, each with several numbers of vibration modes."""

import inspect
import platform
import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import replace
from importlib import metadata
from pathlib import Path
from typing import Any, Literal

import numpy as np

from cms.arrays import Array
from cms.compare.comparison import Comparison, FullResults, Point, SetResult
from cms.compare.coordinates import Coordinates, ReferenceBasis
from cms.compare.drawing import draw_modes
from cms.compare.evaluation import Reference, drawn_entry, judge_subset
from cms.compare.free_shapes import judged_subset
from cms.compare.full_model import (
    FullModel,
    read_full_model,
    reference_digest,
    solve_full_model,
    static_labels,
    write_full_model,
)
from cms.compare.pulse import Pulse, default_pulse
from cms.compare.subsets import SUBSETS
from cms.compare.verdicts import answer, is_good, ranking, set_sentence, shown_point
from cms.errors import CmsError, CompareError, ModeSetError
from cms.families import Families
from cms.fe_body import FEBody
from cms.mode_set import ModeSet
from cms.mode_sets import MODE_SETS
from cms.quality.frf import DAMPING, LOWEST, frequency_grid
from cms.quality.port_model import FrequencyResponse, modal_response
from cms.quality.ports import Ports
from cms.quality.transient import Snapshots
from cms.words import nearest

__all__ = ["compare"]

POINTS = 800  #: frequencies of the response: peaks are drawn round
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

    Raises
    ------
    CompareError
        If a set is unknown, no count is given, or the band holds no mode. A set that cannot be made does not raise: its
        result says why.
    BodyError
        If the body is a mechanism or not free.
    """
    options = {name: dict(sets[name]) if isinstance(sets, Mapping) else {} for name in sets}
    check_request(options, counts, band, n_reference, damping)
    clock = _Clock(stage)
    pulse = default_pulse(body, pulse_at)
    with Families(body) as families:
        with clock("full model"):
            full, was_cached, digest = full_model(families, pulse, band, n_reference, damping, motion, cache)
            reference = reference_of(families, full, damping)
            basis = ReferenceBasis(
                families, Ports.of_body(body), full.columns, full.rigid.shape[1], float(full.omega2[0])
            )
        results = []
        for name, extra in options.items():
            with clock(name):
                results.append(set_result(name, extra, counts, families, basis, reference))
    order = ranking(results)
    with clock("surface"):
        drawing = draw_modes(body, full.Phi)
    return Comparison(
        name=body.name,
        units=body.units,
        n_dof=body.n_dof,
        n_nodes=len(body.nodes),
        interfaces=tuple((i.name, i.kind, len(i.nodes)) for i in body.interfaces),
        full=full_results(
            reference, full, damping, was_cached=was_cached, digest=digest,
            motion=motion_words(pulse, full, body) if motion is None else "a given motion",
            force=pulse.force(full.t, full.band) if motion is None else None,
        ),
        sets=tuple(results),
        ranking=order,
        sentence=answer(results, order, full.band / body.units.time),
        drawing=drawing,
        seconds=clock.seconds,
        provenance=provenance(body, families),
    )  # fmt: skip


def reference_of(families: Families, full: FullModel, damping: float) -> Reference:
    """Return what every set is judged by."""
    body = families.body
    time_ = body.units.time
    names = tuple(interface.name for interface in body.interfaces)
    grid = frequency_grid(LOWEST * float(full.frequencies[0]) / time_, full.band / time_, POINTS)
    response = modal_response(full.ports(names), grid, damping=damping, time=time_)
    return Reference(
        full=full,
        response=response,
        drawn=drawn_entry(response),
        damping=damping,
        port_names=names,
        static_labels=static_labels(families, full),
        length=body.length or 1.0,
        time=time_,
    )


def full_results(
    reference: Reference,
    full: FullModel,
    damping: float,
    *,
    was_cached: bool,
    digest: str,
    motion: str,
    force: Array | None,
) -> FullResults:
    """Return what reports show of the full model."""
    response: FrequencyResponse = reference.response
    out, into = reference.drawn
    return FullResults(
        frequencies_hz=full.frequencies / reference.time,
        n_band=full.n_band,
        band_hz=full.band / reference.time,
        response_hz=response.frequencies,
        response=np.abs(response.H[:, out, into]),
        response_words=f"force at {place(response.inputs[into])}, displacement at {place(response.outputs[out])}",
        response_error=full.port_error,
        damping=damping,
        t=full.t * reference.time,
        force=force,
        motion_words=motion,
        mass=full.mass,
        held_mass=full.held_mass,
        was_cached=was_cached,
        digest=digest,
    )


def place(label: str) -> str:
    """Return 'small_end along z' of 'small_end uz'."""
    name, component = label.rsplit(" ", 1)
    return f"{name} {'about' if component.startswith('r') else 'along'} {component[-1]}"


def motion_words(pulse: Pulse, full: FullModel, body: FEBody) -> str:
    """Say what moves the body."""
    return f"{pulse.words}, {1e3 * pulse.duration(full.band) * body.units.time:.3g} ms long"


def check_request(
    options: Mapping[str, Any], counts: Sequence[int], band: float | None, n_reference: int, damping: float
) -> None:
    """Refuse what cannot be compared, before any work."""
    if not options:
        raise CompareError(f"sets: expected at least one mode set; choices: {', '.join(sorted(MODE_SETS))}")
    for name in options:
        if name not in MODE_SETS:
            raise CompareError(f"sets: unknown mode set {name!r}{nearest(name, MODE_SETS)}")
    if not counts or min(counts) < 0:
        raise CompareError(f"modes: expected numbers of modes, 0 or more, got {list(counts)}")
    if band is not None and not (np.isfinite(band) and band > 0):
        raise CompareError(f"band: expected a frequency above 0 Hz, got {band:g}")
    if n_reference < 1:
        raise CompareError(f"reference modes: expected 1 or more, got {n_reference}")
    if not 0 < damping < 1:
        raise CompareError(f"damping: expected a ratio between 0 and 1 (0.02 is 2 %), got {damping:g}")


def full_model(
    families: Families,
    pulse: Pulse,
    band: float | None,
    n_reference: int,
    damping: float,
    motion: Snapshots | None,
    cache: Path | None,
) -> tuple[FullModel, bool, str]:
    """Return the solution of the full model, whether it was found in the cache, and its digest."""
    body = families.body
    given = None if motion is None else [part.tobytes() for part in (motion.columns, motion.amplitudes, motion.t)]
    digest = reference_digest(body, band, n_reference, damping, pulse.at, given)
    found = None if cache is None else read_full_model(cache, digest)
    if found is not None:
        return found, True, digest
    scaled = None if band is None else band * body.units.time  # cycles per time unit
    full = solve_full_model(families, pulse, n_modes=n_reference, band=scaled, damping=damping, motion=motion)
    if cache is not None:
        write_full_model(cache, full, digest)
    return full, False, digest


def set_result(
    name: str,
    options: Mapping[str, Any],
    counts: Sequence[int],
    families: Families,
    basis: ReferenceBasis,
    reference: Reference,
) -> SetResult:
    """Return the result of one set; where it cannot be made, its sentence says why."""
    began = time.perf_counter()
    words = first_sentence(MODE_SETS[name].__doc__)
    try:
        points, columns, refused = judged_points(name, options, counts, families, basis, reference)
    except (CmsError, np.linalg.LinAlgError) as error:
        return SetResult(name, words, (), None, "error", f"could not be made: {error}")
    shown = shown_point(points)
    kept = tuple(point if k == shown else without_curves(point) for k, point in enumerate(points))
    verdict: Literal["pass", "fail"] = "pass" if any(point.is_good for point in points) else "fail"
    chosen = columns[shown] if shown is not None else {}
    return SetResult(
        name, words, kept, shown, verdict, set_sentence(points) + refused, chosen, time.perf_counter() - began
    )


def judged_points(
    name: str,
    options: Mapping[str, Any],
    counts: Sequence[int],
    families: Families,
    basis: ReferenceBasis,
    reference: Reference,
) -> tuple[list[Point], list[dict[str, int]], str]:
    """Return the points of one set, the number of columns of each family in each, and words about those refused."""
    make = MODE_SETS[name]
    takes = inspect.signature(make).parameters
    body = families.body
    asked = sorted(set(counts)) if "n_modes" in takes else [0]
    points: list[Point] = []
    families_of_columns: list[dict[str, int]] = []
    refused: dict[int, str] = {}

    def made(n_modes: int) -> ModeSet:
        counted = {"n_modes": n_modes} if "n_modes" in takes else {}
        return make(body, **counted, **options, families=families)

    def judge(n_modes: int, c: Coordinates, T: Array, labels: tuple[str, ...], groups: Sequence[str]) -> None:
        rigid = c.reference[:, reference.full.parts["rigid"]]
        subset = judged_subset(c, T, labels, rigid, basis.omega2)
        records = judge_subset(reference, c, subset)
        points.append(Point(n_modes, len(labels), subset.n_q, subset.basis.dropped, records, is_good(records)))
        families_of_columns.append({group: list(groups).count(group) for group in dict.fromkeys(groups)})

    most: tuple[ModeSet, Coordinates] | None = None
    for n_modes in reversed(asked):
        try:
            if most is None or name not in SUBSETS:
                modes = made(n_modes)
                most = modes, basis.coordinates(modes.columns)
            modes, c = most
            if name in SUBSETS:
                C, labels = SUBSETS[name](modes, np.asarray(modes.columns[body.b]), n_modes)
                group_of = dict(zip(modes.labels, modes.groups, strict=True))
                judge(n_modes, c, c.columns @ C, labels, [group_of[label] for label in labels])
            else:
                judge(n_modes, c, c.columns, modes.labels, modes.groups)
        except CmsError as error:
            refused[n_modes] = str(error)
    if not points:
        raise ModeSetError("; ".join(dict.fromkeys(refused.values())))
    return points[::-1], families_of_columns[::-1], refused_words(refused)


def refused_words(refused: Mapping[int, str]) -> str:
    """Say which numbers of modes could not be had; the first reason stands for all."""
    if not refused:
        return ""
    numbers = ", ".join(str(n) for n in sorted(refused))
    return f"; not possible with {numbers}: {refused[max(refused)]}"


def without_curves(point: Point) -> Point:
    """Return the point with the values and sentences of its records; frequencies and effective masses stay."""
    kept = ("frequency-error", "effective-mass")
    records = (record if record.name in kept else replace(record, data={}) for record in point.records)
    return replace(point, records=tuple(records))


def first_sentence(text: str | None) -> str:
    """Return the first line of a docstring without its marks."""
    line = (text or "").strip().split("\n")[0]
    return line.split(" [1]_")[0].rstrip(".")


def provenance(body: FEBody, families: Families) -> dict[str, str]:
    """Record where the body came from, the solver, and versions."""
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

    def __enter__(self) -> None:
        self._began = time.perf_counter()
        self._inner.__enter__()

    def __exit__(self, *failure: Any) -> None:
        self._inner.__exit__(*failure)
        self._clock.seconds[self._name] = time.perf_counter() - self._began
