"""A design: the system, its free parameters, what is wanted of it, and how the best is found."""

from dataclasses import dataclass, replace
from pathlib import Path

from fe_models.foundation.arrays import Array
from floatframe.design.studies.study_file import Output, Study

__all__ = ["Design", "DesignParameter", "Quantity"]


@dataclass(frozen=True)
class DesignParameter:
    """Numbers of the system file that take one value between bounds."""

    name: str
    paths: tuple[str, ...]
    factors: tuple[float, ...]  #: of each path: the number there is the factor times the value of the parameter
    lower: float
    upper: float
    start: float


@dataclass(frozen=True, eq=False)
class Quantity:
    """What is taken from an evaluation, and what is wanted of it."""

    output: Output
    analysis: str  #: from which it is taken
    band: tuple[float, float] | None = None  #: of a frequency response, over which it is taken [Hz]
    at: float | None = None  #: or the one frequency [Hz]
    weight: float = 1.0
    sign: float = 1.0  #: of an objective that is to be small (1) or great (-1)
    target: float | None = None
    times: Array | None = None  #: of a table, (n_t,) [s]
    values: Array | None = None  #: of a table, (n_t,)
    least: float | None = None  #: of a constraint
    most: float | None = None  #: of a constraint

    @property
    def is_fit(self) -> bool:
        """Its deviation counts, not its size."""
        return self.target is not None or self.values is not None


@dataclass(frozen=True, eq=False)
class Design:
    """A system, its free parameters, objectives and constraints, and how to find the best."""

    source: str  #: path of the design file
    study: Study  #: the system; its only point is the start
    method: str
    workers: int | str | None
    iterations: int
    tolerance: float
    combine: str  #: how objectives make F: sum, or largest
    differences: str
    step: float  #: of differences, as a part of upper - lower
    population: int
    seed: int
    parameters: tuple[DesignParameter, ...]
    objectives: tuple[Quantity, ...]
    constraints: tuple[Quantity, ...]
    tables: tuple[Path, ...]  #: files of the objectives

    @property
    def quantities(self) -> tuple[Quantity, ...]:
        """Objectives and constraints."""
        return (*self.objectives, *self.constraints)

    def point(self, values: tuple[float, ...]) -> tuple[float, ...]:
        """Return the values for all key paths of the parameters."""
        return tuple(v * f for p, v in zip(self.parameters, values, strict=True) for f in p.factors)

    @property
    def analyses(self) -> tuple[str, ...]:
        """All analyses that quantities are taken from."""
        return tuple(dict.fromkeys(q.analysis for q in self.quantities))

    def study_of(self, analysis: str) -> Study:
        """Return the study of one analysis with what is taken from it."""
        return replace(
            self.study, analysis=analysis, outputs=tuple(q.output for q in self.quantities if q.analysis == analysis)
        )
