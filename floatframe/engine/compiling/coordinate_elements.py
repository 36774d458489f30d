"""Couplers and user forces in the arrays of the kernels: coordinates between markers, and their coupling terms."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.units import Units
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.bodies import integers, offsets
from floatframe.engine.compiling.callbacks import Callback, callback_of
from floatframe.engine.compiling.connections import Connections, End
from floatframe.engine.compiling.forces import Functions
from floatframe.engine.compiling.markers import MarkerData, find_marker, joint_markers, least_size, marker_pose
from floatframe.engine.kernels import model
from floatframe.engine.kernels.model import COUPLER, USER_FORCE
from floatframe.engine.kernels.records import filled, of_items
from floatframe.errors import ModelError
from floatframe.model.bodies.coordinates import (
    AxialAngle,
    AxialDistance,
    Coordinate,
    JointCoordinateName,
    coordinate_of,
)
from floatframe.model.forces import UserForce
from floatframe.model.functions.expressions import Tape, compile_expression
from floatframe.model.joints.axis_frame import axis_in_b, turning_frame
from floatframe.model.joints.coordinate_coupler import CoordinateCoupler
from floatframe.model.joints.rows import (
    COUPLE,
    NO_MOMENT,
    PART,
    PUSH,
    RELEASED,
    SPAN,
    TWIST,
    RelativePlace,
    Row,
    RowCoordinate,
)
from floatframe.model.system import System

__all__ = [
    "LEAST_SIZE",
    "CoordinateElements",
    "PlacedCoordinate",
    "add_coordinate_elements",
    "find_coordinate",
    "placed_value",
]


LEAST_SIZE = 1e-3  #: size of a state whose typical size is unknown


@dataclass(frozen=True, eq=False)
class PlacedCoordinate:
    """A coordinate of a compiled system: its markers and directions."""

    a: MarkerData
    b: MarkerData
    coordinate: RowCoordinate

    @property
    def row(self) -> Row:
        """The row of the value of the coordinate."""
        own = self.coordinate
        return Row(own.kind, own.x, own.y, z=own.z)

    @property
    def has_arm(self) -> bool:
        """Whether a force along the coordinate also applies a moment to the body of marker A."""
        return self.coordinate.kind == PUSH and self.a.body >= 0


@dataclass
class CoordinateElements:
    """Couplers and user forces, with one list entry for each coordinate or connection."""

    names: tuple[str, ...] = ()
    coordinate0: list[int] = field(default_factory=lambda: [0])
    coordinates: list[dict[str, float]] = field(default_factory=list)
    items: list[dict[str, int]] = field(default_factory=list)
    state0: list[int] = field(default_factory=lambda: [0])
    states: list[dict[str, float]] = field(default_factory=list)
    tapes: list[Tape] = field(default_factory=list)
    callbacks: list[Callback] = field(default_factory=list)
    placed: list[PlacedCoordinate] = field(default_factory=list)
    #: for each coordinate, the length that its force declares, or None
    lengths: list[float | None] = field(default_factory=list)

    def give_lengths(self, radii: Array, length: float, units: Units) -> None:
        """Set the ranges of coordinates and rates over which laws change, from radii of gyration of bodies, (n_b,).

        The range of a distance is the length that its force declares, or else the size of the smaller body; the range
        of its rate is this length in a second, at most 1 m/s. Angles have the ranges 1 rad and 1 rad/s.
        """
        second = 1 / units.time
        for record, each, own in zip(self.coordinates, self.placed, self.lengths, strict=True):
            size = 1.0 if each.coordinate.is_angle else own or least_size((each.a, each.b), radii) or length
            most = 1.0 / second if each.coordinate.is_angle else 1 / (units.length * second)
            record["size"], record["speed"] = size, min(size / second, most)

    def records(self) -> dict[str, Any]:
        """Return these data as arrays of the model."""
        tapes = self.tapes
        return {
            "elements": of_items(model.Elements(), self.items, coordinate0=self.coordinate0, state0=self.state0),
            "coordinates": of_items(model.Coordinates(), self.coordinates),
            "states": of_items(model.States(), self.states),
            "tapes": filled(
                model.Tapes(),
                operation0=offsets(integers([len(tape.op) for tape in tapes])),
                op=[op for tape in tapes for op in tape.op],
                a=[a for tape in tapes for a in tape.a],
                b=[b for tape in tapes for b in tape.b],
                c=[c for tape in tapes for c in tape.c],
            ),
        }


def add_coordinate_elements(system: System, made: Connections, functions: Functions) -> CoordinateElements:
    """Add the couplers of a system, then its user forces."""
    forces = [force for force in system.forces if isinstance(force, UserForce)]
    elements = CoordinateElements((*(coupler.name for coupler in system.couplers), *(force.name for force in forces)))
    for coupler in system.couplers:
        add_coupler(system, made, elements, coupler)
    for force in forces:
        add_user_force(system, made, elements, functions, force)
    return elements


def add_coupler(system: System, made: Connections, elements: CoordinateElements, coupler: CoordinateCoupler) -> None:
    """Add a coupler: one row for each coordinate, then the row of its multiplier."""
    where = f"coupler {coupler.name!r}"
    coordinates = [find_coordinate(system, f"{where}: term {k + 1}", c, made) for k, (c, _) in enumerate(coupler.terms)]
    factors = [factor for _, factor in coupler.terms]
    as_placed = sum(f * placed_value(x, made) for f, x in zip(factors, coordinates, strict=True))
    scale = 1 / max(abs(factor) for factor in factors)
    along = np.array([scale, 0.0, 0.0])
    held = Row(COUPLE, along, c=as_placed, motion=coupler.constant)  # type: ignore[arg-type]
    if not coupler.acts:
        held = Row(RELEASED, along)
    add_coordinates(made, elements, coupler.name, COUPLER, coordinates, factors, [True] * len(coordinates), [held])


def add_user_force(
    system: System, made: Connections, elements: CoordinateElements, functions: Functions, force: UserForce
) -> None:
    """Add a user force: the rows of its coordinates, then those of its forces, then those of its states."""
    where = f"force {force.name!r}"
    names, acting = list(force.coordinates), list(force.forces)
    coordinates = [find_coordinate(system, f"{where}: coordinates: {k}", c, made) for k, c in force.coordinates.items()]
    rows = [Row(PART)] * (len(acting) + 3 * len(force.states))
    act = [name in acting for name in names]
    factors = [1.0] * len(names)
    first = add_coordinates(made, elements, force.name, USER_FORCE, coordinates, factors, act, rows, force.length)
    for record, name in zip(elements.coordinates[-len(coordinates) :], names, strict=True):
        record["core"] = first + acting.index(name) if name in acting else first
    starts = enumerate(force.states.values())
    elements.states += [{"row": first + len(acting) + 3 * k, "start": start, "size": LEAST_SIZE} for k, start in starts]
    elements.state0[-1] = len(elements.states)
    item = elements.items[-1]
    item["n_forces"], item["n_states"] = len(acting), len(force.states)
    if force.function is not None:
        elements.callbacks.append(callback_of(force, len(coordinates)))
        item["address"] = elements.callbacks[-1].address
        return
    assert isinstance(force.forces, Mapping)  # checked by the force
    numbers = {name: functions.index(function) for name, function in force.functions.items()}
    texts = [(f"forces: {name}", text) for name, text in force.forces.items()]
    texts += [(f"rates: {name}", force.rates[name]) for name in force.states]
    for place, text in texts:
        elements.tapes.append(
            compile_expression(
                f"{where}: {place}",
                text,
                force.inputs,
                parameters=force.parameters,
                functions=numbers,
                switches=force.switches,
            )
        )


def add_coordinates(
    made: Connections,
    elements: CoordinateElements,
    name: str,
    law: int,
    coordinates: list[PlacedCoordinate],
    factors: list[float],
    has_force: list[bool],
    core: list[Row],
    length: float | None = None,
) -> int:
    """Add a connection with rows of its coordinates, then its core rows; return the number of the first core row."""
    rows: list[Row] = []
    ends: list[End] = []
    starts: list[tuple[int, int, int]] = []  # for each coordinate in the connection: value, force, arm
    for placed, acts in zip(coordinates, has_force, strict=True):
        value = len(rows)
        rows += [placed.row, Row(PART)]
        force = arm = NO_MOMENT
        if acts:
            force = len(rows)
            rows += [Row(PART)] * 3
            if placed.has_arm:
                arm = len(rows)
                rows += [Row(PART)] * 3
        starts.append((value, force, arm))
        if placed.coordinate.is_angle:
            ends += [End(placed.a, 1.0, NO_MOMENT, force), End(placed.b, -1.0, NO_MOMENT, force)]
        else:
            ends += [End(placed.a, 1.0, force, arm), End(placed.b, -1.0, force)]
    marker, w0 = made.add(name, law, ends, [*rows, *core], has_rates=True)
    made.item[-1] = len(elements.items)  # couplers and user forces are in one table
    elements.placed += coordinates
    elements.lengths += [length] * len(coordinates)
    for k, (value, force, arm) in enumerate(starts):
        elements.coordinates.append(
            {
                "a": marker + 2 * k,
                "b": marker + 2 * k + 1,
                "row": w0 + value,
                "force": w0 + force if force >= 0 else -1,
                "arm": w0 + arm if arm >= 0 else -1,
                "factor": factors[k],
                "core": w0 + len(rows),
            }
        )
    elements.coordinate0.append(len(elements.coordinates))
    elements.state0.append(len(elements.states))
    elements.items.append(
        {"core": w0 + len(rows), "n_forces": 0, "n_states": 0, "address": 0, "tape0": len(elements.tapes)}
    )
    return w0 + len(rows)


def find_coordinate(system: System, where: str, wanted: Coordinate | str, made: Connections) -> PlacedCoordinate:
    """Return a coordinate in the assembled position; `ModelError` suggests the closest name if it does not exist."""
    coordinate = coordinate_of(where, wanted)
    if isinstance(coordinate, JointCoordinateName):
        return coordinate_of_joint(system, where, coordinate, made)
    a = find_marker(system, f"{where}: marker_a", coordinate.marker_a)
    b = find_marker(system, f"{where}: marker_b", coordinate.marker_b)
    if a.body == b.body:
        raise ModelError(f"{where}: expected markers on two bodies, got both on one body")
    (r_a, A_a), (r_b, A_b) = (marker_pose(m, made.placed, made.n_q) for m in (a, b))
    if isinstance(coordinate, AxialDistance):
        return PlacedCoordinate(a, b, RowCoordinate("", PUSH, coordinate.axis))
    if isinstance(coordinate, AxialAngle):
        axis_b = axis_in_b(coordinate.axis, None, A_a, A_b)
        x, z, y = turning_frame(coordinate.axis, axis_b, A_a, A_b)
        return PlacedCoordinate(a, b, RowCoordinate("", TWIST, x, y, z))
    if np.linalg.norm(r_b - r_a) == 0:
        raise ModelError(f"{where}: its markers coincide as placed, so that their line has no direction; move one")
    return PlacedCoordinate(a, b, RowCoordinate("", SPAN))


def coordinate_of_joint(system: System, where: str, wanted: JointCoordinateName, made: Connections) -> PlacedCoordinate:
    """Return a coordinate of a joint in the assembled position."""
    names = [joint.name for joint in system.joints]
    if wanted.joint not in names:
        raise ModelError(f"{where}: no joint {quoted(wanted.joint)}{nearest(wanted.joint, names)}")
    joint = system.joints[names.index(wanted.joint)]
    if wanted.coordinate not in joint.coordinates:
        raise ModelError(
            f"{where}: joint {joint.name!r} has no coordinate {wanted.coordinate!r}"
            f"{nearest(wanted.coordinate, list(joint.coordinates))}"
        )
    a, b = joint_markers(system, joint, made.placed)
    (r_a, A_a), (r_b, A_b) = (marker_pose(m, made.placed, made.n_q) for m in (a, b))
    for row in joint.rows(A_a, A_b, r_b - r_a):
        if row.coordinate is not None and row.coordinate.name == wanted.coordinate:
            return PlacedCoordinate(a, b, row.coordinate)
    raise ModelError(f"{where}: coordinate {wanted.coordinate!r} of joint {joint.name!r} follows a deformed line and "
                     "cannot be coupled or take a user force; take an axial distance between two markers")  # fmt: skip


def placed_value(placed: PlacedCoordinate, made: Connections) -> float:
    """Return the value of a coordinate in the assembled position; angles between -pi and pi."""
    (r_a, A_a), (r_b, A_b) = (marker_pose(m, made.placed, made.n_q) for m in (placed.a, placed.b))
    return float(placed.coordinate.value(RelativePlace(A_a, A_b, r_b - r_a)))
