"""One evaluation of a design: the numbers that objectives and constraints are made of, or why there are none."""

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.interpolate import CubicSpline

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.tasks.task_map import ProcessError
from floatframe.analyses.linear.linearization import linearize
from floatframe.analyses.linear.system_modes import system_modes
from floatframe.design.optimization.design import Design, Quantity
from floatframe.design.optimization.responses import response_number
from floatframe.design.studies.study import StudyPoint, column_of, taken, taken_of_modes
from floatframe.errors import ModelError
from floatframe.model.system import System
from floatframe.results.trajectory import Trajectory

__all__ = ["Evaluation", "EvaluationFunction", "residuals", "scalar", "terms", "violations"]


@dataclass(frozen=True)
class Evaluation:
    """Values of the parameters and what came out."""

    values: tuple[float, ...]  #: of the parameters
    numbers: tuple[tuple[float, ...], ...] = ()  #: of every objective and constraint: one, or one a time of its table
    error: str = ""  #: why there are none
    is_lasting: bool = True  #: another try would give the same; not so for a process that was killed


@dataclass(frozen=True)
class EvaluationFunction:
    """The function that computes an evaluation; it can be sent to another process."""

    design: Design

    def __call__(self, values: tuple[float, ...]) -> Evaluation:
        """Return the numbers at these values of the parameters."""
        from floatframe.files.system_file.read_system import read_system
        from floatframe.files.system_file.run_section import formulation_of

        design = self.design
        system, given = read_system(design.study.system, design.study.changes(design.point(values)))
        found: dict[str, Any] = {}
        if {"eig", "response"} & set(design.analyses):
            found["response"] = linear = linearize(system, formulation=formulation_of(given))
            found["eig"] = system_modes(linear) if "eig" in design.analyses else None
        for analysis in set(design.analyses) - set(found):
            found[analysis] = StudyPoint(design.study_of(analysis)).motion(system, given)
        per_second = 1 / system.units.time
        numbers: list[tuple[float, ...]] = []
        for q in design.quantities:
            if q.analysis == "eig":
                numbers.append((taken_of_modes(q.output, found["eig"], per_second)[0],))
            elif q.analysis == "response":
                numbers.append((response_number(q, found["response"], per_second),))
            else:
                numbers.append(numbers_of(q, system, found[q.analysis]))
        for q, each in zip(design.quantities, numbers, strict=True):
            if not np.isfinite(each).all():
                raise ModelError(f"{q.output.name}: {q.output.of} is {each[int(np.argmin(np.isfinite(each)))]}")
        return Evaluation(values, tuple(numbers))

    def failed(self, values: tuple[float, ...], error: Exception) -> Evaluation:
        """Return the evaluation that went wrong, its error in words."""
        words = str(error) if isinstance(error, ReportedError) else f"{type(error).__name__}: {error}"
        told = " ".join(words.split()) or type(error).__name__
        return Evaluation(values, error=told, is_lasting=not isinstance(error, ProcessError))


def numbers_of(quantity: Quantity, system: System, motion: Trajectory) -> tuple[float, ...]:
    """Return the number of a quantity, or its values at the times of its table."""
    if quantity.times is None:
        return (taken(quantity.output, system, motion)[0],)
    values, _ = column_of(quantity.output, system, motion)
    t, wanted = np.asarray(motion.t), quantity.times
    slack = 1e-9 * max(abs(t[-1]), abs(t[0]))
    if wanted[0] < t[0] - slack or wanted[-1] > t[-1] + slack:
        raise ModelError(
            f"objective {quantity.output.name!r}: its table goes from t = {wanted[0]:g} to {wanted[-1]:g}, the motion "
            f"from {t[0]:g} to {t[-1]:g}; let the run be longer, or the table shorter"
        )
    curve = CubicSpline(t, values) if len(t) > 3 else None
    return tuple(float(v) for v in (curve(wanted) if curve is not None else np.interp(wanted, t, values)))


def residuals(design: Design, evaluation: Evaluation) -> Array:
    """Return the deviations of all objectives that are fits, (n_r,), each times its weight over sqrt(its number)."""
    parts = [np.zeros(0)]
    for q, numbers in zip(design.objectives, evaluation.numbers, strict=False):
        if q.is_fit:
            wanted = q.values if q.values is not None else np.array([q.target])
            parts.append(q.weight * (np.array(numbers) - wanted) / np.sqrt(len(numbers)))
    return np.concatenate(parts)


def terms(design: Design, evaluation: Evaluation) -> Array:
    """Return what the largest is made small of, (n,): +-weight times number, and weight times deviation either way."""
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
    """Return g, (n_g,), which a permitted point has at or below zero, in units of the limit (of 1 for a limit of 0)."""
    g: list[float] = []
    for q, numbers in zip(design.constraints, evaluation.numbers[len(design.objectives) :], strict=True):
        if q.least is not None:
            g.append((q.least - numbers[0]) / (abs(q.least) or 1.0))
        if q.most is not None:
            g.append((numbers[0] - q.most) / (abs(q.most) or 1.0))
    return np.array(g)
