"""Sensors of loads on bodies: total force on an interface, springs, recovery rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from cms.body.recovery_table import RecoveryTable
from cms.errors import BodyError
from fe_models.foundation.arrays import Array, IntArray
from fe_models.foundation.presentation import presented
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.interface_loads import Load, amplitudes, in_body, interface_number, loads_on_interfaces
from floatframe.engine.compiling.markers import MarkerData, find_marker
from floatframe.errors import ModelError, ResultsError
from floatframe.model.bodies.flexible_body import FlexibleBody
from floatframe.model.elements.switched_off import times_off
from floatframe.model.forces import BodyLoad, Gravity, PointForce, SpringDamper
from floatframe.model.functions.time_functions import TimeFunction
from floatframe.model.rotations import dot, rotation_matrix, tilde
from floatframe.model.system import System
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.recovery import require_same_modes
from floatframe.results.sensors.linear_columns import load_linear
from floatframe.results.sensors.measurement import Measurement, load_columns, unit_words
from floatframe.results.sensors.stresses import flexible_body
from floatframe.results.small_motions.rows import LinearColumns, Rows, joined
from floatframe.results.small_motions.small_motions import SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = ["InterfaceForceSensor", "RecoverySensor", "SpringSensor", "case_amplitudes", "interface_loads"]


def interface_loads(system: System, trajectory: Trajectory, body: FlexibleBody) -> Array:
    """Return force and moment on each interface at its reference point, axes of the body frame, (n_interfaces, n_t, 6).

    Point forces are taken as recorded in the motion, including the effect of events and of external programs. Motions
    of older files have no record; for these, the forces of the system are evaluated, and are zero while events have
    switched them off.
    """
    i = list(trajectory.body_names).index(body.name)
    wrenches, loads = loads_on_interfaces(system, i)
    R, w = rotation_matrix(trajectory.body(body.name).p), trajectory.source.read("w")
    total = np.zeros((len(body.reduced.interfaces), len(trajectory.t), 6))
    for wrench in wrenches:
        for part, first in ((0, wrench.force), (3, wrench.moment)):
            if first >= 0:
                total[wrench.interface, :, part : part + 3] += wrench.sign * in_body(R, w[:, first : first + 3])
    if trajectory.head.loads is None:
        for load in loads:
            acts = ~times_off(events_of(system), happened(trajectory), trajectory.t, load.force.name)
            total[load.interface] += acts[:, None] * amplitudes(in_file(body, load), trajectory.t, R)
        return total
    on_record = require_loads(system, trajectory, PointForce, trajectory.head.loads)
    acted = trajectory.source.read("load")
    places = [(load.interface, load.number) for load in loads]
    places += [(led_interface(system, body, i, name), k) for k, name in on_record]
    for interface, k in places:
        if interface >= 0:
            for first in (0, 3):
                total[interface, :, first : first + 3] += in_body(R, acted[:, k, first : first + 3])
    return total


def require_loads(
    system: System, trajectory: Trajectory, kind: type[PointForce | BodyLoad], names: tuple[str, ...]
) -> list[tuple[int, str]]:
    """Return number and name of the recorded forces that an external program prescribes; they come after the others.

    Raises
    ------
    ResultsError
        If the other recorded forces are not the forces of the system.
    """
    own = tuple(force.name for force in system.forces if isinstance(force, kind))
    if names[: len(own)] != own:
        raise ResultsError(
            f"the motion of {trajectory.head.system!r} does not belong to the system {system.name!r}: expected the "
            f"forces {', '.join(own)}, got {', '.join(names) or 'none'}; give the system of the run"
        )
    return list(enumerate(names))[len(own) :]


def led_interface(system: System, body: FlexibleBody, i: int, name: str) -> int:
    """Return the interface of body i on which a system input acts as a recorded force; -1 if there is none."""
    for channel in system.inputs:
        ends = {f"inputs.{channel.name}": "marker", f"inputs.{channel.name}.against": "relative_to"}
        marker = getattr(channel, ends[name], None) if name in ends else None
        if marker is not None:
            found = find_marker(system, f"input {channel.name!r}", marker)
            if found.body != i or found.shape.psi is None:
                return -1
            return interface_number(body.moved, found.shape.psi, found.shape.position)
    return -1


def events_of(system: System) -> tuple[Any, ...]:
    """Return the events of a system and of its elements, which the system stores under a general type."""
    return (*system.events, *(event for each in system.elements for event in each.events()))


def happened(trajectory: Trajectory) -> Sequence[Mapping[str, Any]]:
    """Return the events that occurred in a motion."""
    return trajectory.head.summary.get("events", ())


def in_file(body: FlexibleBody, load: Load) -> Load:
    """Return a load with its marker axes in the frame of the body's file."""
    axes = body.reduced.frame.axes.T @ body.moved.frame.axes
    return Load(load.interface, load.force, axes @ load.triad)


def interface_load_rows(small: SmallMotions, body: FlexibleBody) -> list[Rows]:
    """Return the change of force and moment on each interface as six rows, ground axes."""
    wrenches, loads = loads_on_interfaces(small.system, small.compiled.body_names.index(body.name))
    zero = small.by_motion(np.zeros((6, small.n_x)))
    found = [zero for _ in body.reduced.interfaces]
    for wrench in wrenches:
        parts = [
            small.by_wrench(slice(first, first + 3), wrench.sign) if first >= 0 else zero[:3]
            for first in (wrench.force, wrench.moment)
        ]
        found[wrench.interface] = found[wrench.interface] + joined(parts)
    for k, forces in enumerate(small.forces):
        for push in forces:
            if push.body == body.name and push.interface in interface_names(body):
                x = np.zeros((6, small.n_x))
                x[:, small.n_u + k] = push.wrench
                own = interface_names(body).index(push.interface)
                found[own] = found[own] + small.by_motion(x)
    for load in loads:
        if load.force.is_follower:  # a follower force rotates with its marker
            six = small.now.source.read("load")[0, load.number]
            place = small.place(find_marker(small.system, f"force {load.force.name!r}", load.force.marker))
            turned = [place.rotation.mapped(-tilde(part)) for part in (six[:3], six[3:])]
            found[load.interface] = found[load.interface] + joined(turned)
    return found


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class InterfaceForceSensor:
    """Total force and moment (force x, ..., moment size) on a flexible body at an interface.

    They come from joints, springs, point forces, and inputs of a linearised system that act there. The moment is about
    the point of the interface.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    body
        Name of the flexible body.
    interface
        Name of the interface of the body.
    axes
        Axes of the components, "ground", or "body" for those of the body frame.
    """

    name: str
    body: str
    interface: str
    axes: Literal["ground", "body"] = "ground"

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return force and moment over time, as components and magnitudes."""
        body, k = self.place(system)
        require_same_modes(trajectory, body.name, body.reduced)
        vectors = np.split(interface_loads(system, trajectory, body)[k], 2, axis=1)
        if self.axes == "ground":
            R = rotation_matrix(trajectory.body(body.name).p)
            vectors = [np.einsum("tab,tb->ta", R, part) for part in vectors]
        return Measurement(self.name, trajectory.t, *load_columns(system.units, *vectors))

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return force and moment as linear functions of wrenches; in body axes also of motions.

        Forces of inputs act at interfaces too, and no recorded motion has them, so that differences would miss them.
        """
        body, k = self.place(small.system)
        rows, frame = interface_load_rows(small, body)[k], small.frame_place(body.name)
        now = np.split(interface_loads(small.system, small.now, body)[k, 0], 2)
        values = [frame.axes @ part for part in now]
        return load_linear(small, (rows[:3], rows[3:]), values, frame if self.axes == "body" else None)

    def place(self, system: System) -> tuple[FlexibleBody, int]:
        """Return the body and the index of the interface; `ModelError` with the closest name if it does not exist."""
        body = flexible_body(system, self.name, self.body)
        names = [interface.name for interface in body.reduced.interfaces]
        if self.interface not in names:
            raise ModelError(
                f"sensor {self.name!r}: flexible body {body.name!r} has no interface {quoted(self.interface)}"
                f"{nearest(self.interface, names)}"
            )
        return body, names.index(self.interface)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class SpringSensor:
    """A spring-damper: length, rate of length, and tension (negative in compression).

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    of
        Name of the spring-damper.
    """

    name: str
    of: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return length, rate and tension over time."""
        a, b = (end_motion(system, trajectory, end, self.of) for end in self.ends(system))
        d = b.position - a.position
        length = np.linalg.norm(d, axis=1)
        e = d / np.where(length > 0, length, 1.0)[:, None]
        force = trajectory.reaction(self.of).force
        columns = {"length": length, "rate": dot(e, b.velocity - a.velocity), "tension": dot(e, force)}
        return Measurement(self.name, trajectory.t, columns, self.units(system))

    def ends(self, system: System) -> list[MarkerData]:
        """Return both markers; `ModelError` suggests the closest name if the spring does not exist."""
        springs = {force.name: force for force in system.forces if isinstance(force, SpringDamper)}
        if self.of not in springs:
            hint = nearest(self.of, list(springs))
            raise ModelError(f"sensor {self.name!r}: no spring-damper {quoted(self.of)}{hint}")
        spring = springs[self.of]
        return [find_marker(system, f"force {self.of!r}", end) for end in (spring.marker_a, spring.marker_b)]

    def units(self, system: System) -> dict[str, str]:
        """Return the units of the columns."""
        return {"length": unit_words(system.units, "length"), "rate": unit_words(system.units, "speed"),
                "tension": unit_words(system.units, "force")}  # fmt: skip


@presented
@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class RecoverySensor:
    """Rows of a flexible body's recovery table: motions, stresses and forces, including residual static parts.

    y = D_0 z + D_1 z' + D_2 z'' + L p, see `cms.body.recovery_table`. z' and z'' are velocities and
    accelerations of the body frame in its axes and the rates of q. p contains gravity, spin, the loads on interfaces
    and load cases. Positions are relative to the moving body frame, so that the first entries of z are zero.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    body
        Name of the flexible body.
    table
        Name of the recovery table in the modal file.
    rows
        Labels of rows or their beginnings; none: all rows.
    """

    name: str
    body: str
    table: str
    rows: Sequence[str] = ()

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the rows over time by their labels."""
        body, table, rows = self.found(system)
        require_same_modes(trajectory, body.name, body.reduced)
        motion = trajectory.body(body.name)
        R = rotation_matrix(motion.p)
        z = np.concatenate([np.zeros((len(motion.t), 6)), motion.q], axis=1)
        rate = np.concatenate([in_body(R, motion.v), motion.omega_B, motion.q_dot], axis=1)
        second = np.concatenate([in_body(R, motion.v_dot), motion.omega_B_dot, motion.q_ddot], axis=1)
        values = table.values(z, rate, second, self.loads(system, trajectory, body, table))[:, rows]
        columns = {table.labels[row]: values[:, k] for k, row in enumerate(rows)}
        return Measurement(self.name, trajectory.t, columns, {table.labels[row]: table.units[row] for row in rows})

    def places_and_rates(self, small: SmallMotions, z: Rows) -> tuple[Rows, Rows]:
        """Return z and z' in the rows: positions relative to the frame, velocities relative to the state of rest."""
        return small.by_motion(np.concatenate([np.zeros((6, small.n_x)), z.x[6:]])), z.rate

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return the rows as functions of small motions and wrenches about a state at rest.

        The loads on interfaces contain forces of inputs, which no recorded motion has.
        """
        body, table, rows = self.found(small.system)
        units = {table.labels[row]: table.units[row] for row in rows}
        if small.is_turning:
            why = "recovery rows about a steady rotation: linearise the system at rest"
            return LinearColumns({}, units, dict.fromkeys(units, why))
        (z, _), frame = small.of_file(body.name), small.frame_place(body.name)
        places, rates = self.places_and_rates(small, z)
        y = places.mapped(table.dynamic[0][rows]) + rates.mapped(table.dynamic[1][rows])
        y = y + z.rate.rate.mapped(table.dynamic[2][rows])
        still = small.by_motion(np.zeros((3, small.n_x)))
        on_interfaces, now = interface_load_rows(small, body), interface_loads(small.system, small.now, body)[:, 0]
        for column, load in enumerate(table.loads):
            factor = table.static[rows, column][:, None]
            name, _, component = load.rpartition(" ")
            if name == "gravity":
                y = y + frame.in_axes(still, gravity_of(small.system))[axis_of(component)].mapped(factor)
            elif component in SIX and name in interface_names(body):
                k, j = interface_names(body).index(name), SIX.index(component)
                first = 3 * (j // 3)
                part = on_interfaces[k][first : first + 3]
                y = y + frame.in_axes(part, frame.axes @ now[k, first : first + 3])[j % 3].mapped(factor)
            elif load.startswith("load case "):
                x = np.zeros((1, small.n_x))
                for k, forces in enumerate(small.forces):
                    x[0, small.n_u + k] = sum(
                        push.body == body.name and load == f"load case {push.load_case}" for push in forces
                    )
                y = y + small.by_motion(x).mapped(factor)
        return LinearColumns({table.labels[row]: y[k] for k, row in enumerate(rows)}, units, {})

    def found(self, system: System) -> tuple[FlexibleBody, RecoveryTable, IntArray]:
        """Return the body, its table and the selected rows; `ModelError` with the closest name if one is missing."""
        body = flexible_body(system, self.name, self.body)
        tables = body.reduced.recovery
        if self.table not in tables:
            raise ModelError(
                f"sensor {self.name!r}: body {body.name!r} has no recovery table {quoted(self.table)}"
                f"{nearest(self.table, list(tables))}"
            )
        table = tables[self.table]
        if not self.rows:
            return body, table, np.arange(table.n_rows)
        try:
            return body, table, np.unique(np.concatenate([table.rows(wanted) for wanted in self.rows]))
        except BodyError as error:
            raise ModelError(f"sensor {self.name!r}: {error}") from error

    def loads(self, system: System, trajectory: Trajectory, body: FlexibleBody, table: RecoveryTable) -> Array:
        """Return load amplitudes over time, (n_t, n_loads); `ModelError` if the run does not contain a load."""
        motion = trajectory.body(body.name)
        R, omega = rotation_matrix(motion.p), motion.omega_B
        on_interfaces = interface_loads(system, trajectory, body)
        p = np.zeros((len(motion.t), len(table.loads)))
        for column, load in enumerate(table.loads):
            name, _, component = load.rpartition(" ")
            if name == "gravity":
                p[:, column] = in_body(R, np.broadcast_to(gravity_of(system), (len(p), 3)))[:, axis_of(component)]
            elif name == "spin":
                a, b = ("xyz".index(letter) for letter in component)
                p[:, column] = (1 if a == b else 2) * omega[:, a] * omega[:, b]
            elif component in SIX and name in interface_names(body):
                p[:, column] = on_interfaces[interface_names(body).index(name), :, SIX.index(component)]
            elif load.startswith("load case "):
                names = [f"load case {case.name}" for case in body.reduced.load_cases]
                if load in names:
                    p[:, column] = case_amplitudes(system, trajectory, body)[:, names.index(load)]
        return p


def case_amplitudes(system: System, trajectory: Trajectory, body: FlexibleBody) -> Array:
    """Return the amplitudes of the load cases of a body over time, (n_t, n_cases)."""
    names = [case.name for case in body.reduced.load_cases]
    p = np.zeros((len(trajectory.t), len(names)))
    cases = [force for force in system.forces if isinstance(force, BodyLoad)]
    if cases:
        for force, acted in zip(cases, load_cases(system, trajectory).T, strict=True):
            if named(force.body) == body.name and force.load_case in names:
                p[:, names.index(force.load_case)] += acted
    return p


def load_cases(system: System, trajectory: Trajectory) -> Array:
    """Return factors of a system's load cases, (n_t, n_cases), recorded like forces (see `interface_loads`)."""
    if trajectory.head.load_cases is not None:
        require_loads(system, trajectory, BodyLoad, trajectory.head.load_cases)
        return trajectory.source.read("load_case")
    factors = []
    for force in system.forces:
        if isinstance(force, BodyLoad):
            assert isinstance(force.amplitude, TimeFunction)  # ensured by the load case, which converts numbers
            acts = ~times_off(events_of(system), happened(trajectory), trajectory.t, force.name)
            factors.append(acts * np.array([force.amplitude(t) for t in trajectory.t]))
    return np.array(factors).reshape(-1, len(trajectory.t)).T


SIX = ("fx", "fy", "fz", "mx", "my", "mz")


def named(body: object) -> str:
    """Return the name of a body given as a body or as its name."""
    return body if isinstance(body, str) else str(getattr(body, "name", ""))


def interface_names(body: FlexibleBody) -> list[str]:
    """Return the names of the interfaces of a body."""
    return [interface.name for interface in body.reduced.interfaces]


def axis_of(component: str) -> int:
    """Return the index of the axis x, y or z."""
    return "xyz".index(component)


def gravity_of(system: System) -> Array:
    """Return the gravity vector, in ground axes, (3,)."""
    fall = [force.acceleration for force in system.forces if isinstance(force, Gravity)]
    return np.sum([np.zeros(3), *fall], axis=0)
