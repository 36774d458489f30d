"""Forces as flat arrays, and the functions of time and of coordinates that they and drives share."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cms.errors import CmsError
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest
from floatframe.bodies.flexible_body import FlexibleBody
from floatframe.bodies.markers import body_name
from floatframe.compiling.bodies import integers, offsets, stacked
from floatframe.compiling.markers import find_body
from floatframe.errors import ModelError
from floatframe.forces import BodyLoad, JointForce
from floatframe.functions.time_functions import N_COEFFICIENTS, TimeFunction
from floatframe.joints import Joint
from floatframe.joints.rows import Row, kind_of, loaded_row
from floatframe.system import System

__all__ = ["Functions", "body_load_arrays", "joint_force_arrays", "with_forces"]


@dataclass
class Functions:
    """Functions in the order in which they are met."""

    known: list[TimeFunction] = field(default_factory=list)

    def index(self, function: TimeFunction | None) -> int:
        """Return the number of a function, -1 for none."""
        if function is None:
            return -1
        self.known.append(function)
        return len(self.known) - 1

    def arrays(self) -> dict[str, Any]:
        """Return the pieces of all, one function after another."""
        return {
            "piece0": offsets(integers([len(function.begins) for function in self.known])),
            "piece_t": np.concatenate([*(function.begins for function in self.known), np.zeros(0)]),
            "piece": np.concatenate([*(function.pieces for function in self.known), np.zeros((0, N_COEFFICIENTS))]),
        }


def with_forces(joint: Joint, rows: Sequence[Row], forces: Sequence[JointForce]) -> list[Row]:
    """Return the rows of a joint, those of coordinates with forces replaced; `ModelError` where that cannot be."""
    result = list(rows)
    for force in forces:
        where = f"force {force.name!r}"
        choices = [row.coordinate_name for row in rows if row.coordinate and kind_of(row.kind).is_free]
        prescribed = [row.coordinate_name for row in rows if row.coordinate and kind_of(row.kind).holds]
        if force.coordinate in prescribed:
            raise ModelError(f"{where}: the coordinate {force.coordinate!r} of joint {joint.name!r} is prescribed")
        if force.coordinate not in choices:
            raise ModelError(
                f"{where}: joint {joint.name!r} has no coordinate {force.coordinate!r} that can take a force"
                f"{nearest(force.coordinate, choices)}"
            )
        k = [row.coordinate_name for row in rows].index(force.coordinate)
        result[k] = loaded_row(rows[k])
    return result


def joint_force_arrays(system: System, rows: Sequence[Row], owner: Sequence[str], functions: Functions) -> dict:
    """Return the forces along coordinates, sorted by row; owner: name of the joint of each row."""
    forces = [force for force in system.forces if isinstance(force, JointForce)]
    names = [joint.name for joint in system.joints]
    for force in forces:
        if force.joint not in names:
            raise ModelError(f"force {force.name!r}: no joint {force.joint!r}{nearest(force.joint, names)}")
    of_row = [
        [f for f in forces if row.coordinate and (f.joint, f.coordinate) == (name, row.coordinate.name)]
        for row, name in zip(rows, owner, strict=True)
    ]
    ordered = [force for group in of_row for force in group]
    ends = np.cumsum([0] + [len(group) for group in of_row])
    numbers = [
        [f.stiffness, f.free, f.damping, f.preload, f.friction, f.friction_coefficient, f.friction_speed]
        for f in ordered
    ]
    return {
        "row_force0": integers(list(ends[:-1])),
        "row_force1": integers(list(ends[1:])),
        "joint_forces": stacked(numbers, (7,)),
        "joint_force_motor": integers([functions.index(force.motor) for force in ordered]),
        "joint_force_table": integers([functions.index(force.characteristic) for force in ordered]),
    }


def body_load_arrays(system: System, functions: Functions) -> dict[str, Any]:
    """Return the load cases that act on bodies; `ModelError` if a body or a load case is not there."""
    loads = [force for force in system.forces if isinstance(force, BodyLoad)]
    bodies, values, first, n = [], [], [], 0
    for load in loads:
        where = f"force {load.name!r}"
        index = find_body(system, f"{where}: body", body_name(load.body))
        body = system.bodies[index] if index >= 0 else None
        if not isinstance(body, FlexibleBody):
            raise ModelError(f"{where}: body {body_name(load.body)!r} is not flexible and has no load cases")
        try:
            case = body.reduced.load_case(load.load_case)
        except CmsError as error:
            raise ModelError(f"{where}: {error}") from None
        part: Array = np.concatenate([case.force, case.torque, case.h])
        bodies.append(index)
        first.append(n)
        values.append(part)
        n += len(part)
    return {
        "d_body": integers(bodies),
        "d_factor": integers([functions.index(load.amplitude) for load in loads]),  # type: ignore[arg-type]
        "d_first": integers(first),
        "d_values": np.concatenate([*values, np.zeros(0)]),
    }
