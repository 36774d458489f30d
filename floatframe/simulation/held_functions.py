"""Functions of time in forces whose values are written between steps without a new compilation."""

from collections.abc import Iterator

import numpy as np

from fe_models.foundation.arrays import Array
from floatframe.engine.compiling.system import CompiledSystem
from floatframe.model.forces import BodyLoad, JointForce, PointForce
from floatframe.model.system import System

__all__ = ["force_numbers", "write_function"]


def force_numbers(system: System, compiled: CompiledSystem, names: set[str]) -> list[int]:
    """Return the indices of the functions that are factors or motor forces of the named forces."""
    model, found = compiled.model, []
    for kind, factors in ((PointForce, model.loads.factor), (BodyLoad, model.body_loads.factor)):
        forces = [force for force in system.forces if isinstance(force, kind)]
        found += [int(f) for force, f in zip(forces, factors, strict=True) if force.name in names and f >= 0]
    return found + [int(f) for f in motors_of(system, compiled, names) if f >= 0]


def motors_of(system: System, compiled: CompiledSystem, names: set[str]) -> Iterator[int]:
    """Yield the name of each force with a motor and the motor function, in the order of the system for each row."""
    model = compiled.model
    for k, (owner, coordinate) in enumerate(zip(compiled.owners, compiled.coordinates, strict=True)):
        forces = [
            f for f in system.forces if isinstance(f, JointForce) and (f.joint, f.coordinate) == (owner, coordinate)
        ]
        first, last = int(model.rows.force0[k]), int(model.rows.force1[k])
        if first == last:
            continue
        for force, motor in zip(forces, model.joint_forces.motor[first:last], strict=True):
            if force.name in names:
                yield int(motor)


def write_function(compiled: CompiledSystem, number: int, begin: float, coefficients: Array) -> None:
    """Set a function to one piece, Σ_k c_k (t - begin)^k, with up to six coefficients."""
    functions = compiled.model.functions
    piece = int(functions.piece0[number])
    row = np.zeros(functions.piece.shape[1])
    row[: len(coefficients)] = coefficients
    functions.begin[piece] = begin
    functions.piece[piece] = row
