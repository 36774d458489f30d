"""Connections in the order in which they are compiled, with their ends, wrenches and rows."""

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
    """One end of a connection: its marker, and the index of the wrench that acts there."""

    marker: MarkerData
    sign: float  #: sign of the wrench: +1 at marker A, -1 at marker B
    force: int = FORCE  #: index of the force in the wrench of the connection, -1 for none
    moment: int = NO_MOMENT


@dataclass
class Connections:
    """Connections, with one list entry for each connection, marker or row."""

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
    #: numbers of the markers whose acceleration is an input of a law
    accelerated: list[int] = field(default_factory=list)
    rates: list[int] = field(default_factory=list)  #: for each connection, whether its rows depend on velocities
    rows: list[Row] = field(default_factory=list)
    owner: list[str] = field(default_factory=list)  #: name of the connection to which each row belongs

    def add_marker(self, marker: MarkerData) -> int:
        """Add a marker that is not an end of a connection, and return its number."""
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
    """Return the free length of a spring; `ModelError` if the two markers coincide, so that it has no direction."""
    distance = float(np.linalg.norm(marker_pose(b, placed, n_q)[0] - marker_pose(a, placed, n_q)[0]))
    free_length = distance if spring.free_length is None else spring.free_length
    if distance == 0 and (free_length > 0 or spring.preload != 0 or spring.damping != 0 or spring.characteristic):
        raise ModelError(
            f"{where}: its markers coincide as placed, so that its tension has no direction; move one, or "
            "give free_length = 0 without damping and preload"
        )
    return free_length
