"""The design file: what `floatframe optimize` reads (docs/optimization.md)."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, field_validator, model_validator

from fe_models.foundation.arrays import Array
from fe_models.foundation.number_pairs import read_pairs
from fe_models.foundation.parametric_file import read_parametric
from fe_models.foundation.tasks.workers import WORKERS_HELP
from fe_models.foundation.toml_file import (
    Table,
    choice,
    existing_file,
    interval,
    kind_field,
    read_toml,
    validated,
    value_of,
)
from floatframe.design.optimization.design import Design, DesignParameter, Quantity
from floatframe.design.studies.study_file import (
    ANALYSES,
    TAKES,
    Output,
    Parameter,
    Study,
    list_as_tuple,
    workers_of_file,
)
from floatframe.errors import SystemFileError

__all__ = ["COMBINATIONS", "DIFFERENCES", "GOALS", "METHODS", "SMALLEST_TOLERANCE", "read_design"]

METHODS = ("least-squares", "slsqp", "trust-constr", "differential-evolution")
DIFFERENCES = ("central", "forward")
COMBINATIONS = ("sum", "largest")
RESPONSE = "response"  #: name of the analysis that only designs use
RESPONSE_TAKES = ("greatest", "least", "mean", "rms")
GOALS = ("smallest", "greatest")
SMALLEST_TOLERANCE = 1e-15  #: smallest tolerance above the rounding of numbers, required by SciPy's methods


class PathSection(Table):
    """One of several key paths of a parameter."""

    path: str = Field(description="the key path in the system file, text")
    factor: float = Field(1.0, description="a number other than 0 that the value is multiplied with")

    @field_validator("factor")
    @classmethod
    def _not_zero(cls, value: float) -> float:
        if value == 0:
            raise ValueError("expected a number other than 0")
        return value


class ParameterSection(Table):
    """[parameters.NAME]: numbers of the system file that are free between bounds."""

    path: Annotated[str | tuple[str | PathSection, ...], BeforeValidator(list_as_tuple)] = Field(
        description="the key path in the system file, text, such as bodies.rod.mass, or a list of paths that share one "
        "value: text or tables {path = ..., factor = ...}"
    )
    lower: float = Field(description="a number, the lower bound")
    upper: float = Field(description="a number, the upper bound")
    start: float | None = Field(None, description="a number, where to begin; default: the value in the system file")

    @model_validator(mode="after")
    def _bounds(self) -> "ParameterSection":
        if not self.lower < self.upper:
            raise ValueError(f"expected lower below upper, got lower = {self.lower:g}, upper = {self.upper:g}")
        if self.start is not None and not self.lower <= self.start <= self.upper:
            raise ValueError(f"expected start between {self.lower:g} and {self.upper:g}, got {self.start:g}")
        if not self.path:
            raise ValueError("path: expected one key path at least")
        return self

    def places(self) -> tuple[PathSection, ...]:
        """Return all key paths with their factors."""
        given = (self.path,) if isinstance(self.path, str) else self.path
        return tuple(PathSection(path=each, factor=1.0) if isinstance(each, str) else each for each in given)


class QuantitySection(Table):
    """A number taken from the result of an evaluation."""

    of: str = Field(
        description='a sensor and its column ("tip size"), of modes "frequency 1", "damping least", of response '
        '"OUTPUT / INPUT"'
    )
    analysis: choice("analysis", lambda: (*ANALYSES, RESPONSE)) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join((*ANALYSES, RESPONSE))}; default: that of the design"
    )
    band: tuple[float, float] | None = Field(None, description="of response: a list of two frequencies in Hz, rising")
    at: Annotated[float, Field(ge=0)] | None = Field(None, description="of response: one frequency in Hz instead")
    take: choice("way to take a number", lambda: tuple(TAKES)) = Field(  # type: ignore[valid-type]
        "last", description=f"one of {', '.join(TAKES)}"
    )

    @field_validator("band", mode="before")
    @classmethod
    def _band(cls, value: Any) -> Any:
        return interval(value)

    def output(self, name: str, analysis: str) -> Output:
        """Return the reduction of an output, by default the maximum of a response; `ValueError` if it does not fit."""
        analysis = self.analysis or analysis
        if analysis != RESPONSE:
            if self.band is not None or self.at is not None:
                raise ValueError(f'{name}: band and at belong to analysis = "response", got analysis = {analysis!r}')
            return Output(name, self.of, self.take)
        if (self.band is None) == (self.at is None):
            raise ValueError(
                f"{name}: expected either band or at for a frequency response, got {'both' if self.at else 'neither'}"
            )
        take = self.take if "take" in self.model_fields_set else "greatest"
        if take not in RESPONSE_TAKES or (self.at is not None and "take" in self.model_fields_set):
            words = (
                f"expected one of {', '.join(RESPONSE_TAKES)}, with band" if self.at is None else "leave it out with at"
            )
            raise ValueError(f"{name}: take = {take!r}: {words}")
        if self.band is not None and not 0 < self.band[0] < self.band[1]:
            raise ValueError(f"{name}: band: expected two rising frequencies above 0, got {list(self.band)}")
        return Output(name, self.of, take)


class ObjectiveSection(QuantitySection):
    """[objectives.NAME]: a quantity to minimise or maximise, or to fit to a number or a table."""

    goal: choice("goal", lambda: GOALS) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(GOALS)}; default: smallest"
    )
    target: float | None = Field(None, description="a number to approach")
    table: Annotated[Path, BeforeValidator(existing_file("table"))] | None = Field(
        None, description="the path of a .csv file with columns t and value, the history to approach"
    )
    weight: Annotated[float, Field(gt=0)] = Field(1.0, description="a number above 0")

    @model_validator(mode="after")
    def _one_goal(self) -> "ObjectiveSection":
        given = [key for key in ("goal", "target", "table") if getattr(self, key) is not None]
        if len(given) > 1:
            raise ValueError(f"expected one of goal, target and table, got {' and '.join(given)}")
        if self.table is not None and "take" in self.model_fields_set:
            raise ValueError("take: a table is compared at all its times; remove take")
        return self


class ConstraintSection(QuantitySection):
    """[constraints.NAME]: limits of a number."""

    least: float | None = Field(None, description="a number that it may not fall below")
    most: float | None = Field(None, description="a number that it may not exceed")

    @model_validator(mode="after")
    def _limits(self) -> "ConstraintSection":
        if self.least is None and self.most is None:
            raise ValueError("expected least or most, or both")
        if self.least is not None and self.most is not None and not self.least < self.most:
            raise ValueError(f"expected least below most, got least = {self.least:g}, most = {self.most:g}")
        return self


class DesignFile(Table):
    """An optimisation of a system."""

    kind: str = kind_field("optimization")
    system: Annotated[Path, BeforeValidator(existing_file("system file"))] = Field(
        description="the path of a system file, relative to this file"
    )
    analysis: choice("analysis", lambda: (*ANALYSES, RESPONSE)) = Field(  # type: ignore[valid-type]
        "run", description=f"one of {', '.join((*ANALYSES, RESPONSE))}"
    )
    combine: choice("combination", lambda: COMBINATIONS) = Field(  # type: ignore[valid-type]
        "sum", description=f"one of {', '.join(COMBINATIONS)}: the combination of all objectives that is minimised"
    )
    method: choice("method", lambda: METHODS) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(METHODS)}"
    )
    workers: Annotated[int | str, BeforeValidator(workers_of_file)] | None = Field(
        None, description=f"{WORKERS_HELP}; default: one process per processor"
    )
    iterations: Annotated[int, Field(ge=1, le=100_000)] = Field(
        100, description="a whole number above 0 and up to 100000, the largest number of iterations"
    )
    tolerance: Annotated[float, Field(ge=SMALLEST_TOLERANCE, lt=1)] = Field(
        1e-9, description=f"a number of {SMALLEST_TOLERANCE:g} to 1, the tolerance at which the method ends"
    )
    differences: choice("differences", lambda: DIFFERENCES) = Field(  # type: ignore[valid-type]
        "central", description=f"one of {', '.join(DIFFERENCES)}"
    )
    step: Annotated[float, Field(gt=0, le=0.1)] = Field(
        1e-5, description="a number above 0 and up to 0.1, the step of differences as a fraction of upper - lower"
    )
    population: Annotated[int, Field(ge=5, le=10_000)] | None = Field(
        None, description="a whole number of 5 or more, for differential-evolution; default: 15 per parameter"
    )
    seed: Annotated[int, Field(ge=0)] = Field(0, description="a whole number, for differential-evolution")
    parameters: dict[str, ParameterSection] = Field(description="tables [parameters.NAME]")
    objectives: dict[str, ObjectiveSection] = Field(description="tables [objectives.NAME]")
    constraints: dict[str, ConstraintSection] = Field({}, description="tables [constraints.NAME]")

    @model_validator(mode="after")
    def _fits(self) -> "DesignFile":
        if not self.parameters:
            raise ValueError("parameters: expected one table [parameters.NAME] at least")
        if not self.objectives:
            raise ValueError("objectives: expected one table [objectives.NAME] at least")
        twice = sorted(set(self.objectives) & set(self.constraints))
        if twice:
            raise ValueError(f"constraints.{twice[0]}: an objective has this name; give it another")
        paths = [place.path for section in self.parameters.values() for place in section.places()]
        repeated = sorted({path for path in paths if paths.count(path) > 1})
        if repeated:
            raise ValueError(f"parameters: the key path {repeated[0]} occurs twice")
        if self.method == "least-squares":
            if self.combine != "sum":
                raise ValueError('combine: method = "least-squares" minimises a sum of squares; take slsqp')
            if self.constraints:
                raise ValueError('constraints: method = "least-squares" supports none; take slsqp or trust-constr')
            plain = [name for name, o in self.objectives.items() if o.target is None and o.table is None]
            if plain:
                raise ValueError(f'objectives.{plain[0]}: method = "least-squares" expects a target or a table')
        for name, o in self.objectives.items():
            analysis = o.analysis or self.analysis
            if o.table is not None and analysis in ("modes", "static", RESPONSE):
                raise ValueError(f"objectives.{name}: table: analysis = {analysis!r} has no times; take a target")
        for kind, sections in (("objectives", self.objectives), ("constraints", self.constraints)):
            for name, section in sections.items():
                section.output(f"{kind}.{name}", self.analysis)
        return self


def read_design(path: str | os.PathLike[str], changes: Mapping[str, Any] | None = None) -> Design:
    """Read and check a design file.

    Parameters
    ----------
    path
        Name of the design file (TOML).
    changes
        Values of other parameters and key paths of the system file, in all evaluations.

    Raises
    ------
    SystemFileError
        If the file is not valid, a key path does not exist in the system or does not lead to a number, or a table
        cannot be read. The message lists every problem, with key path, value, expected value, choices and nearest name.
    """
    path = Path(path)
    data = validated(DesignFile, read_toml(path, SystemFileError), path, SystemFileError, context=path.parent)
    content = read_parametric(data.system, SystemFileError, changes)
    parameters = tuple(parameter_of(name, section, content, path) for name, section in data.parameters.items())
    objectives = []
    for name, o in data.objectives.items():
        times, values = (None, None) if o.table is None else read_history(o.table)
        sign = -1.0 if o.goal == "greatest" else 1.0
        objectives.append(
            Quantity(
                o.output(name, data.analysis), o.analysis or data.analysis, o.band, o.at, o.weight, sign, o.target,
                times, values,
            )
        )  # fmt: skip
    constraints = tuple(
        Quantity(c.output(name, data.analysis), c.analysis or data.analysis, c.band, c.at, least=c.least, most=c.most)
        for name, c in data.constraints.items()
    )
    study = Study(
        system=str(data.system),
        analysis=data.analysis,
        is_grid=False,
        workers=data.workers,
        parameters=tuple(
            Parameter(p.name, key, (p.start * factor,))
            for p in parameters
            for key, factor in zip(p.paths, p.factors, strict=True)
        ),
        outputs=tuple(q.output for q in (*objectives, *constraints)),
        given=changes or {},
    )
    return Design(
        str(path), study, data.method, data.workers, data.iterations, data.tolerance, data.combine, data.differences,
        data.step, data.population or 15 * len(parameters), data.seed, parameters, tuple(objectives), constraints,
        tuple(o.table for o in data.objectives.values() if o.table is not None),
    )  # fmt: skip


def parameter_of(name: str, section: ParameterSection, content: dict[str, Any], path: Path) -> DesignParameter:
    """Return a parameter; `SystemFileError` if a key path does not lead to a number, or the start is out of bounds."""
    where = f"{path}: parameters.{name}"
    found = []
    places = section.places()
    for place in places:
        value = value_of(content, place.path, where, SystemFileError)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise SystemFileError(
                f"{where}: path = {place.path!r}: expected the key path of a number, got {value!r:.60}"
            )
        found.append(float(value) / place.factor)
    start = found[0] if section.start is None else section.start
    if not section.lower <= start <= section.upper:
        raise SystemFileError(
            f"{where}: the system file has {start:g} at {places[0].path}, outside of the bounds {section.lower:g} "
            f"to {section.upper:g}; give start, or other bounds"
        )
    return DesignParameter(
        name, tuple(p.path for p in places), tuple(p.factor for p in places), section.lower, section.upper, start
    )


def read_history(path: Path) -> tuple[Array, Array]:
    """Return times and values of a text file of two columns, both (n_t,).

    Raises
    ------
    SystemFileError
        If a line does not contain two finite numbers, or its time does not increase; the message has the line number.
    """
    table, lines = read_pairs(path, "t and value", SystemFileError)
    times = table[:, 0]
    if not (np.diff(times) > 0).all():
        k = int(np.argmax(np.diff(times) <= 0)) + 1
        before = f"{times[k]:g} after {times[k - 1]:g}"
        raise SystemFileError(f"{path}, line {lines[k]}: expected increasing times, got {before}")
    return times.copy(), table[:, 1].copy()
