"""The design file: what `floatframe optimize` reads (docs/optimization.md)."""

import csv
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from fe_models.foundation.arrays import Array
from fe_models.foundation.paths import near_file
from fe_models.foundation.toml_file import Table, choice, read_toml, validated, value_of
from floatframe.errors import SystemFileError
from floatframe.studies.study_file import ANALYSES, TAKES, Output, Parameter, Study, list_as_tuple

__all__ = [
    "DIFFERENCES", "GOALS", "METHODS", "SMALLEST_TOLERANCE", "Design", "DesignParameter", "Quantity", "read_design",
]  # fmt: skip

METHODS = ("least-squares", "slsqp", "trust-constr", "differential-evolution")
DIFFERENCES = ("central", "forward")
GOALS = ("smallest", "greatest")
SMALLEST_TOLERANCE = 1e-15  #: above the rounding of numbers, which SciPy's methods ask for


class ParameterSection(Table):
    """[parameters.NAME]: numbers of the system file that are free between bounds."""

    path: Annotated[str | tuple[str, ...], BeforeValidator(list_as_tuple)] = Field(
        description="the key path in the system file, text, such as bodies.rod.mass, or a list of those with one value"
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

    def paths(self) -> tuple[str, ...]:
        """Return all key paths."""
        return (self.path,) if isinstance(self.path, str) else self.path


class QuantitySection(Table):
    """A number taken from the result of an evaluation."""

    of: str = Field(description='a sensor and its column ("tip size"), or of eig "frequency 1", "damping least"')
    take: choice("way to take a number", lambda: tuple(TAKES)) = Field(  # type: ignore[valid-type]
        "last", description=f"one of {', '.join(TAKES)}"
    )


class ObjectiveSection(QuantitySection):
    """[objectives.NAME]: what is to be small or great, or near a number or a table."""

    goal: choice("goal", lambda: GOALS) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(GOALS)}; default: smallest"
    )
    target: float | None = Field(None, description="a number to come near to")
    table: Path | None = Field(None, description="the path of a .csv file with columns t and value to come near to")
    weight: Annotated[float, Field(gt=0)] = Field(1.0, description="a number above 0")

    @field_validator("table", mode="before")
    @classmethod
    def _beside_the_design(cls, value: Any, info: ValidationInfo) -> Path:
        return existing(value, info, "table")

    @model_validator(mode="after")
    def _one_goal(self) -> "ObjectiveSection":
        given = [key for key in ("goal", "target", "table") if getattr(self, key) is not None]
        if len(given) > 1:
            raise ValueError(f"expected one of goal, target and table, got {' and '.join(given)}")
        if self.table is not None and "take" in self.model_fields_set:
            raise ValueError("take: a table is compared at all its times; leave take out")
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

    system: Path = Field(description="the path of a system file, relative to this file")
    analysis: choice("analysis", lambda: ANALYSES) = Field(  # type: ignore[valid-type]
        "run", description=f"one of {', '.join(ANALYSES)}"
    )
    method: choice("method", lambda: METHODS) = Field(  # type: ignore[valid-type]
        description=f"one of {', '.join(METHODS)}"
    )
    processes: Annotated[int, Field(ge=1)] | None = Field(
        None, description="a whole number above 0, evaluations at once; default: one a processor"
    )
    iterations: Annotated[int, Field(ge=1, le=100_000)] = Field(
        100, description="a whole number above 0 and up to 100000, at most so many"
    )
    tolerance: Annotated[float, Field(ge=SMALLEST_TOLERANCE, lt=1)] = Field(
        1e-9, description=f"a number of {SMALLEST_TOLERANCE:g} to 1, when to end"
    )
    differences: choice("differences", lambda: DIFFERENCES) = Field(  # type: ignore[valid-type]
        "central", description=f"one of {', '.join(DIFFERENCES)}"
    )
    step: Annotated[float, Field(gt=0, le=0.1)] = Field(
        1e-5, description="a number above 0 and up to 0.1, the step of differences as a part of upper - lower"
    )
    population: Annotated[int, Field(ge=5, le=10_000)] | None = Field(
        None, description="a whole number of 5 or more, of differential-evolution; default: 15 a parameter"
    )
    seed: Annotated[int, Field(ge=0)] = Field(0, description="a whole number, of differential-evolution")
    parameters: dict[str, ParameterSection] = Field(description="tables [parameters.NAME]")
    objectives: dict[str, ObjectiveSection] = Field(description="tables [objectives.NAME]")
    constraints: dict[str, ConstraintSection] = Field({}, description="tables [constraints.NAME]")

    @field_validator("system", mode="before")
    @classmethod
    def _beside_the_design(cls, value: Any, info: ValidationInfo) -> Path:
        return existing(value, info, "system file")

    @model_validator(mode="after")
    def _fits(self) -> "DesignFile":
        if not self.parameters:
            raise ValueError("parameters: expected one table [parameters.NAME] at least")
        if not self.objectives:
            raise ValueError("objectives: expected one table [objectives.NAME] at least")
        twice = sorted(set(self.objectives) & set(self.constraints))
        if twice:
            raise ValueError(f"constraints.{twice[0]}: an objective has this name; give it another")
        paths = [path for section in self.parameters.values() for path in section.paths()]
        repeated = sorted({path for path in paths if paths.count(path) > 1})
        if repeated:
            raise ValueError(f"parameters: the key path {repeated[0]} stands twice")
        if self.method == "least-squares":
            if self.constraints:
                raise ValueError('constraints: method = "least-squares" takes none; take slsqp or trust-constr')
            plain = [name for name, o in self.objectives.items() if o.target is None and o.table is None]
            if plain:
                raise ValueError(f'objectives.{plain[0]}: method = "least-squares" expects a target or a table')
        tables = [name for name, o in self.objectives.items() if o.table is not None]
        if tables and self.analysis in ("eig", "static"):
            raise ValueError(f"objectives.{tables[0]}: table: analysis = {self.analysis!r} has no times; take a target")
        return self


def existing(value: Any, info: ValidationInfo, what: str) -> Path:
    """Return the path of a file beside the design file."""
    if not isinstance(value, str) or not value:
        raise ValueError(f"expected the path of a {what}, text")
    path = Path(info.context or ".") / value
    if not path.is_file():
        raise ValueError(f"no such file: {path}{near_file(path)}")
    return path


@dataclass(frozen=True)
class DesignParameter:
    """Numbers of the system file that take one value between bounds."""

    name: str
    paths: tuple[str, ...]
    lower: float
    upper: float
    start: float


@dataclass(frozen=True, eq=False)
class Quantity:
    """What is taken from an evaluation, and what is wanted of it."""

    output: Output
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
    study: Study  #: the system and the analysis; its only point is the start
    method: str
    processes: int | None
    iterations: int
    tolerance: float
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
        return tuple(v for p, v in zip(self.parameters, values, strict=True) for _ in p.paths)


def read_design(path: str | os.PathLike[str]) -> Design:
    """Read and check a design file.

    Raises
    ------
    SystemFileError
        With every problem: key path, value, what was expected, choices and the nearest name; for a key path that the
        system does not hold, or that leads to no number; for a table that cannot be read.
    """
    path = Path(path)
    data = validated(DesignFile, read_toml(path, SystemFileError), path, SystemFileError, context=path.parent)
    content = read_toml(data.system, SystemFileError)
    parameters = tuple(parameter_of(name, section, content, path) for name, section in data.parameters.items())
    objectives = []
    for name, o in data.objectives.items():
        times, values = (None, None) if o.table is None else read_table(o.table)
        sign = -1.0 if o.goal == "greatest" else 1.0
        objectives.append(Quantity(Output(name, o.of, o.take), o.weight, sign, o.target, times, values))
    constraints = tuple(
        Quantity(Output(name, c.of, c.take), least=c.least, most=c.most) for name, c in data.constraints.items()
    )
    study = Study(
        system=str(data.system),
        analysis=data.analysis,
        is_grid=False,
        processes=data.processes,
        parameters=tuple(Parameter(p.name, key, (p.start,)) for p in parameters for key in p.paths),
        outputs=tuple(q.output for q in (*objectives, *constraints)),
    )
    return Design(
        str(path), study, data.method, data.processes, data.iterations, data.tolerance, data.differences, data.step,
        data.population or 15 * len(parameters), data.seed, parameters, tuple(objectives), constraints,
        tuple(o.table for o in data.objectives.values() if o.table is not None),
    )  # fmt: skip


def parameter_of(name: str, section: ParameterSection, content: dict[str, Any], path: Path) -> DesignParameter:
    """Return a parameter; `SystemFileError` if a key path leads to no number, or the start is outside of its bounds."""
    where = f"{path}: parameters.{name}"
    found = []
    for key in section.paths():
        value = value_of(content, key, where, SystemFileError)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise SystemFileError(f"{where}: path = {key!r}: expected the place of a number, got {value!r:.60}")
        found.append(float(value))
    start = found[0] if section.start is None else section.start
    if not section.lower <= start <= section.upper:
        raise SystemFileError(
            f"{where}: the system file has {start:g} at {section.paths()[0]}, outside of the bounds {section.lower:g} "
            f"to {section.upper:g}; give start, or other bounds"
        )
    return DesignParameter(name, section.paths(), section.lower, section.upper, start)


def read_table(path: Path) -> tuple[Array, Array]:
    """Return times and values of a .csv file, both (n_t,); a first line without numbers is a heading.

    Raises
    ------
    SystemFileError
        With the line that does not hold two finite numbers, or whose time does not grow.
    """
    rows: list[tuple[float, float]] = []
    with open(path, newline="", encoding="utf-8-sig", errors="replace") as file:
        for i, cells in enumerate(csv.reader(file)):
            if not cells:
                continue
            try:
                t, value = (float(cell) for cell in cells)
            except ValueError:
                if i == 0:
                    continue
                raise SystemFileError(f"{path}, line {i + 1}: expected t,value, two numbers, got {cells}") from None
            if not (np.isfinite(t) and np.isfinite(value)):
                raise SystemFileError(f"{path}, line {i + 1}: expected finite numbers, got {cells}")
            if rows and t <= rows[-1][0]:
                before = rows[-1][0]
                raise SystemFileError(f"{path}, line {i + 1}: expected times that grow, got {t:g} after {before:g}")
            rows.append((t, value))
    if not rows:
        raise SystemFileError(f"{path}: expected lines t,value, got none")
    table = np.array(rows)
    return table[:, 0].copy(), table[:, 1].copy()
