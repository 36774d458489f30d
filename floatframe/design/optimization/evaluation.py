"""One evaluation of a design: the values of objectives and constraints, or the reason why they do not exist."""

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from fe_models.foundation.arrays import Array
from fe_models.foundation.tasks.campaign import TaskJournal, campaign_digest, open_task_journal
from fe_models.foundation.tasks.notes import recorded_notes
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.linear.frequency_response import resolved_frequencies
from floatframe.analyses.linear.linearization import LinearSystem, linearize
from floatframe.analyses.linear.system_modes import system_modes
from floatframe.design.optimization.design import Design, Quantity
from floatframe.design.studies.study import StudyPoint, column_of, output_value, output_value_of_modes
from floatframe.errors import ModelError, ResultsError
from floatframe.files.system_file.bodies import ReadBodies
from floatframe.model.system import System
from floatframe.results.trajectory import Trajectory

__all__ = [
    "Evaluation",
    "EvaluationFunction",
    "open_journal",
    "residuals",
    "response_number",
    "scalar",
    "terms",
    "violations",
]


# evaluation -----------------------------------------------------------------------------------------------------------


# responses ------------------------------------------------------------------------------------------------------------
# Numbers from frequency responses: the largest, smallest or mean amplitude in a band, or the amplitude at one
# frequency.


GRID = 120  #: number of equidistant frequencies in a band, in addition to those near its resonances
LIKELY = (
    0.8  #: amplitude on the grid, relative to the best, above which an extreme between the neighbours is searched for
)


def response_number(quantity: Quantity, linear: LinearSystem, per_second: float) -> float:
    """Return the number that a quantity takes from the amplitude of a frequency response.

    The extremes of a band are found on a grid that is fine near resonances, then refined between the grid points, so
    that the number changes smoothly with the parameters.

    Parameters
    ----------
    quantity
        A quantity of the analysis "response", of "OUTPUT / INPUT".
    linear
        The linear system with the inputs and outputs of the system file.
    per_second
        Factor from frequencies of the system to Hz.
    """
    amplitude = amplitude_of(quantity, linear, per_second)
    if quantity.at is not None:
        return float(amplitude(np.array([quantity.at]))[0])
    assert quantity.band is not None  # by `read_design`
    first, last = quantity.band
    f = resolved_frequencies(linear, first / per_second, last / per_second, n=GRID) * per_second
    a = amplitude(f)
    take = quantity.output.take
    if take in ("mean", "rms"):
        mean = np.trapezoid(a if take == "mean" else a**2, f) / (last - first)
        return float(mean if take == "mean" else np.sqrt(mean))
    return extreme(amplitude, f, a, 1.0 if take == "greatest" else -1.0)


def amplitude_of(quantity: Quantity, linear: LinearSystem, per_second: float) -> Callable[[Array], Array]:
    """Return the amplitude over frequencies in Hz; `ModelError` if there is no such output or input."""
    of = quantity.output.of
    names = of.split(" / ")
    if len(names) != 2:
        raise ModelError(f'{quantity.output.name}: of = {of!r}: expected "OUTPUT / INPUT" for a frequency response')
    places = []
    for name, known, kind in zip(names, (linear.outputs, linear.inputs), ("output", "input"), strict=True):
        if name not in known:
            hint = nearest(name, known) or f"; it has {', '.join(known) or 'none'}"
            raise ModelError(f"{quantity.output.name}: of = {of!r}: the system has no {kind} {quoted(name)}{hint}")
        places.append(known.index(name))
    i, j = places
    return lambda f: np.abs(linear.response(np.asarray(f) / per_second)[:, i, j])


def extreme(amplitude: Callable[[Array], Array], f: Array, a: Array, sign: float) -> float:
    """Return the largest (sign 1) or smallest (-1) amplitude, including extremes between the points of the grid."""
    from scipy.optimize import minimize_scalar

    best = float((sign * a).max())
    limit = LIKELY * best if sign > 0 else best / LIKELY
    for k in range(1, len(f) - 1):
        if sign * a[k] >= limit and sign * a[k] >= sign * a[k - 1] and sign * a[k] >= sign * a[k + 1]:
            found = minimize_scalar(
                lambda x: -sign * amplitude(np.array([x]))[0], bounds=(f[k - 1], f[k + 1]), method="bounded",
                options={"xatol": 1e-9 * f[k]},
            )  # fmt: skip
            best = max(best, -float(found.fun))
    return sign * best


# evaluation -----------------------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Evaluation:
    """Values of the parameters and the resulting numbers."""

    values: tuple[float, ...]  #: values of the parameters
    numbers: tuple[tuple[float, ...], ...] = ()  #: of each objective and constraint: one, or one per table time
    error: str = ""  #: reason why there are no numbers
    is_lasting: bool = True  #: whether another attempt would give the same error; False if the process was killed
    notes: tuple[str, ...] = ()  #: warnings


@dataclass(frozen=True)
class EvaluationFunction:
    """The function that computes an evaluation; it can be sent to another process."""

    design: Design
    read_bodies: ReadBodies = field(default_factory=dict, compare=False, repr=False)  #: kept from call to call

    def __call__(self, values: tuple[float, ...]) -> Evaluation:
        """Return the numbers at these values of the parameters."""
        with recorded_notes() as notes:
            numbers = self.numbers(values)
        return Evaluation(values, numbers, notes=tuple(notes))

    def numbers(self, values: tuple[float, ...]) -> tuple[tuple[float, ...], ...]:
        """Return the numbers of each objective and constraint."""
        from floatframe.files.system_file.read_system import read_system
        from floatframe.files.system_file.run_section import formulation_of

        design = self.design
        changes = design.study.changes(design.point(values))
        system, given = read_system(design.study.system, changes, read_bodies=self.read_bodies)
        found: dict[str, Any] = {}
        if {"modes", "response"} & set(design.analyses):
            found["response"] = linear = linearize(system, formulation=formulation_of(given))
            found["modes"] = system_modes(linear) if "modes" in design.analyses else None
        for analysis in set(design.analyses) - set(found):
            found[analysis] = StudyPoint(design.study_of(analysis)).motion(system, given)
        per_second = 1 / system.units.time
        numbers: list[tuple[float, ...]] = []
        for q in design.quantities:
            if q.analysis == "modes":
                numbers.append((output_value_of_modes(q.output, found["modes"], per_second)[0],))
            elif q.analysis == "response":
                numbers.append((response_number(q, found["response"], per_second),))
            else:
                numbers.append(numbers_of(q, system, found[q.analysis]))
        for q, each in zip(design.quantities, numbers, strict=True):
            if not np.isfinite(each).all():
                raise ModelError(f"{q.output.name}: {q.output.of} is {each[int(np.argmin(np.isfinite(each)))]}")
        return tuple(numbers)

    def failed(self, values: tuple[float, ...], words: str, is_lasting: bool) -> Evaluation:
        """Return a failed evaluation."""
        return Evaluation(values, error=words, is_lasting=is_lasting)

    def key(self, values: tuple[float, ...]) -> tuple[float, ...]:
        """Return the values."""
        return values

    def record(self, row: Evaluation) -> dict[str, Any] | None:
        """Return the numbers, unless another attempt may succeed."""
        return {"numbers": row.numbers, "error": row.error, "notes": row.notes} if row.is_lasting else None

    def row(self, values: tuple[float, ...], record: dict[str, Any]) -> Evaluation:
        """Return the evaluation of a record."""
        numbers = tuple(tuple(float(v) for v in part) for part in record["numbers"])
        expected = tuple(1 if q.times is None else len(q.times) for q in self.design.quantities)
        if not record["error"] and tuple(map(len, numbers)) != expected:
            raise ValueError("a record of another design")
        return Evaluation(values, numbers, str(record["error"]), notes=tuple(map(str, record.get("notes", ()))))


def numbers_of(quantity: Quantity, system: System, motion: Trajectory) -> tuple[float, ...]:
    """Return the number of a quantity, or its values at the times of its table."""
    if quantity.times is None:
        return (output_value(quantity.output, system, motion)[0],)
    values, _ = column_of(quantity.output, system, motion)
    t, wanted = np.asarray(motion.t), quantity.times
    slack = 1e-9 * max(abs(t[-1]), abs(t[0]))
    if wanted[0] < t[0] - slack or wanted[-1] > t[-1] + slack:
        raise ModelError(
            f"objective {quantity.output.name!r}: its table covers t = {wanted[0]:g} to {wanted[-1]:g}, but the motion "
            f"only {t[0]:g} to {t[-1]:g}; extend the run, or shorten the table"
        )
    curve = CubicSpline(t, values) if len(t) > 3 else None
    return tuple(float(v) for v in (curve(wanted) if curve is not None else np.interp(wanted, t, values)))


def residuals(design: Design, evaluation: Evaluation) -> Array:
    """Return the deviations of all fitted objectives, (n_r,), times weight / sqrt(number of deviations)."""
    parts = [np.zeros(0)]
    for q, numbers in zip(design.objectives, evaluation.numbers, strict=False):
        if q.is_fit:
            wanted = q.values if q.values is not None else np.array([q.target])
            parts.append(q.weight * (np.array(numbers) - wanted) / np.sqrt(len(numbers)))
    return np.concatenate(parts)


def terms(design: Design, evaluation: Evaluation) -> Array:
    """Return the terms whose largest is minimised, (n,): +-weight * number, and +weight, -weight times deviation."""
    found: list[Array] = []
    for q, numbers in zip(design.objectives, evaluation.numbers, strict=False):
        if not q.is_fit:
            found.append(np.array([q.sign * q.weight * numbers[0]]))
            continue
        deviation = q.weight * (np.array(numbers) - (q.values if q.values is not None else np.array([q.target])))
        found += [deviation, -deviation]
    return np.concatenate(found)


def scalar(design: Design, evaluation: Evaluation) -> float:
    """Return F = sum of +-weight times number, and of the squares of `residuals`; or the largest of `terms`."""
    if design.combine == "largest":
        return float(terms(design, evaluation).max())
    plain = sum(
        q.sign * q.weight * numbers[0]
        for q, numbers in zip(design.objectives, evaluation.numbers, strict=False)
        if not q.is_fit
    )
    return float(plain + (residuals(design, evaluation) ** 2).sum())


def violations(design: Design, evaluation: Evaluation) -> Array:
    """Return g, (n_g,), relative to the limit (absolute for a limit of 0); a permitted point has g <= 0."""
    g: list[float] = []
    for q, numbers in zip(design.constraints, evaluation.numbers[len(design.objectives) :], strict=True):
        if q.least is not None:
            g.append((q.least - numbers[0]) / (abs(q.least) or 1.0))
        if q.most is not None:
            g.append((numbers[0] - q.most) / (abs(q.most) or 1.0))
    return np.array(g)


def open_journal(path: Path, design: Design, files: tuple[str, ...]) -> TaskJournal:
    """Return the journal at a path, new or with its content.

    Raises
    ------
    ResultsError
        If the file is not a journal, or belongs to another system, other numbers or another version of the program. The
        file is not changed.
    """
    asked = [
        (q.analysis, q.output.of, q.output.take, q.band, q.at, None if q.times is None else q.times.tolist())
        for q in design.quantities
    ]
    given = [sorted(design.study.given.items())] if design.study.given else []
    digest = campaign_digest(([(p.paths, p.factors) for p in design.parameters], asked, *given), files)
    return open_task_journal(path, KIND, digest, design.source, ResultsError)


KIND = "floatframe optimize journal 2"
