"""Parameters of a system: their values, and the systems at small offsets, from which derivatives are computed."""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.errors import ReportedError
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.snapshot import Snapshot
from floatframe.design.gradients.differences import CENTRAL_FIRST, Stencil
from floatframe.engine.compiling.placing import placed_bodies
from floatframe.engine.compiling.system import CompiledSystem, compiled_system
from floatframe.engine.kernels.work import Work, new_work
from floatframe.errors import ModelError
from floatframe.model.forces import Gravity
from floatframe.model.rotations import euler_parameter_product, euler_parameters_of_rotation_vector
from floatframe.model.system import System
from floatframe.results.head import Head
from floatframe.simulation.motion_head import head_of

__all__ = [
    "Family",
    "Neighbour",
    "Parameter",
    "Source",
    "family_of",
    "has_same_topology",
    "size_beside",
    "topology_error",
    "value_at",
    "with_value",
]


# numbers of a system by key path, such as "bodies.rod.mass" or "joints.pin.marker_b.position.0" -----------------------
# A path leads through the names of a system to fields of its parts, entries of mappings and indices of lists and
# arrays:
#
#     bodies.NAME.mass, .inertia.0.0, .position.1, .velocity.0, .omega_B.2, .q.0, .reduced.K.0.0, .reduced.D.1.1
#     bodies.NAME.turn.2                    a rotation of the body at the start about its axis [rad], zero as placed
#     bodies.NAME.position.1                for a body without a position: the one that its joints determine
#     joints.NAME.marker_b.position.0       joints.NAME.motions.angle.pieces.0.6
#     forces.NAME.stiffness                 forces.NAME.parameters.kp         couplers.NAME.terms.0.1       gravity.1
#
# In a symmetric matrix both entries of a pair change together. Parts that are "as placed" move with their neighbours.


LISTS = ("bodies", "joints", "forces", "couplers")
TURN = "turn"
SYMMETRIC = 1e-9  #: largest asymmetry of a matrix, relative to its largest entry, as in `RigidBody`


def value_at(system: System, path: str) -> float:
    """Return the number at a key path.

    Raises
    ------
    ModelError
        If the path does not exist (the message suggests the nearest name), or is not a number that can vary.
    """
    return float(visit(system, path, path, None)[1])


def with_value(system: System, path: str, value: float) -> System:
    """Return the system with another number at a key path; `ModelError` if the system does not accept it."""
    return visit(system, path, path, value)[0]


def size_beside(system: System, path: str) -> float:
    """Return the largest number of the array that contains the path; 0 for a single number."""
    parts = path.split(".")
    for k in range(len(parts) - 1, 0, -1):
        found: Any = None
        try:
            found = part_at(system, ".".join(parts[:k]))
        except ModelError:
            continue
        if isinstance(found, np.ndarray):
            return float(np.abs(found).max(initial=0.0))
        return 0.0
    return 0.0


def part_at(system: System, path: str) -> Any:
    """Return the object at a path, of any type."""
    found: list[Any] = []
    visit(system, path, path, None, found)
    return found[0]


def visit(here: Any, left: str, path: str, value: float | None, found: list[Any] | None = None) -> tuple[Any, Any]:
    """Return a copy of a part with the value at the rest of the path, and the previous value there.

    `found`: receives the object at the end of the path, instead of a number.
    """
    if not left:
        if found is not None:
            found.append(here)
            return here, here
        if isinstance(here, bool) or not isinstance(here, int | float | np.floating):
            told = "nothing (it is found as placed)" if here is None else quoted(here)
            raise ModelError(f"parameter {path!r}: expected the path of a number that can vary, there is {told}")
        return (here if value is None else value), here
    if isinstance(here, System):
        return visit_system(here, left, path, value, found)
    if isinstance(here, np.ndarray):
        return visit_array(here, left, path, value, found)
    if isinstance(here, Mapping):
        key = longest(left, list(here), path)
        child, old = visit(here[key], left[len(key) + 1 :], path, value, found)
        return {**here, key: child}, old
    if isinstance(here, tuple | list):
        head, _, rest = left.partition(".")
        index = index_of(head, len(here), path)
        child, old = visit(here[index], rest, path, value, found)
        return (*here[:index], child, *here[index + 1 :]), old
    if is_dataclass(here):
        return visit_record(here, left, path, value, found)
    raise ModelError(f"parameter {path!r}: the path goes on after a value: {quoted(here)}")


def visit_system(system: System, left: str, path: str, value: Any, found: list[Any] | None) -> tuple[System, Any]:
    """Follow a path from a system to its gravity, or to a named part of one of its lists."""
    head, _, rest = left.partition(".")
    if head == "gravity":
        forces = [k for k, force in enumerate(system.forces) if isinstance(force, Gravity)]
        if len(forces) != 1:
            raise ModelError(f"parameter {path!r}: expected a system with one Gravity, got {len(forces)}")
        force = system.forces[forces[0]]
        child, old = visit_record(force, f"acceleration.{rest}" if rest else "acceleration", path, value, found)
        changed = (*system.forces[: forces[0]], child, *system.forces[forces[0] + 1 :])
        return replace(system, forces=changed), old
    if head not in LISTS:
        raise ModelError(f"parameter {path!r}: there is no {quoted(head)}{nearest(head, (*LISTS, 'gravity'))}")
    parts = getattr(system, head)
    names = [getattr(part, "name", "") for part in parts]
    name = longest(rest, [each for each in names if each], path)
    k, rest = names.index(name), rest[len(name) + 1 :]
    part = parts[k]
    if head == "bodies" and part.position is None and rest.partition(".")[0] in ("position", TURN):
        part = placed_bodies(system)[k]
    child, old = visit(part, rest, path, value, found)
    if child is part:
        return system, old
    return replace(system, **{head: (*parts[:k], child, *parts[k + 1 :])}), old  # type: ignore[arg-type]


def visit_record(here: Any, left: str, path: str, value: Any, found: list[Any] | None) -> tuple[Any, Any]:
    """Follow a path from a data class to one of its fields; a marker without position is at the origin."""
    names = [part.name for part in fields(here)]
    key, _, rest = left.partition(".")
    if key == TURN and "orientation" in names:
        index = index_of(rest, 3, path)
        if value is None:
            return here, 0.0
        theta = np.zeros(3)
        theta[index] = value
        turned = euler_parameter_product(here.orientation, euler_parameters_of_rotation_vector(theta))
        return replace(here, orientation=turned), 0.0
    if key not in names:
        more = [TURN] if "orientation" in names else []
        raise ModelError(f"parameter {path!r}: there is no {quoted(key)}{nearest(key, [*names, *more])}")
    if key == "orientation":
        raise ModelError(
            f"parameter {path!r}: Euler parameters have length one and cannot vary alone; take {TURN}.0, {TURN}.1 or "
            f"{TURN}.2, a rotation about an axis of the body"
        )
    part = getattr(here, key)
    if part is None and key == "position":
        part = np.zeros(3)
    child, old = visit(part, rest, path, value, found)
    return (here if value is None else replace(here, **{key: child})), old


def visit_array(here: np.ndarray, left: str, path: str, value: Any, found: list[Any] | None) -> tuple[Any, Any]:
    """Follow a path to an entry of an array; for a symmetric matrix, both entries of a pair change."""
    parts = left.split(".")
    if len(parts) != here.ndim:
        raise ModelError(f"parameter {path!r}: expected {here.ndim} indices of an array {here.shape}, got {left!r}")
    at = tuple(index_of(part, n, path) for part, n in zip(parts, here.shape, strict=True))
    old = float(here[at])
    if found is not None:
        found.append(old)
    if value is None:
        return here, old
    changed = np.array(here)
    if here.ndim == 2 and here.shape[0] == here.shape[1] and is_symmetric(here):
        changed[at[::-1]] = value
    changed[at] = value
    return changed, old


def is_symmetric(A: np.ndarray) -> bool:
    """Return whether a matrix is symmetric within the tolerance of bodies and forces."""
    return bool(np.abs(A - A.T).max() <= SYMMETRIC * np.abs(A).max())


def longest(left: str, choices: list[Any], path: str) -> Any:
    """Return the longest name with which a path continues."""
    fitting = [key for key in choices if left == key or left.startswith(f"{key}.")]
    if not fitting:
        name = left.split(".")[0]
        raise ModelError(f"parameter {path!r}: there is no {quoted(name)}{nearest(name, choices)}")
    return max(fitting, key=len)


def index_of(text: str, n: int, path: str) -> int:
    """Return the index in a text."""
    if not text.isdigit() or int(text) >= n:
        raise ModelError(f"parameter {path!r}: expected an index of 0 to {n - 1}, got {text!r}")
    return int(text)


# parameters -----------------------------------------------------------------------------------------------------------


Source = System | str | os.PathLike[str] | Callable[[dict[str, float]], System]

#: tables of a system file that do not affect its motion
OUTSIDE = ("run", "inputs", "outputs", "fmu", "fmus", "cosimulation", "scene")
STEP = 1e-3  #: step of finite differences by a parameter, relative to its magnitude
SHORTER: tuple[float, ...] = (1.0, 1e-1, 1e-2, 1e-3)  #: factors of the step, tried in order if a system does not exist
SAME_ROW = 0.1  #: largest change of the direction of a row within a step


@dataclass(frozen=True, eq=False)
class Neighbour:
    """The system with a slightly changed parameter, compiled."""

    system: System
    compiled: CompiledSystem
    work: Work

    @cached_property
    def head(self) -> Head:
        """Header of its results."""
        return head_of(self.system, Snapshot(), 0.0, 0.0, 1.0, 1)  # type: ignore[arg-type]


@dataclass(frozen=True, eq=False)
class Parameter:
    """One parameter: its path, value, and neighbouring systems."""

    name: str
    path: str
    value: float
    step: float
    stencil: Stencil
    around: tuple[Neighbour, ...]  #: at the offsets of the stencil

    def derivative(self, values: list[Array]) -> Array:
        """Return the derivative by the parameter from values in the neighbouring systems."""
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
    """Return a system with its neighbours for each parameter.

    Raises
    ------
    ModelError, SystemFileError
        If a path does not lead to a number, a parameter changes the topology of the system, or no system exists for
        neighbouring values.
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
    """Return a function from a name and value to a system, the system itself, and paths and values by name."""
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
    from floatframe.files.system_file.bodies import ReadBodies
    from floatframe.files.system_file.read_system import read_system

    path_of_file = os.fspath(source)
    at = numbers_of_file(path_of_file, paths)
    bodies: ReadBodies = {}
    make = lambda name, value: read_system(path_of_file, {paths[name]: value}, read_bodies=bodies)[0]  # noqa: E731
    return make, read_system(path_of_file, read_bodies=bodies)[0], paths, at


def numbers_of_file(path_of_file: str, paths: Mapping[str, str]) -> dict[str, float]:
    """Return the numbers at key paths of a system file; `SystemFileError` if one does not exist."""
    from pathlib import Path

    from fe_models.foundation.parametric_file import read_parametric
    from fe_models.foundation.toml_file import value_of
    from floatframe.errors import SystemFileError

    for path in paths.values():
        if (table := path.partition(".")[0]) in OUTSIDE:
            raise SystemFileError(
                f"{path_of_file}: the key path {path!r}: the table [{table}] describes the run or the display, "
                "not the system; expected a number of a body, joint, force, sensor or signal"
            )
    content = read_parametric(Path(path_of_file), SystemFileError)
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
    """Return the magnitude of a parameter: its own, or that of neighbouring numbers, or that of the system."""
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
    """Return a parameter with the systems of its difference stencil.

    Central differences are tried first, then one-sided ones, then both with shorter steps.
    """
    first: Exception | None = None
    for factor in tries:
        for stencil in CENTRAL_FIRST:
            try:
                around = tuple(neighbour(make(name, value + k * factor * step)) for k in stencil.offsets)
            except ReportedError as error:
                first = first or error
                continue
            for each in around:
                if not has_same_topology(compiled, each.compiled):
                    raise topology_error(path, "it has no derivative")
                require_same_directions(compiled, each.compiled, path)
            return Parameter(name, path, value, factor * step, stencil, around)
    raise ModelError(f"parameter {path!r}: no system exists near {value:.6g}: {first}") from first


def neighbour(system: System) -> Neighbour:
    """Compile a system, and return it as a `Neighbour`: the system itself, or one with a changed parameter."""
    compiled = compiled_system(system)
    return Neighbour(system, compiled, new_work(compiled.model))


def has_same_topology(compiled: CompiledSystem, other: CompiledSystem) -> bool:
    """Whether both have the same bodies, modes, connections and rows, row by row."""
    own, its = compiled.model, other.model
    pairs = [
        (own.bodies.n_q, its.bodies.n_q), (own.connections.size, its.connections.size),
        (own.connections.law, its.connections.law), (own.markers.body, its.markers.body),
        (own.rows.kind, its.rows.kind), (own.rows.part, its.rows.part), (own.loads.marker, its.loads.marker),
        (own.joint_forces.table, its.joint_forces.table), (own.elements.n_states, its.elements.n_states),
    ]  # fmt: skip
    names = (compiled.body_names, compiled.connection_names) == (other.body_names, other.connection_names)
    return names and all(np.array_equal(a, b) for a, b in pairs)


def topology_error(path: str, consequence: str) -> ModelError:
    """Return the error about a parameter that changes the topology of its system."""
    return ModelError(
        f"parameter {path!r} changes the topology of the system (its bodies, modes, joints or constraints), so "
        f"that motions before and after cannot be compared; {consequence}"
    )


def require_same_directions(compiled: CompiledSystem, other: CompiledSystem, path: str) -> None:
    """Raise `ModelError` if the directions of a joint jump between two compiled systems."""
    own, its = compiled.model, other.model
    for part in ("x", "y", "z", "u"):
        turn = np.abs(getattr(own.rows, part) - getattr(its.rows, part)).max(initial=0.0)
        if turn > SAME_ROW:
            raise ModelError(
                f"parameter {path!r}: directions of a joint jump with it (the axis lies midway between axes of its "
                "marker, from which normals are chosen); rotate the triad of the marker a little, or vary the triad"
            )
