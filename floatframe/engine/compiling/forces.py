"""Forces as flat arrays, and the functions of time or of coordinates that forces and prescribed motions share."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cms.errors import CmsError
from fe_models.foundation.arrays import Array
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.bodies import integers, offsets
from floatframe.engine.compiling.markers import find_body
from floatframe.engine.kernels.model import BodyLoads, JointForces
from floatframe.engine.kernels.model import Functions as FunctionPieces
from floatframe.engine.kernels.records import filled, flat
from floatframe.errors import ModelError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.bodies.markers import body_name
from floatframe.model.forces import BodyLoad, JointForce
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.joints import Joint
from floatframe.model.joints.rows import Row, kind_of, loaded_row
from floatframe.model.system import System

__all__ = ["Functions", "body_loads", "joint_forces", "with_forces"]


@dataclass
class Functions:
    """Functions of time and of coordinates in the order in which they are compiled."""

    known: list[TimeFunction] = field(default_factory=list)

    def index(self, function: TimeFunction | None) -> int:
        """Return the number of a function, -1 for None."""
        if function is None:
            return -1
        self.known.append(function)
        return len(self.known) - 1

    def record(self) -> FunctionPieces:
        """Return the pieces of all functions as one record, one function after another."""
        return filled(
            FunctionPieces(),
            piece0=offsets(integers([len(function.begins) for function in self.known])),
            begin=flat([function.begins for function in self.known]),
            piece=flat([function.pieces for function in self.known]),
        )


def with_forces(joint: Joint, rows: Sequence[Row], forces: Sequence[JointForce]) -> list[Row]:
    """Return the rows of a joint with force rows for loaded coordinates; `ModelError` if a force cannot act there."""
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


def joint_forces(
    system: System, rows: Sequence[Row], owner: Sequence[str], functions: Functions
) -> tuple[JointForces, list[int]]:
    """Return the forces along joint coordinates sorted by row, and each row's first index, followed by their number.

    owner: name of the joint of each row.
    """
    forces = [force for force in system.forces if isinstance(force, JointForce)]
    names = [joint.name for joint in system.joints]
    for force in forces:
        if force.joint not in names:
            raise ModelError(f"force {force.name!r}: no joint {quoted(force.joint)}{nearest(force.joint, names)}")
    of_row = [
        [f for f in forces if row.coordinate and (f.joint, f.coordinate) == (name, row.coordinate.name)]
        for row, name in zip(rows, owner, strict=True)
    ]
    ordered = [force for group in of_row for force in group]
    for force in forces:
        if not any(force is other for other in ordered):
            raise ModelError(
                f"force {force.name!r}: coordinate {force.coordinate!r} of joint {force.joint!r} follows a deformed "
                "line and cannot take a force; take a user force along an axial distance between two markers"
            )
    record = filled(
        JointForces(),
        stiffness=[force.stiffness for force in ordered],
        free=[force.free for force in ordered],
        damping=[force.damping for force in ordered],
        preload=[force.preload for force in ordered],
        friction=[force.friction for force in ordered],
        coefficient=[force.friction_coefficient for force in ordered],
        speed=[force.friction_speed for force in ordered],
        motor=[functions.index(force.motor) for force in ordered],  # type: ignore[arg-type]  # no number any more
        table=[functions.index(force.characteristic) for force in ordered],
    )
    return record, [0, *np.cumsum([len(group) for group in of_row], dtype=int)]


def body_loads(system: System, functions: Functions) -> BodyLoads:
    """Return the load cases on bodies; `ModelError` if a body or a load case does not exist."""
    loads = [force for force in system.forces if isinstance(force, BodyLoad)]
    bodies, values, first, n = [], [], [], 0
    for load in loads:
        where = f"force {load.name!r}"
        index = find_body(system, f"{where}: body", body_name(load.body))
        body = system.bodies[index] if index >= 0 else None
        if not isinstance(body, FlexibleBody):
            raise ModelError(f"{where}: body {body_name(load.body)!r} is not flexible and has no load cases")
        try:
            case = body.moved.load_case(load.load_case)
        except CmsError as error:
            raise ModelError(f"{where}: {error}") from None
        part: Array = np.concatenate([case.force, case.torque, case.h])
        bodies.append(index)
        first.append(n)
        values.append(part)
        n += len(part)
    factors = [functions.index(load.amplitude) for load in loads]  # type: ignore[arg-type]
    return filled(BodyLoads(), body=bodies, factor=factors, value0=first, values=flat(values))
