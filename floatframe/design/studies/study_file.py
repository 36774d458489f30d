"""The study file, which `floatframe sweep` reads (docs/sweeps.md)."""

import itertools
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, model_validator

from fe_models.foundation.presentation import presented
from fe_models.foundation.tasks.task_map import WorkerError
from fe_models.foundation.tasks.workers import WORKERS_HELP, checked_workers
from fe_models.foundation.toml_file import Table, choice, existing_file, kind_field, read_toml, validated
from floatframe.errors import SystemFileError

__all__ = ["ANALYSES", "TAKES", "Output", "Parameter", "Study", "read_study", "workers_of_file"]

ANALYSES = ("run", "static", "modes", "kinematics", "inverse")
COMBINATIONS = ("all", "together")
SCALES = ("linear", "log")
TAKES = {  # name -> function from the values over time, (n_t,), to a number
    "last": lambda values: values[-1],
    "first": lambda values: values[0],
    "least": lambda values: values.min(),
    "greatest": lambda values: values.max(),
    "largest": lambda values: np.abs(values).max(),
    "mean": lambda values: values.mean(),
    "rms": lambda values: np.sqrt((values**2).mean()),
    "range": lambda values: np.ptp(values),
}
MOST_POINTS = 100_000


def workers_of_file(value: Any) -> int | str:
    """Return the workers given in a file."""
    if isinstance(value, bool) or not isinstance(value, int | str):
        raise ValueError(f"expected {WORKERS_HELP}")
    try:
        return checked_workers(value)
    except WorkerError as error:
        raise ValueError(str(error)) from None


def list_as_tuple(value: Any) -> Any:
    """Return a list of the file as a tuple."""
    return tuple(value) if isinstance(value, list) else value


class ParameterSection(Table):
    """[parameters.NAME]: a key of the system file and its values."""

    path: str = Field(description="the key path in the system file, text, such as bodies.rod.mass")
    values: Annotated[tuple[Any, ...], BeforeValidator(list_as_tuple)] | None = Field(
        None, description="a list of values"
    )
    first: float | None = Field(None, description="a number, the first value")
    last: float | None = Field(None, description="a number, the last value")
    number: Annotated[int, Field(ge=1, le=MOST_POINTS)] | None = Field(
        None, description=f"a whole number above 0 and up to {MOST_POINTS}, the number of values"
    )
    scale: choice("scale", lambda: SCALES) = Field(  # type: ignore[valid-type]
        "linear", description=f"one of {', '.join(SCALES)}"
    )

    @model_validator(mode="after")
    def _one_way(self) -> "ParameterSection":
        spaced = [key for key in ("first", "last", "number") if getattr(self, key) is not None]
        if self.values is not None and spaced:
            raise ValueError(f"expected either values or first, last and number, got values and {', '.join(spaced)}")
        if self.values is None and len(spaced) < 3:
            raise ValueError("expected values, or first, last and number")
        if self.values is not None and not self.values:
            raise ValueError("values: expected one value at least")
        if self.scale == "log" and (self.values is not None or min(self.first or 0.0, self.last or 0.0) <= 0):
            raise ValueError('scale = "log": expected first and last above 0')
        return self

    def all_values(self) -> tuple[Any, ...]:
        """Return the values in the form used in the system file."""
        if self.values is not None:
            return self.values
        assert self.first is not None and self.last is not None and self.number is not None  # noqa: PT018
        space = np.geomspace if self.scale == "log" else np.linspace
        return tuple(float(value) for value in space(self.first, self.last, self.number))


class OutputSection(Table):
    """[outputs.NAME]: a number computed from the result of every point."""

    of: str = Field(description='a sensor and its column ("tip size"), or of modes "frequency 1", "damping 1"')
    take: choice("way to take a number", lambda: tuple(TAKES)) = Field(  # type: ignore[valid-type]
        "last", description=f"one of {', '.join(TAKES)}"
    )


class StudyFile(Table):
    """A parameter study of a system."""

    kind: str = kind_field("sweep")
    system: Annotated[Path, BeforeValidator(existing_file("system file"))] = Field(
        description="the path of a system file, relative to this file"
    )
    analysis: choice("analysis", lambda: ANALYSES) = Field(  # type: ignore[valid-type]
        "run", description=f"one of {', '.join(ANALYSES)}"
    )
    combine: choice("combination", lambda: COMBINATIONS) = Field(  # type: ignore[valid-type]
        "all", description="all: all combinations of values; together: all first values, all second values and so on"
    )
    workers: Annotated[int | str, BeforeValidator(workers_of_file)] | None = Field(
        None, description=f"{WORKERS_HELP}; default: one process per processor"
    )
    parameters: dict[str, ParameterSection] = Field(description="tables [parameters.NAME]")
    outputs: dict[str, OutputSection] = Field(description="tables [outputs.NAME]")

    @model_validator(mode="after")
    def _fits(self) -> "StudyFile":
        if not self.parameters:
            raise ValueError("parameters: expected one table [parameters.NAME] at least")
        if not self.outputs:
            raise ValueError("outputs: expected one table [outputs.NAME] at least")
        counts = {name: len(section.all_values()) for name, section in self.parameters.items()}
        if self.combine == "together" and len(set(counts.values())) > 1:
            told = ", ".join(f"{name} {count}" for name, count in counts.items())
            raise ValueError(f'combine = "together": expected as many values of each parameter, got {told}')
        if self.combine == "all" and np.prod([float(count) for count in counts.values()]) > MOST_POINTS:
            raise ValueError(f"these are more than {MOST_POINTS} points; take fewer values, or combine them together")
        return self


@dataclass(frozen=True)
class Parameter:
    """A key of the system file and its values."""

    name: str
    path: str
    values: tuple[Any, ...]


@dataclass(frozen=True)
class Output:
    """A number computed from the result of a point."""

    name: str
    of: str
    take: str


@presented
@dataclass(frozen=True)
class Study:
    """A system, its parameters, and the outputs."""

    system: str  #: path of the system file
    analysis: str
    is_grid: bool  #: whether all combinations of values are computed
    workers: int | str | None
    parameters: tuple[Parameter, ...]
    outputs: tuple[Output, ...]
    given: Mapping[str, Any] = field(default_factory=dict)  #: values of other keys of the system file, at all points

    def points(self) -> Iterator[tuple[Any, ...]]:
        """Yield the parameter values of every point; the last parameter varies fastest."""
        values = [parameter.values for parameter in self.parameters]
        yield from itertools.product(*values) if self.is_grid else zip(*values, strict=True)

    def changes(self, point: tuple[Any, ...]) -> dict[str, Any]:
        """Return the values of a point and those that are the same at all points, by key path."""
        return {**self.given} | {parameter.path: value for parameter, value in zip(self.parameters, point, strict=True)}


def read_study(path: str | os.PathLike[str]) -> Study:
    """Read and check a study file.

    Parameters
    ----------
    path
        Name of the study file (TOML).

    Raises
    ------
    SystemFileError
        If the file is not valid. The message lists every problem, with key path, value, expected value and nearest
        name.
    """
    path = Path(path)
    data = validated(StudyFile, read_toml(path, SystemFileError), path, SystemFileError, context=path.parent)
    return Study(
        system=str(data.system),
        analysis=data.analysis,
        is_grid=data.combine == "all",
        workers=data.workers,
        parameters=tuple(
            Parameter(name, section.path, section.all_values()) for name, section in data.parameters.items()
        ),
        outputs=tuple(Output(name, section.of, section.take) for name, section in data.outputs.items()),
    )
