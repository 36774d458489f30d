"""Numbers of a system by key path, such as "bodies.rod.mass" or "joints.pin.marker_b.position.0".

A path leads through the names of a system to fields of its parts, entries of mappings and indices of lists and arrays:

    bodies.NAME.mass, .inertia.0.0, .position.1, .velocity.0, .omega_B.2, .q.0, .reduced.K.0.0, .reduced.D.1.1
    bodies.NAME.turn.2                    a rotation of the body at the start about its axis [rad], zero as placed
    joints.NAME.marker_b.position.0       joints.NAME.motions.angle.pieces.0.6
    forces.NAME.stiffness                 forces.NAME.parameters.kp         couplers.NAME.terms.0.1       gravity.1

Of a symmetric matrix both entries of a pair change together. Parts that stand "as placed" follow what they stand on.
"""

from collections.abc import Mapping
from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from fe_models.foundation.words import nearest, quoted
from floatframe.errors import ModelError
from floatframe.model.forces import Gravity
from floatframe.model.rotations import euler_parameter_product, euler_parameters_of_rotation_vector
from floatframe.model.system import System

__all__ = ["size_beside", "value_at", "with_value"]

LISTS = ("bodies", "joints", "forces", "couplers")
TURN = "turn"
SYMMETRIC = 1e-9  #: defect of a matrix by its largest entry, as `RigidBody` allows it


def value_at(system: System, path: str) -> float:
    """Return the number at a key path.

    Raises
    ------
    ModelError
        With the nearest name, if there is none, or it is no number that could vary.
    """
    return float(visit(system, path, path, None)[1])


def with_value(system: System, path: str, value: float) -> System:
    """Return the system with another number at a key path; `ModelError` if it is impossible there."""
    return visit(system, path, path, value)[0]


def size_beside(system: System, path: str) -> float:
    """Return the largest number of the array in which the one at the path stands, 0 for one that stands alone."""
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
    """Return what stands at a path, whatever it is."""
    found: list[Any] = []
    visit(system, path, path, None, found)
    return found[0]


def visit(here: Any, left: str, path: str, value: float | None, found: list[Any] | None = None) -> tuple[Any, Any]:
    """Return a copy of a part with the value at what is left of the path, and the value that was there.

    `found`: takes what stands at the end, in place of a number.
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
    """Go on from a system: to its gravity, or to a part of one of its lists by name."""
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
    k = names.index(name)
    child, old = visit(parts[k], rest[len(name) + 1 :], path, value, found)
    if child is parts[k]:
        return system, old
    return replace(system, **{head: (*parts[:k], child, *parts[k + 1 :])}), old  # type: ignore[arg-type]


def visit_record(here: Any, left: str, path: str, value: Any, found: list[Any] | None) -> tuple[Any, Any]:
    """Go on from a data class to one of its fields; a marker without position stands at the origin."""
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
    """Go on to an entry of an array; of a symmetric matrix both entries of a pair change."""
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
    """Whether a matrix is symmetric as bodies and forces take it: a turned tensor is but for the last bits."""
    return bool(np.abs(A - A.T).max() <= SYMMETRIC * np.abs(A).max())


def longest(left: str, choices: list[Any], path: str) -> Any:
    """Return the longest of the names with which a path goes on."""
    fitting = [key for key in choices if left == key or left.startswith(f"{key}.")]
    if not fitting:
        name = left.split(".")[0]
        raise ModelError(f"parameter {path!r}: there is no {quoted(name)}{nearest(name, choices)}")
    return max(fitting, key=len)


def index_of(text: str, n: int, path: str) -> int:
    """Return an index from its text."""
    if not text.isdigit() or int(text) >= n:
        raise ModelError(f"parameter {path!r}: expected an index of 0 to {n - 1}, got {text!r}")
    return int(text)
