"""A design: the system, its free parameters, the objectives and constraints, and the method."""

from dataclasses import dataclass, replace
from pathlib import Path

from fe_models.foundation.arrays import Array
from fe_models.foundation.presentation import presented
from floatframe.design.studies.study_file import Output, Study

__all__ = ["Design", "DesignParameter", "Quantity"]


@dataclass(frozen=True)
class DesignParameter:
    """Numbers of the system file that take one value between bounds."""

    name: str
    paths: tuple[str, ...]
    factors: tuple[float, ...]  #: factor of each path: the number in the file is the factor times the parameter
    lower: float
    upper: float
    start: float


@presented
@dataclass(frozen=True, eq=False)
class Quantity:
    """A number taken from an evaluation, and its goal or limits."""

    output: Output
    analysis: str  #: analysis that gives the number
    band: tuple[float, float] | None = None  #: frequency band of a frequency response [Hz]
    at: float | None = None  #: single frequency of a frequency response [Hz]
    weight: float = 1.0
    sign: float = 1.0  #: 1 to minimise an objective, -1 to maximise it
    target: float | None = None
    times: Array | None = None  #: times of a table, (n_t,) [s]
    values: Array | None = None  #: values of a table, (n_t,)
    least: float | None = None  #: lower limit of a constraint
    most: float | None = None  #: upper limit of a constraint

    @property
    def is_fit(self) -> bool:
        """Whether the deviation from a target or table is minimised."""
        return self.target is not None or self.values is not None


@presented
@dataclass(frozen=True, eq=False)
class Design:
    """A system, its free parameters, objectives and constraints, and how to find the best."""

    source: str  #: path of the design file
    study: Study  #: the system; its only point is the start
    method: str
    workers: int | str | None
    iterations: int
    tolerance: float
    combine: str  #: how objectives are combined in F: sum, or largest
    differences: str
    step: float  #: step of differences, relative to upper - lower
    population: int
    seed: int
    parameters: tuple[DesignParameter, ...]
    objectives: tuple[Quantity, ...]
    constraints: tuple[Quantity, ...]
    tables: tuple[Path, ...]  #: files of tables of the objectives

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Objectives, followed by constraints."""
        return (*self.objectives, *self.constraints)

    def point(self, values: tuple[float, ...]) -> tuple[float, ...]:
        """Return the values for all key paths of the parameters."""
        return tuple(v * f for p, v in zip(self.parameters, values, strict=True) for f in p.factors)

    @property
    def analyses(self) -> tuple[str, ...]:
        """All analyses that the quantities need."""
        return tuple(dict.fromkeys(q.analysis for q in self.quantities))

    def study_of(self, analysis: str) -> Study:
        """Return the study of one analysis, with only the outputs of this analysis."""
        return replace(
            self.study, analysis=analysis, outputs=tuple(q.output for q in self.quantities if q.analysis == analysis)
        )
