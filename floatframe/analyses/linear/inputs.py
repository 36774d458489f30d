"""Inputs of a linearised system: forces along channels, motions of drives and bases, user force parameters.

With the value s of the input, each type enters the equations of `system_matrices` in its own way:

    force along y = J xi          F = Jᵀ, along a free joint coordinate E = 1 in the row of its joint
    drive, g(x, f(t)) = 0         E = ∂g/∂f, the rate of the row for f = t at rest
    base, a rigid motion s of markers on the ground: E, E' = derivatives of the rows by their positions and velocities
    parameter p of Q = f(x, v, p)   E = -∂f/∂p
    amplitude of a force or motor   F, E from a unit change (`force_inputs`)
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array, GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.linear.force_inputs import ForceInput, force_column, forces_of_amplitude
from floatframe.analyses.system_matrices import Inputs
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import linearized, set_iterate
from floatframe.engine.kernels.work import new_work
from floatframe.errors import ModelError
from floatframe.model.bodies.coordinates import JointCoordinateName
from floatframe.model.bodies.markers import body_name
from floatframe.model.checked_values import array_of_shape, unit_vector
from floatframe.model.forces import UserForce
from floatframe.model.functions.time_functions import TimeFunction, constant, polynomial_of_time
from floatframe.model.joints.rows import kind_of
from floatframe.model.state import State
from floatframe.model.system import System
from floatframe.results.sensors.channels import QUANTITIES, VALUE, Channel, rate_unit, require_rate
from floatframe.results.sensors.joint_coordinate import JointCoordinate
from floatframe.results.small_motions.small_motions import BaseColumn, InputForce, SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = [
    "BaseMotion",
    "DriveMotion",
    "ParameterInput",
    "base_columns",
    "input_columns",
    "input_rate",
    "interface_forces",
]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class DriveMotion:
    """The prescribed motion of a joint coordinate as an input: its change from the steady value, or its rates.

    Parameters
    ----------
    name
        Name of the input.
    joint
        Name of the joint that is driven.
    coordinate
        Name of the driven coordinate of the joint.
    rate
        Quantity of the input: 0 the value, 1 its rate, 2 its second rate.
    """

    name: str
    joint: str
    coordinate: str
    rate: int = 2

    def __post_init__(self) -> None:
        require_rate(f"input {self.name!r}", self.rate)

    def force_units(self, units: Units) -> str:
        """Return the unit of the input."""
        return rate_unit(units, self.coordinate.startswith("angle"), self.rate)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class BaseMotion:
    """A motion of the base: of the ground side of joints, springs and bushings.

    For several bases, define an input with its own `joints` for each. Coordinates of these joints in couplers and user
    forces move too. All other parts of the ground stay at rest, as do gravity and the reference of sensors.

    Parameters
    ----------
    name
        Name of the input.
    direction
        Ground axes, (3,).
    quantity
        "translation", or "rotation" about the direction.
    about
        Point on the axis of a rotation, (3,) [m].
    joints
        Moving joints, springs, bushings, couplers, user forces; None: all.
    rate
        Quantity of the input: 0 the displacement, 1 the velocity, 2 the acceleration.
    """

    name: str
    direction: GivenArray = given((1.0, 0.0, 0.0))
    quantity: str = "translation"
    about: GivenArray = given(np.zeros(3))
    joints: Sequence[str] | None = None
    rate: int = 2

    def __post_init__(self) -> None:
        where = f"input {self.name!r}"
        object.__setattr__(self, "direction", unit_vector(f"{where}: direction", self.direction))
        object.__setattr__(self, "about", array_of_shape(f"{where}: about", self.about, (3,)))
        if self.joints is not None:
            object.__setattr__(self, "joints", tuple(self.joints))
        if self.quantity not in QUANTITIES:
            raise ModelError(f"{where}: quantity: expected one of {', '.join(QUANTITIES)}, got {self.quantity!r}")
        require_rate(where, self.rate)

    def force_units(self, units: Units) -> str:
        """Return the unit of the input."""
        return rate_unit(units, self.quantity == "rotation", self.rate)


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ParameterInput:
    """A parameter of a user force's expressions as an input: its change from its present value.

    Parameters
    ----------
    name
        Name of the input.
    force
        Name of the user force.
    parameter
        Name of the parameter.
    """

    name: str
    force: str
    parameter: str

    def force_units(self, units: Units) -> str:
        """Return the unit of the input, which is unknown for a parameter."""
        return "1"


def input_rate(channel: Any) -> int:
    """Return which derivative of a motion is the input; 0 for forces."""
    return channel.rate if isinstance(channel, DriveMotion | BaseMotion) else 0


def base_columns(system: System, inputs: Sequence[Any]) -> tuple[BaseColumn, ...]:
    """Return, for each input, the motion of the ground at some connections, or none."""
    return tuple(base_column(system, each) if isinstance(each, BaseMotion) else BaseColumn() for each in inputs)


def interface_forces(system: System, now: Trajectory, inputs: Sequence[Any]) -> tuple[tuple[InputForce, ...], ...]:
    """Return the loads of each input on interfaces of flexible bodies in a steady motion."""
    found = []
    for channel in inputs:
        if isinstance(channel, ForceInput):
            found.append(forces_of_amplitude(system, now, channel))
            continue
        forces = []
        for sign, marker in channel.markers if isinstance(channel, Channel) else ():
            if marker.interface is not None:
                wrench = np.zeros(6)
                first = 0 if channel.quantity == "translation" else 3
                wrench[first : first + 3] = sign * channel.direction
                forces.append(InputForce(body_name(marker.body), marker.interface, wrench))
        found.append(tuple(forces))
    return tuple(found)


def base_column(system: System, base: BaseMotion) -> BaseColumn:
    """Return the motion of a base; `ModelError` if it names an object that is not on the ground, or none."""
    compiled = compiled_system(system)
    model, names = compiled.model, compiled.connection_names
    on_ground = {
        names[c] for c, body in zip(model.markers.connection, model.markers.body, strict=True) if c >= 0 and body < 0
    }
    for name in base.joints or ():
        if name not in on_ground:
            what = "is not attached to the ground" if name in names else "does not exist"
            hint = nearest(name, sorted(on_ground))
            raise ModelError(f"input {base.name!r}: joint or force {quoted(name)} {what}{hint}")
    moved = frozenset(on_ground if base.joints is None else base.joints)
    if not moved:
        raise ModelError(f"input {base.name!r}: no joint or force is attached to the ground; a base moves nothing")
    key = "translation" if base.quantity == "translation" else "rotation"
    return BaseColumn(moved, **{key: base.direction}, about=base.about)


def input_columns(small: SmallMotions, channels: Sequence[Any]) -> Inputs:
    """Return the columns of inputs in the equations.

    Raises
    ------
    ModelError
        If an input refers to an unknown object, or a base moves under a rotating system.
    """
    columns = [column_of(small, k, channel) for k, channel in enumerate(channels)]
    empty = [np.zeros((small.n_u, 0)), np.zeros((small.n_w, 0)), np.zeros((small.n_w, 0))]
    return Inputs(*(np.column_stack([none, *column]) for none, column in
                    zip(empty, zip(*columns, strict=True), strict=True))) if columns else Inputs(*empty)  # fmt: skip


def column_of(small: SmallMotions, k: int, channel: Any) -> tuple[Array, Array, Array]:
    """Return the column of input k: body forces, (n_u,), and row columns for input and rate, (n_w,)."""
    F, E, E_rate = np.zeros(small.n_u), np.zeros(small.n_w), np.zeros(small.n_w)
    if isinstance(channel, DriveMotion):
        E = drive_rows(small, channel)
    elif isinstance(channel, BaseMotion):
        E, E_rate = base_rows(small, small.bases[k], channel)
    elif isinstance(channel, ParameterInput):
        E = parameter_rows(small, channel)
    elif isinstance(channel, ForceInput):
        F, E = force_column(small, channel)
    elif isinstance(channel, JointCoordinate) and (row := free_row(small, channel)) is not None:
        E[row] = 1.0
    elif isinstance(channel, JointCoordinate):
        F = small.joint_coordinate(channel.joint, channel.coordinate, f"coordinate {channel.name!r}")
    else:
        F = replace(channel, rate=0).linear(small).columns[VALUE].x[0, : small.n_u]
    return F, E, E_rate


def free_row(small: SmallMotions, channel: JointCoordinate) -> int | None:
    """Return the force row of a free coordinate, force + Q = 0; None if there is none, as in screws.

    A force in this row is an internal force of the joint, like that of a `JointForce`.
    """
    rows = small.compiled.model.rows.kind
    for k, own in enumerate(zip(small.compiled.owners, small.compiled.coordinates, strict=True)):
        kind = kind_of(rows[k])
        if own == (channel.joint, channel.coordinate) and (kind.is_free or kind.is_loaded):
            return k
    return None


def drive_rows(small: SmallMotions, drive: DriveMotion) -> Array:
    """Return row rates while one drive moves at unit rate and everything else is at rest, (n_w,)."""
    from floatframe.engine.kernels.entry import evaluate_and_linearize, rates_of_constraints

    system = small.system
    driven = [f"{j.name}.{c}" for j in system.joints for c in getattr(j, "motions", {})]
    wanted = f"{drive.joint}.{drive.coordinate}"
    if wanted not in driven:
        raise ModelError(
            f"input {drive.name!r}: no driven coordinate {quoted(wanted)}{nearest(wanted, driven)}; prescribe it in "
            "[joints.NAME.motions.COORDINATE], or take the force along it as the input"
        )

    def held(joint: Any) -> Any:
        motions = {c: constant(f(0.0)) for c, f in getattr(joint, "motions", {}).items()}
        if joint.name == drive.joint:
            motions[drive.coordinate] = polynomial_of_time([joint.motions[drive.coordinate](0.0), 1.0])
        return replace(joint, motions=motions) if motions else joint

    couplers = [
        replace(each, constant=constant(each.constant(0.0))) if isinstance(each.constant, TimeFunction) else each
        for each in system.couplers
    ]
    moved = replace(system, joints=[held(joint) for joint in system.joints], couplers=couplers)
    model = compiled_system(moved).model
    work = new_work(model)
    still = State(small.state.r, small.state.p, small.state.q, np.zeros_like(small.state.u))
    set_iterate(work, still, w=small.work.state.w)
    evaluate_and_linearize(model, work, 1.0, 0.0, 1.0)
    return rates_of_constraints(model, work)[0]


def base_rows(small: SmallMotions, base: BaseColumn, channel: BaseMotion) -> tuple[Array, Array]:
    """Return E and E' of a base from the rows' derivatives P by its markers (joints/rows/kinds.py)."""
    from floatframe.engine.kernels.entry import evaluate_and_linearize

    if small.is_turning:
        raise ModelError(
            f"input {channel.name!r}: base motions are supported only for a system at rest; about a steady rotation "
            "use drives and forces"
        )
    model, work = small.compiled.model, small.work
    head = np.array(model.laws.head)
    head[:, 6] = -1  # elements also return the derivatives by their markers on the ground
    evaluate_and_linearize(model._replace(laws=model.laws._replace(head=head)), work, 0.0, 0.0, 1.0)
    E, E_rate = np.zeros(small.n_w), np.zeros(small.n_w)
    for m in moved_markers(small, base):
        c = int(model.markers.connection[m])
        if model.markers.accelerated[m] >= 0:
            name = small.compiled.connection_names[c]
            raise ModelError(
                f"input {channel.name!r}: element {name!r} uses the acceleration of a marker that the base moves; "
                "put the marker on a body that is fixed to it"
            )
        rows, P = small.wrench(small.compiled.connection_names[c]), work.connections.P[m]
        size, motion = rows.stop - rows.start, base.at(work.markers.r[m])
        E[rows] += P[:size, :6] @ motion
        E_rate[rows] += P[:size, 6:12] @ motion
    return E, E_rate


def moved_markers(small: SmallMotions, base: BaseColumn) -> list[int]:
    """Return the ground markers that a base moves; coordinates of joints in couplers move with their joints."""
    model, names = small.compiled.model, small.compiled.connection_names
    owners = [names[c] if c >= 0 else "" for c in model.markers.connection]
    user_forces = [force for force in small.system.forces if isinstance(force, UserForce)]
    coordinates = [c for coupler in small.system.couplers for c, _ in coupler.terms]
    coordinates += [c for force in user_forces for c in force.coordinates.values()]
    for own, a, b in zip(coordinates, model.coordinates.a, model.coordinates.b, strict=True):
        if isinstance(own, JointCoordinateName):
            owners[a] = owners[b] = own.joint
    return [m for m, body in enumerate(model.markers.body) if body < 0 and owners[m] in base.moved]


def parameter_rows(small: SmallMotions, channel: ParameterInput) -> Array:
    """Return -∂f/∂p in the rows of a user force, (n_w,), by differentiation with a state in place of p."""
    forces = [force for force in small.system.forces if isinstance(force, UserForce)]
    names = [force.name for force in forces]
    if channel.force not in names:
        hint = nearest(channel.force, names)
        raise ModelError(f"input {channel.name!r}: no user force {quoted(channel.force)}{hint}")
    force = forces[names.index(channel.force)]
    p = channel.parameter
    if p not in force.parameters:
        raise ModelError(
            f"input {channel.name!r}: user force {force.name!r} has no parameter {quoted(p)}"
            f"{nearest(p, list(force.parameters))}"
        )
    freed = replace(
        force,
        parameters={key: value for key, value in force.parameters.items() if key != p},
        states={p: force.parameters[p]},
        rates={p: "0"},
    )
    system = replace(
        small.system, forces=[freed if each is force else each for each in small.system.forces], inputs=(), outputs=()
    )
    compiled, own = compiled_system(system), small.wrench(force.name)
    work, w = new_work(compiled.model), np.insert(small.work.state.w, own.stop, (force.parameters[p], 0.0, 0.0))
    set_iterate(work, small.state, w=w)
    V = linearized(compiled.model, work, 0.0, 0.0, 1.0).V.toarray()
    E = np.zeros(small.n_w)
    E[own] = V[own, own.stop]
    return E
