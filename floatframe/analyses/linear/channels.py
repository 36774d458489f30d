"""Channels: named scalars as inputs (a force, a torque) and outputs (a motion, a stress) of a linearised system."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import cast

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.components import STRESS_COMPONENTS
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.analyses.joint_rates import coordinate_rows
from floatframe.analyses.marker_jacobian import marker_jacobian
from floatframe.bodies.marker_shape import node_shape
from floatframe.bodies.markers import Marker, body_name
from floatframe.checked_values import array_of_shape, unit_vector
from floatframe.compiling.markers import MarkerData, find_body, find_marker
from floatframe.compiling.system import CompiledSystem
from floatframe.errors import ModelError
from floatframe.kernels.work import Work
from floatframe.results.sensors.places import is_at_node, nearest_node
from floatframe.results.sensors.stresses import flexible_body, modes_at
from floatframe.rotations import euler_parameters
from floatframe.state import State
from floatframe.system import Named, System

__all__ = [
    "AnyChannel",
    "Channel",
    "CoordinateChannel",
    "StressChannel",
    "channel_rows",
    "channel_units",
    "channels_of",
]

QUANTITIES = ("translation", "rotation")
RATES = ("displacement", "velocity", "acceleration")


@frozen_copies
@dataclass(frozen=True, eq=False)
class Channel:
    """The motion of a marker along a direction: displacement [m], or rotation [rad] about it.

    On a flexible body the marker is an interface, or a position in mesh axes: the kept node nearest to it.

    As an input it is the force [N], or moment [N m], that does work on it. With `relative_to`, the motion against
    that marker, and the opposite force on it.
    """

    name: str
    marker: Marker
    direction: Array = field(default_factory=lambda: np.array([1.0, 0.0, 0.0]))  #: ground axes, (3,)
    quantity: str = "translation"  #: or "rotation"
    relative_to: Marker | None = None
    rate: int = 0  #: as an output: 0 displacement, 1 velocity, 2 acceleration, seen from the turning system

    def __post_init__(self) -> None:
        where = f"channel {self.name!r}"
        object.__setattr__(self, "direction", unit_vector(f"{where}: direction", self.direction))
        if self.quantity not in QUANTITIES:
            raise ModelError(f"{where}: quantity: expected one of {', '.join(QUANTITIES)}, got {self.quantity!r}")
        require_rate(where, self.rate)


@frozen_copies
@dataclass(frozen=True, eq=False)
class CoordinateChannel:
    """A joint coordinate; as an input the force or torque along it."""

    name: str
    joint: str
    coordinate: str
    rate: int = 0  #: as an output: 0 value, 1 its rate, 2 its second rate

    def __post_init__(self) -> None:
        require_rate(f"channel {self.name!r}", self.rate)


@frozen_copies
@dataclass(frozen=True, eq=False)
class StressChannel:
    """A stress component at a node of a flexible body, in axes of its frame; an output only."""

    name: str
    body: str
    component: str  #: xx, yy, zz, yz, xz or xy
    position: Array  #: mesh axes; the kept node nearest to it is taken, (3,) [m]

    def __post_init__(self) -> None:
        where = f"channel {self.name!r}"
        object.__setattr__(self, "position", array_of_shape(f"{where}: position", self.position, (3,)))
        if self.component not in STRESS_COMPONENTS:
            raise ModelError(
                f"{where}: component: expected one of {', '.join(STRESS_COMPONENTS)}, got {self.component!r}"
            )


AnyChannel = Channel | CoordinateChannel | StressChannel


def channels_of(carried: Iterable[Named]) -> tuple[AnyChannel, ...]:
    """Return the inputs or outputs that a system carries as channels: it knows their names only."""
    return cast(tuple[AnyChannel, ...], tuple(carried))


def require_rate(where: str, rate: int) -> None:
    """Raise `ModelError` unless a rate is 0, 1 or 2."""
    if rate not in (0, 1, 2):
        raise ModelError(f"{where}: rate: expected 0, 1 or 2 ({', '.join(RATES)}), got {rate!r}")


def channel_rows(system: System, compiled: CompiledSystem, work: Work, channels: tuple[AnyChannel, ...]) -> Array:
    """Return the derivative of the channels by the unknowns of small motions (body axes), (n_channels, n_u).

    Raises
    ------
    ModelError
        With the nearest name, if a channel is at a place or joint that does not exist.
    """
    rows = np.zeros((len(channels), int(compiled.model.bodies.u0[-1])))
    for row, channel in zip(rows, channels, strict=True):
        if isinstance(channel, Channel):
            for sign, marker in ((1.0, channel.marker), (-1.0, channel.relative_to)):
                if marker is not None:
                    row += sign * marker_row(system, compiled, work, channel, marker)
        elif isinstance(channel, CoordinateChannel):
            row += coordinate_row(system, compiled, work, channel)
        else:
            row += stress_row(system, compiled, channel)
    return rows


def marker_row(system: System, compiled: CompiledSystem, work: Work, channel: Channel, marker: Marker) -> Array:
    """Return the row of one marker of a channel, (n_u,)."""
    row = np.zeros(int(compiled.model.bodies.u0[-1]))
    data = channel_marker(system, channel, marker)
    if data.body >= 0:
        u = slice(int(compiled.model.bodies.u0[data.body]), int(compiled.model.bodies.u0[data.body + 1]))
        first = 0 if channel.quantity == "translation" else 3
        row[u] = channel.direction @ marker_jacobian(compiled, work, data)[first : first + 3]
    return row


def channel_marker(system: System, channel: Channel, marker: Marker) -> MarkerData:
    """Return a marker of a channel; on a flexible body a position stands for the kept node nearest to it."""
    where = f"channel {channel.name!r}: marker"
    if not is_at_node(system, marker):
        return find_marker(system, where, marker)
    name = body_name(marker.body)
    body = flexible_body(system, where, name)
    if channel.quantity == "rotation":
        raise ModelError(
            f"channel {channel.name!r}: nodes keep no rotations: take an interface of flexible body {name!r}, "
            f"{', '.join(interface.name for interface in body.reduced.interfaces)}, in place of a position"
        )
    node = nearest_node(body, np.asarray(marker.position))
    return MarkerData(find_body(system, where, name), node_shape(body.moved, node, is_stiffened=body.is_stiffened))


def coordinate_row(system: System, compiled: CompiledSystem, work: Work, channel: CoordinateChannel) -> Array:
    """Return the row of a joint coordinate, (n_u,)."""
    state = State(work.state.r, np.array([euler_parameters(R) for R in work.state.R]), work.state.q, work.state.u)
    rows = coordinate_rows(system, compiled, work, state)
    name = f"{channel.joint}.{channel.coordinate}"
    if name not in rows:
        raise ModelError(f"channel {channel.name!r}: no joint coordinate {quoted(name)}{nearest(name, list(rows))}")
    return rows[name]


def stress_row(system: System, compiled: CompiledSystem, channel: StressChannel) -> Array:
    """Return the row of a stress component, (n_u,)."""
    body = flexible_body(system, f"channel {channel.name}", channel.body)
    row = np.zeros(int(compiled.model.bodies.u0[-1]))
    i = compiled.body_names.index(channel.body)
    modes = modes_at(body, channel.name, channel.position, None)
    if body.mean_axes is not None:
        modes = modes @ body.mean_axes.Z
    row[int(compiled.model.bodies.u0[i]) + 6 : int(compiled.model.bodies.u0[i + 1])] = modes[
        STRESS_COMPONENTS.index(channel.component)
    ]
    return row


def channel_units(system: System, channel: AnyChannel) -> tuple[str, str]:
    """Return the units of a channel as an output and as an input."""
    units = system.units
    if isinstance(channel, StressChannel):
        return units.stress_symbol, "-"
    if isinstance(channel, Channel):
        is_angle = channel.quantity == "rotation"
    else:
        is_angle = channel.coordinate.startswith("angle")
    per_time = ("", f"/{units.time_symbol}", f"/{units.time_symbol}²")[channel.rate]
    force = f"{units.force_symbol} {units.length_symbol}" if is_angle else units.force_symbol
    return ("rad" if is_angle else units.length_symbol) + per_time, force
