"""Optimisation of the parameters of a design by SciPy's methods, with parallel evaluations and a journal.

design = read_design("four_bar_fit.toml")
best = optimize(design)                # best.values, best.numbers, best.history
"""

import os
import warnings
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.documents.table import Table, Tabular
from fe_models.foundation.presentation import presented
from fe_models.foundation.tasks.campaign import Campaign, TaskJournal
from fe_models.foundation.tasks.task_map import TaskMap
from fe_models.foundation.tasks.workers import Workers, tasks_of
from floatframe.design.optimization.design import Design
from floatframe.design.optimization.design_file import SMALLEST_TOLERANCE
from floatframe.design.optimization.evaluation import (
    Evaluation,
    EvaluationFunction,
    open_journal,
    residuals,
    scalar,
    terms,
    violations,
)
from floatframe.design.studies.study import check, report_notes, sendable_study
from floatframe.errors import ModelError

__all__ = ["Evaluated", "OptimizationResult", "optimize"]

PERMITTED = 1e-6  #: largest permitted violation of a limit, relative to the limit


@dataclass(frozen=True)
class Evaluated:
    """A row of the history."""

    evaluation: Evaluation
    objective: float  #: F, which is minimised; NaN where the evaluation failed
    #: largest violation of a limit, relative to the limit; 0 if there is none, infinite if the evaluation failed
    violation: float
    is_difference: bool  #: whether it was computed only for a derivative
    is_known: bool  #: whether it comes from the journal


@presented
@dataclass(frozen=True, eq=False)
class OptimizationResult(Tabular):
    """The best point, and the history of the search."""

    design: Design
    best: Evaluated
    history: tuple[Evaluated, ...]
    is_converged: bool
    message: str  #: reason why the method ended

    @property
    def values(self) -> dict[str, float]:
        """The best values of the parameters by name."""
        return {p.name: v for p, v in zip(self.design.parameters, self.best.evaluation.values, strict=True)}

    @property
    def numbers(self) -> dict[str, float]:
        """Objectives and constraints at the best point, by name; for a table, the rms deviation from it."""
        return numbers_by_name(self.design, self.best.evaluation)

    @property
    def n_computed(self) -> int:
        """Number of evaluations computed in this call, not found in the journal."""
        return sum(not row.is_known for row in self.history)

    @property
    def n_failed(self) -> int:
        """Number of failed evaluations."""
        return sum(bool(row.evaluation.error) for row in self.history)

    def to_table(self) -> Table:
        """Return the history, one row for each evaluation; the numbers of a failed one are missing."""
        names = [p.name for p in self.design.parameters] + [q.output.name for q in self.design.quantities]
        rows = []
        for number, row in enumerate(self.history, start=1):
            made = row.evaluation
            found = [*numbers_by_name(self.design, made).values(), row.objective, row.violation]
            numbers = [None] * len(found) if made.error else found
            rows.append((number, purpose_of(row), *made.values, *numbers, made.error))
        return Table.of_rows(("evaluation", "purpose", *names, "objective", "violation", "error"), rows)


def purpose_of(row: Evaluated) -> str:
    """Return for what a row was computed."""
    return "difference" if row.is_difference else "trial"


def numbers_by_name(design: Design, evaluation: Evaluation) -> dict[str, float]:
    """Return the number of each objective and constraint, for a table the rms deviation; NaN if there is none."""
    found: dict[str, float] = {}
    for i, q in enumerate(design.quantities):
        numbers = np.array(evaluation.numbers[i]) if evaluation.numbers else np.full(1, np.nan)
        found[q.output.name] = float(numbers[0] if q.values is None else np.sqrt(((numbers - q.values) ** 2).mean()))
    return found


def optimize(
    design: Design,
    *,
    workers: Workers = None,
    journal: str | os.PathLike[str] | None = None,
    progress: Callable[[Evaluated], None] | None = None,
) -> OptimizationResult:
    """Find the best values of the parameters (docs/optimization.md).

    Parameters
    ----------
    design
        The design, from `read_design`.
    workers
        Workers that compute evaluations (docs/cluster.md); default: those in the design, or one process per processor.
    journal
        A file to which every evaluation is appended; those in it are not computed again. None: nothing is written.
    progress
        Called with each new row of the history.

    Raises
    ------
    ModelError, SystemFileError
        Before any work, if the system is not valid or has no such sensor, column or mode; if the first evaluation or
        both sides of a difference fail; if no evaluation satisfies the limits.
    ResultsError
        If the journal belongs to another system, other numbers or another version of the program.
    WorkerError
        If no workers are available.
    """
    from floatframe.files.system_file.read_system import read_system

    start_point = design.point(tuple(p.start for p in design.parameters))
    for analysis in design.analyses:
        study = design.study_of(analysis)
        check(replace(study, analysis="modes", outputs=()) if analysis == "response" else study, start_point)
    files = read_system(design.study.system, design.study.given)[0].files
    kept = None if journal is None else open_journal(Path(journal), design, files)
    with tasks_of(design.workers if workers is None else workers) as tasks:
        evaluator = Evaluator(design, tasks, kept, files, progress)
        start = evaluator.scaled_start()
        first = evaluator.at([start])[0]
        if first.evaluation.error:
            raise ModelError(f"{design.source}: the evaluation at the start failed: {first.evaluation.error}")
        is_converged, message = SOLVERS[design.method](evaluator, start)
        report_notes(row.evaluation.notes for row in evaluator.history)
        return OptimizationResult(
            design, best_of(design, evaluator.history), tuple(evaluator.history), is_converged, message
        )


def best_of(design: Design, history: Sequence[Evaluated]) -> Evaluated:
    """Return the row with the smallest F among those that satisfy all limits; `ModelError` if there is none."""
    kept = [row for row in history if not row.is_difference and row.violation <= PERMITTED]
    if not kept:
        nearest = min(history, key=lambda row: row.violation)
        raise ModelError(
            f"{design.source}: none of {len(history)} evaluations satisfies all constraints; the nearest one, at "
            f"{values_of(design, nearest.evaluation.values)}, misses a limit by {nearest.violation:.3g} of it; widen "
            "limits or bounds, or begin elsewhere"
        )
    return min(kept, key=lambda row: row.objective)


def values_of(design: Design, values: Iterable[float]) -> str:
    """Return values of the parameters as text."""
    return ", ".join(f"{p.name} = {value:.6g}" for p, value in zip(design.parameters, values, strict=True))


class Evaluator:
    """Evaluates a design at scaled points z, (n_parameters,), from 0 at the lower to 1 at the upper bounds."""

    def __init__(
        self,
        design: Design,
        tasks: TaskMap,
        journal: TaskJournal | None,
        files: Sequence[str],
        progress: Callable[[Evaluated], None] | None,
    ) -> None:
        self.design = design
        self.tasks = tasks
        self.files = tuple(os.path.abspath(name) for name in files)
        self.progress = progress
        function = EvaluationFunction(replace(design, study=sendable_study(design.study)))
        self.campaign: Campaign[tuple[float, ...], Evaluation] = Campaign(function, journal)
        self.lower = np.array([p.lower for p in design.parameters])
        self.upper = np.array([p.upper for p in design.parameters])
        self.rows: dict[tuple[float, ...], Evaluated] = {}
        self.history: list[Evaluated] = []

    def scaled_start(self) -> Array:
        """Return the scaled point z of the start."""
        start = np.array([p.start for p in self.design.parameters])
        return (start - self.lower) / (self.upper - self.lower)

    def at(self, points: Sequence[Array], *, n_trials: int | None = None) -> list[Evaluated]:
        """Return the rows at scaled points; those after the first `n_trials` (default: none) are for differences.

        The workers compute points that are not known yet.
        """
        values = [tuple(float(v) for v in self.values(z)) for z in points]
        new = list(dict.fromkeys(v for v in values if v not in self.rows))
        known = {v for v in new if self.campaign.known(v) is not None}
        trials = set(values[:n_trials])
        for v, evaluation in zip(new, self.campaign.rows(new, self.tasks, files=self.files), strict=True):
            row = self.row(evaluation, v not in trials, v in known)
            self.rows[v] = row
            self.history.append(row)
            if self.progress is not None:
                self.progress(row)
        return [self.rows[v] for v in values]

    def values(self, z: Array) -> Array:
        """Return the values of the parameters at a scaled point, within their bounds."""
        return np.clip(self.lower + z * (self.upper - self.lower), self.lower, self.upper)

    def row(self, evaluation: Evaluation, is_difference: bool, is_known: bool) -> Evaluated:
        """Return an evaluation as a row of the history."""
        if evaluation.error:
            return Evaluated(evaluation, np.nan, np.inf, is_difference, is_known)
        violation = float(max(violations(self.design, evaluation), default=0.0))
        return Evaluated(evaluation, scalar(self.design, evaluation), max(violation, 0.0), is_difference, is_known)

    def derivatives(self, z: Array, of: Callable[[Evaluation], Array]) -> Array:
        """Return d(of)/dz, (n_of, n_parameters), by differences whose points are evaluated together.

        At a bound, or where one side fails, the difference is one-sided.
        """
        z = np.clip(z, 0.0, 1.0)
        n, h = len(z), self.design.step
        is_central = self.design.differences == "central"
        above = [np.where(np.arange(n) == k, np.minimum(z + h, 1.0), z) for k in range(n)]
        below = [np.where(np.arange(n) == k, np.maximum(z - h, 0.0), z) for k in range(n)]
        ends = [(above[k], below[k] if is_central or above[k][k] == z[k] else z) for k in range(n)]
        self.at([z, *(end for pair in ends for end in pair)], n_trials=1)
        columns = []
        for k in range(n):
            sides = [p for p in ends[k] if not self.at([p])[0].evaluation.error]
            if len(sides) == 1:
                sides.append(z)
            if len(sides) < 2 or sides[0][k] == sides[1][k]:
                reason = self.at([ends[k][0]])[0].evaluation.error
                name = self.design.parameters[k].name
                raise ModelError(
                    f"{self.design.source}: no derivative by {name} at {values_of(self.design, self.values(z))}: the "
                    f"evaluations beside it fail: {reason}; take narrower bounds, or differential-evolution"
                )
            upper, lower = (of(self.at([p])[0].evaluation) for p in sides)
            columns.append((upper - lower) / (sides[0][k] - sides[1][k]))
        return np.array(columns).T


def least_squares_of(evaluator: Evaluator, start: Array) -> tuple[bool, str]:
    """Minimise the sum of squares of all deviations by a trust-region method; a failed trial shrinks the region."""
    from scipy.optimize import least_squares

    design = evaluator.design
    n = len(residuals(design, evaluator.at([start])[0].evaluation))

    def deviations(z: Array) -> Array:
        found = evaluator.at([z])[0].evaluation
        return np.full(n, np.nan) if found.error else residuals(design, found)

    found = least_squares(
        deviations, inside(start), jac=lambda z: evaluator.derivatives(z, lambda e: residuals(design, e)),
        bounds=(0.0, 1.0), method="trf", x_scale="jac", ftol=design.tolerance, xtol=design.tolerance,
        gtol=max(design.tolerance**2, SMALLEST_TOLERANCE), max_nfev=design.iterations,
    )  # fmt: skip
    return bool(found.success), str(found.message)


def inside(z: Array) -> Array:
    """Return a point that is not on a bound, because an interior-point method cannot start there."""
    return np.clip(z, 1e-10, 1.0 - 1e-10)


def minimum_of(evaluator: Evaluator, start: Array) -> tuple[bool, str]:
    """Minimise F within limits by gradients; a failed trial counts as worse than all others, and violates every limit.

    The largest of several terms is not smooth. Then s, a further unknown after z, is minimised under the constraint
    that no term of the objectives exceeds s, both in units of F at the start.
    """
    from scipy.optimize import NonlinearConstraint, minimize

    design = evaluator.design
    n = len(start)
    is_largest = design.combine == "largest"
    first = evaluator.at([start])[0]
    size = abs(first.objective) or 1.0

    def objective(z: Array) -> float:
        row = evaluator.at([z])[0]
        if not row.evaluation.error:
            return row.objective
        seen = [abs(row.objective) for row in evaluator.history if not row.evaluation.error]
        return 1.0 + 10.0 * max(seen)

    def gradient(z: Array) -> Array:
        return evaluator.derivatives(z, lambda e: np.array([scalar(design, e)]))[0]

    def limited(e: Evaluation) -> Array:
        limits = violations(design, e)
        return np.concatenate([terms(design, e) / size, limits]) if is_largest else limits

    n_limits = len(limited(first.evaluation))
    n_terms = n_limits - len(violations(design, first.evaluation))
    by_s = np.where(np.arange(n_limits) < n_terms, -1.0, 0.0)

    def excess(x: Array) -> Array:
        found = evaluator.at([x[:n]])[0].evaluation
        if found.error:
            return np.full(n_limits, 10.0)
        return limited(found) + (by_s * x[n] if is_largest else 0.0)

    def excess_rates(x: Array) -> Array:
        rates = evaluator.derivatives(x[:n], limited)
        return np.column_stack([rates, by_s]) if is_largest else rates

    bounds: list[tuple[float | None, float | None]] = [(0.0, 1.0)] * n
    x = start
    goal: Callable[[Array], float] = objective
    goal_rates: Callable[[Array], Array] = gradient
    if is_largest:
        bounds, x = [*bounds, (None, None)], np.append(start, first.objective / size)
        goal, goal_rates = (lambda x: float(x[n])), (lambda x: np.append(np.zeros(n), 1.0))
    limits: list[Any] = []
    options: dict[str, Any] = {"maxiter": design.iterations}
    if design.method == "slsqp":
        options["ftol"] = design.tolerance
        if n_limits:
            limits = [{"type": "ineq", "fun": lambda x: -excess(x), "jac": lambda x: -excess_rates(x)}]
    else:
        options |= {"gtol": design.tolerance, "xtol": design.tolerance}
        if n_limits:
            limits = [NonlinearConstraint(excess, -np.inf, 0.0, jac=excess_rates)]
            options |= {"gtol": 0.0, "barrier_tol": design.tolerance}  # gtol ignores complementarity and ends too early
    with warnings.catch_warnings():  # near the end, rounding errors give steps without a change of the gradient
        warnings.filterwarnings("ignore", "delta_grad == 0.0", UserWarning)
        found = minimize(
            goal, x, jac=goal_rates, method=design.method, bounds=bounds, constraints=limits, options=options
        )
    return bool(found.success), str(found.message)


def evolution_of(evaluator: Evaluator, start: Array) -> tuple[bool, str]:
    """Minimise F by differential evolution, one generation at a time; failed or infeasible points are discarded."""
    from scipy.optimize import NonlinearConstraint, differential_evolution
    from scipy.stats import qmc

    design = evaluator.design
    n_limits = len(violations(design, evaluator.at([start])[0].evaluation))

    def objective(z: Array) -> Array:
        rows = evaluator.at(list(np.atleast_2d(z.T)))
        found = np.array([np.inf if row.evaluation.error else row.objective for row in rows])
        return found if z.ndim > 1 else found[0]

    def excess(z: Array) -> Array:
        rows = evaluator.at(list(np.atleast_2d(z.T)))
        g = [np.full(n_limits, 1e30) if r.evaluation.error else violations(design, r.evaluation) for r in rows]
        return np.array(g).T if z.ndim > 1 else g[0]

    limits = (NonlinearConstraint(excess, -np.inf, 0.0),) if n_limits else ()
    first = qmc.LatinHypercube(len(start), rng=np.random.default_rng(design.seed)).random(design.population)
    first[0] = start  # replaces one point of the hypercube
    found = differential_evolution(
        objective, [(0.0, 1.0)] * len(start), constraints=limits, init=first, maxiter=design.iterations, tol=0.0,
        atol=design.tolerance, rng=np.random.default_rng(design.seed + 1), polish=False, vectorized=True,
        updating="deferred",
    )  # fmt: skip
    return bool(found.success), str(found.message)


SOLVERS: dict[str, Callable[[Evaluator, Array], tuple[bool, str]]] = {
    "least-squares": least_squares_of,
    "slsqp": minimum_of,
    "trust-constr": minimum_of,
    "differential-evolution": evolution_of,
}
