"""Connections in the order of their compilation: their ends, wrenches and rows."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import IntArray
from floatframe.engine.compiling.forces import with_forces
from floatframe.engine.compiling.markers import MarkerData, find_marker, joint_markers, marker_pose
from floatframe.engine.kernels.model import JOINT
from floatframe.engine.kernels.model import SPRING as SPRING_LAW
from floatframe.errors import ModelError
from floatframe.model.forces import JointForce, SpringDamper
from floatframe.model.joints import Joint
from floatframe.model.joints.rows import FORCE, MOMENT, NO_MOMENT, SPRING, VELOCITY, Row, kind_of
from floatframe.model.state import State
from floatframe.model.system import System

__all__ = ["Connections", "End", "add_joint", "add_spring"]


@dataclass(frozen=True, eq=False)
class End:
    """A marker of a connection, and the index of its part of the wrench."""

    marker: MarkerData
    sign: float  #: +1 at A, -1 at B
    force: int = FORCE  #: -1: none
    moment: int = NO_MOMENT


@dataclass
class Connections:
    """Lists over connections, their markers and rows."""

    placed: State
    n_q: IntArray
    markers: list[MarkerData] = field(default_factory=list)
    connection_of: list[int] = field(default_factory=list)
    sign: list[float] = field(default_factory=list)
    force: list[int] = field(default_factory=list)
    moment: list[int] = field(default_factory=list)
    sizes: list[int] = field(default_factory=list)
    a_of: list[int] = field(default_factory=list)
    b_of: list[int] = field(default_factory=list)
    law: list[int] = field(default_factory=list)
    item: list[int] = field(default_factory=list)
    accelerated: list[int] = field(default_factory=list)  #: markers whose acceleration is an input of a law
    rates: list[int] = field(default_factory=list)  #: whether the rows depend on velocities
    rows: list[Row] = field(default_factory=list)
    owner: list[str] = field(default_factory=list)  #: of each row

    def add_marker(self, marker: MarkerData) -> int:
        """Add a marker that is no end of a connection, and return its number."""
        self.markers.append(marker)
        self.connection_of.append(-1)
        self.sign.append(0.0)
        self.force.append(-1)
        self.moment.append(NO_MOMENT)
        return len(self.markers) - 1

    def add(self, name: str, law: int, ends: Sequence[End], rows: Sequence[Row], *, has_rates: bool) -> tuple[int, int]:
        """Add a connection, and return the numbers of its first marker and of its first row."""
        first_marker, first_row = len(self.markers), len(self.rows)
        c = len(self.sizes)
        for end in ends:
            m = self.add_marker(end.marker)
            self.connection_of[m], self.sign[m], self.force[m], self.moment[m] = c, end.sign, end.force, end.moment
        self.sizes.append(len(rows))
        self.a_of.append(first_marker)
        self.b_of.append(first_marker + 1)
        self.item.append(self.law.count(law))
        self.law.append(law)
        self.rates.append(int(has_rates))
        self.rows.extend(rows)
        self.owner += [name] * len(rows)
        return first_marker, first_row


def add_joint(system: System, made: Connections, joint: Joint) -> None:
    """Add a joint with the forces along its coordinates."""
    a, b = joint_markers(system, joint, made.placed)
    r_a, A_a = marker_pose(a, made.placed, made.n_q)
    r_b, A_b = marker_pose(b, made.placed, made.n_q)
    forces = [f for f in system.forces if isinstance(f, JointForce) and f.joint == joint.name]
    rows = with_forces(joint, joint.rows(A_a, A_b, r_b - r_a), forces)
    ends = (
        End(a, 1.0, moment=MOMENT if joint.size >= MOMENT + 3 else NO_MOMENT),
        End(b, -1.0, moment=joint.moment_b),
    )
    rolls = any(kind_of(row.kind).holds == VELOCITY for row in rows)
    made.add(joint.name, JOINT, ends, rows, has_rates=bool(forces) or rolls)


def add_spring(system: System, made: Connections, spring: SpringDamper) -> float:
    """Add a spring-damper, and return its free length."""
    where = f"force {spring.name!r}"
    a = find_marker(system, f"{where}: marker_a", spring.marker_a)
    b = find_marker(system, f"{where}: marker_b", spring.marker_b)
    free_length = spring_length(where, spring, a, b, made.placed, made.n_q)
    rows = [Row(SPRING, axis) for axis in np.eye(3)]
    made.add(spring.name, SPRING_LAW, (End(a, 1.0), End(b, -1.0)), rows, has_rates=True)
    return free_length


def spring_length(
    where: str, spring: SpringDamper, a: MarkerData, b: MarkerData, placed: State, n_q: IntArray
) -> float:
    """Return the free length of a spring; `ModelError` if it has no direction as placed."""
    distance = float(np.linalg.norm(marker_pose(b, placed, n_q)[0] - marker_pose(a, placed, n_q)[0]))
    free_length = distance if spring.free_length is None else spring.free_length
    if distance == 0 and (free_length > 0 or spring.preload != 0 or spring.damping != 0 or spring.characteristic):
        raise ModelError(
            f"{where}: its markers coincide as placed, so that its tension has no direction; move one, or "
            "give free_length = 0 without damping and preload"
        )
    return free_length
