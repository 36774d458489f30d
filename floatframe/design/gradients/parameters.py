"""Parameters of a system: their values, and the systems a little way off on both sides from which derivatives come."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.snapshot import Snapshot
from floatframe.design.gradients.differences import CENTRAL_FIRST, Stencil
from floatframe.design.gradients.paths import size_beside, value_at, with_value
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ModelError
from floatframe.model.system import System
from floatframe.results.head import Head
from floatframe.simulation.integration import head_of

__all__ = ["Family", "Neighbour", "Parameter", "Source", "family_of"]

Source = System | str | os.PathLike[str] | Callable[[dict[str, float]], System]

#: tables of a system file that do not change its motion
OUTSIDE = ("run", "inputs", "outputs", "fmu", "fmus", "cosimulation", "scene")
STEP = 1e-3  #: of differences by a parameter, relative to its size
SHORTER: tuple[float, ...] = (1.0, 1e-1, 1e-2, 1e-3)  #: of the step, tried where a system does not exist
SAME_ROW = 0.1  #: by which a direction of a row may differ within a step


@dataclass(frozen=True, eq=False)
class Neighbour:
    """The system with a parameter a little way off, as the kernels see it."""

    system: System
    compiled: CompiledSystem
    work: Work

    @cached_property
    def head(self) -> Head:
        """What results of it begin with."""
        return head_of(self.system, Snapshot(), 0.0, 0.0, 1.0, 1)  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Parameter:
    """One parameter: where it is, its value, and the systems around it."""

    name: str
    path: str
    value: float
    step: float
    stencil: Stencil
    around: tuple[Neighbour, ...]  #: at the offsets of the stencil

    def derivative(self, values: list[Array]) -> Array:
        """Return the derivative by the parameter of what has these values in the systems around it."""
        return self.stencil.derivative(values, self.step)


@dataclass(frozen=True, eq=False)
class Family:
    """A system and its neighbours."""

    system: System
    parameters: tuple[Parameter, ...]

    @property
    def values(self) -> Array:
        """Values of the parameters, (n_p,)."""
        return np.array([parameter.value for parameter in self.parameters])


def family_of(
    source: Source,
    parameters: Sequence[str] | Mapping[str, Any],
    *,
    steps: Mapping[str, float] | None = None,
) -> Family:
    """Return a system with its neighbours in the directions of parameters.

    Raises
    ------
    ModelError, SystemFileError
        If a path leads nowhere or to no number, a parameter changes what the system is made of (its topology), or
        no system exists near by.
    """
    make, system, paths, values = described(source, parameters)
    unknown = [name for name in steps or {} if name not in paths]
    if unknown:
        raise ModelError(f"sensitivities: steps: no parameter {quoted(unknown[0])}{nearest(unknown[0], paths)}")
    compiled = compiled_system(system)
    found = []
    tries: tuple[float, ...]
    for name, path in paths.items():
        value = values[name]
        if steps and name in steps:
            step, tries = float(steps[name]), (1.0,)
            if not (np.isfinite(step) and step > 0):
                raise ModelError(f"sensitivities: steps: {name!r}: expected a number above 0, got {steps[name]!r}")
        else:
            step, tries = STEP * natural_size(source, system, compiled, path, value), SHORTER
        found.append(with_neighbours(make, compiled, name, path, value, step, tries))
    return Family(system, tuple(found))


def described(source: Source, parameters: Sequence[str] | Mapping[str, Any]):
    """Return a function of a name and value that makes a system, the system itself, paths and values by name."""
    if isinstance(parameters, str):
        raise ModelError(f"sensitivities: parameters: expected a list of key paths, got the text {parameters!r}")
    if not len(parameters):
        raise ModelError("sensitivities: parameters: expected at least one")
    if callable(source) and not isinstance(source, System):
        if not isinstance(parameters, Mapping):
            raise ModelError("sensitivities: parameters of a function: expected a dict of names and values")
        at = {name: float(value) for name, value in parameters.items()}
        return (lambda name, value: source({**at, name: value})), source(dict(at)), {name: name for name in at}, at
    paths = dict(parameters) if isinstance(parameters, Mapping) else {path: path for path in parameters}
    for name, path in paths.items():
        if not isinstance(path, str):
            raise ModelError(f"sensitivities: parameter {name!r}: expected a key path, got {path!r}")
    if isinstance(source, System):
        at = {name: value_at(source, path) for name, path in paths.items()}
        return (lambda name, value: with_value(source, paths[name], value)), source, paths, at
    from floatframe.files.system_file.read_system import read_system

    path_of_file = os.fspath(source)
    at = numbers_of_file(path_of_file, paths)
    make = lambda name, value: read_system(path_of_file, {paths[name]: value})[0]  # noqa: E731
    return make, read_system(path_of_file)[0], paths, at


def numbers_of_file(path_of_file: str, paths: Mapping[str, str]) -> dict[str, float]:
    """Return the numbers at key paths of a system file; `SystemFileError` if one is not there."""
    from pathlib import Path

    from fe_models.foundation.toml_file import read_toml, value_of
    from floatframe.errors import SystemFileError

    for path in paths.values():
        if (table := path.partition(".")[0]) in OUTSIDE:
            raise SystemFileError(
                f"{path_of_file}: the key path {path!r}: the table [{table}] says how the system is run or looked at, "
                "and is no part of it; derivatives are by numbers of bodies, joints, forces, sensors, signals"
            )
    content = read_toml(Path(path_of_file), SystemFileError)
    found = {}
    for name, path in paths.items():
        value = value_of(content, path, path_of_file, SystemFileError)
        if isinstance(value, bool) or not isinstance(value, int | float):
            raise SystemFileError(
                f"{path_of_file}: the key path {path!r}: expected a number that can vary, there is {quoted(value)}"
            )
        found[name] = float(value)
    return found


def natural_size(source: Source, system: System, compiled: CompiledSystem, path: str, value: float) -> float:
    """Return the size of a parameter, for its step: its own, else that of the numbers beside it, else of the system."""
    if value != 0.0:
        return abs(value)
    beside = size_beside(system, path) if isinstance(source, System) else 0.0
    if beside > 0.0:
        return beside
    return compiled.length if "position" in path.split(".") else 1.0


def with_neighbours(
    make: Callable[[str, float], System], compiled: CompiledSystem, name: str, path: str, value: float, step: float,
    tries: Sequence[float],
) -> Parameter:  # fmt: skip
    """Return a parameter with the systems around it: central, else from one side, else with shorter steps."""
    first: Exception | None = None
    for factor in tries:
        for stencil in CENTRAL_FIRST:
            try:
                around = tuple(neighbour(make(name, value + k * factor * step)) for k in stencil.offsets)
            except ReportedError as error:
                first = first or error
                continue
            for each in around:
                require_same_topology(compiled, each.compiled, path)
            return Parameter(name, path, value, factor * step, stencil, around)
    raise ModelError(f"parameter {path!r}: no system exists near {value:.6g}: {first}") from first


def neighbour(system: System) -> Neighbour:
    """Return a system compiled."""
    compiled = compiled_system(system)
    return Neighbour(system, compiled, new_work(compiled.model))


def require_same_topology(compiled: CompiledSystem, other: CompiledSystem, path: str) -> None:
    """Raise `ModelError` unless both have the same bodies, modes, connections and rows, row by row."""
    own, its = compiled.model, other.model
    pairs = [
        (own.bodies.n_q, its.bodies.n_q), (own.connections.size, its.connections.size),
        (own.connections.law, its.connections.law), (own.markers.body, its.markers.body),
        (own.rows.kind, its.rows.kind), (own.rows.part, its.rows.part), (own.loads.marker, its.loads.marker),
        (own.joint_forces.table, its.joint_forces.table), (own.users.n_states, its.users.n_states),
    ]  # fmt: skip
    names = (compiled.body_names, compiled.connection_names) == (other.body_names, other.connection_names)
    if not names or any(not np.array_equal(a, b) for a, b in pairs):
        raise ModelError(
            f"parameter {path!r} changes the topology of the system (its bodies, modes, joints or what they hold), so "
            "that motions before and after cannot be compared; it has no derivative"
        )
    for part in ("x", "y", "z", "u"):
        turn = np.abs(getattr(own.rows, part) - getattr(its.rows, part)).max(initial=0.0)
        if turn > SAME_ROW:
            raise ModelError(
                f"parameter {path!r}: directions of a joint jump with it (the axis lies midway between axes of its "
                "marker, from which normals are chosen); give the marker a triad turned a little, or vary the triad"
            )
