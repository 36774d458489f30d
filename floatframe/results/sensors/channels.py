"""Channels: named scalars as inputs (a force, a torque) and outputs (a motion, a stress) of a linearised system.

As outputs, they are sensors with one column, named "value".
"""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import STRESS_COMPONENTS, GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.units import Units
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import array_of_shape, unit_vector
from floatframe.model.rotations import rotation_log
from floatframe.model.system import System
from floatframe.results.sensors.linear_columns import scalar_columns
from floatframe.results.sensors.measurement import Measurement, unit_words
from floatframe.results.sensors.places import place_motion, require_turning, small_place
from floatframe.results.sensors.stresses import StressSensor
from floatframe.results.small_motions.rows import LinearColumns
from floatframe.results.small_motions.small_motions import SmallMotions, SmallPlace
from floatframe.results.trajectory import Trajectory

__all__ = ["QUANTITIES", "RATES", "VALUE", "Channel", "StressChannel", "rate_unit", "require_rate"]

QUANTITIES = ("translation", "rotation")
RATES = ("displacement", "velocity", "acceleration")
VALUE = "value"  #: name of the only column of a channel


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Channel:
    """Motion of a marker along a direction: displacement [m] since the start, or rotation [rad] about the direction.

    On a flexible body, the marker is an interface, or the kept node nearest to a position in mesh axes.

    As an input, it is the force [N], or moment [N m], that does work on this motion. With `relative_to`, the motion is
    relative to that marker, on which the opposite force acts.

    Parameters
    ----------
    name
        Name of the channel.
    marker
        Marker that is observed.
    direction
        Direction of the motion, ground axes, (3,); it is divided by its length.
    quantity
        Observed motion, "translation" along the direction or "rotation" about it.
    relative_to
        Marker relative to which it is observed; None: the ground.
    rate
        Derivative of an output: 0 displacement, 1 velocity, 2 acceleration, relative to the rotating system.
    """

    name: str
    marker: Marker
    direction: GivenArray = given((1.0, 0.0, 0.0))
    quantity: str = "translation"
    relative_to: Marker | None = None
    rate: int = 0

    def __post_init__(self) -> None:
        where = f"channel {self.name!r}"
        object.__setattr__(self, "direction", unit_vector(f"{where}: direction", self.direction))
        if self.quantity not in QUANTITIES:
            raise ModelError(f"{where}: quantity: expected one of {', '.join(QUANTITIES)}, got {self.quantity!r}")
        require_rate(where, self.rate)

    @property
    def markers(self) -> list[tuple[float, Marker]]:
        """The marker and its reference marker, with signs."""
        return [(sign, each) for sign, each in ((1.0, self.marker), (-1.0, self.relative_to)) if each is not None]

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the motion along the direction over time; displacements and rotations are zero at the start."""
        total = np.zeros(len(trajectory.t))
        for sign, marker in self.markers:
            where = f"channel {self.name!r}: marker"
            if self.quantity == "rotation":
                require_turning(system, where, marker)
            place = place_motion(system, trajectory, where, marker)
            if self.quantity == "translation":
                moved = (place.position - place.position[0], place.velocity, place.acceleration)[self.rate]
            elif self.rate == 0:
                moved = rotation_log(place.axes @ place.axes[0].T)
            else:
                alpha = np.zeros_like(place.omega) if place.alpha is None else place.alpha
                moved = (place.omega, alpha)[self.rate - 1]
            total += sign * moved @ self.direction
        return Measurement(self.name, trajectory.t, {VALUE: total}, {VALUE: self.units(system.units)})

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return the motion along the direction as a linear function of motions relative to the rotating system.

        What is measured over time is relative to the ground; the row is also the direction of an input force, exactly.
        """
        rows = small.by_motion(np.zeros((1, small.n_x)))
        for sign, marker in self.markers:
            place = self.place(small, marker)
            rows = rows + (place.moved if self.quantity == "translation" else place.rotation).mapped(
                sign * self.direction
            )
        for _ in range(self.rate):
            rows = rows.rate
        return scalar_columns({VALUE: rows}, {VALUE: self.units(small.system.units)})

    def place(self, small: SmallMotions, marker: Marker) -> SmallPlace:
        """Return a marker's linearised motion; `ModelError` for the rotation of a node without kept rotations."""
        where = f"channel {self.name!r}: marker"
        if self.quantity == "rotation":
            require_turning(small.system, where, marker)
        return small_place(small, where, marker)

    def units(self, units: Units) -> str:
        """Return the unit of the channel as an output."""
        return rate_unit(units, self.quantity == "rotation", self.rate)

    def force_units(self, units: Units) -> str:
        """Return the unit of the channel as an input."""
        return unit_words(units, "moment" if self.quantity == "rotation" else "force")


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class StressChannel:
    """A stress component at a node of a flexible body, in axes of its frame; an output only.

    Parameters
    ----------
    name
        Name of the channel.
    body
        Name of the flexible body.
    component
        Component of the stress, "xx", "yy", "zz", "yz", "xz" or "xy".
    position
        Position in mesh axes, (3,) [m]; the nearest kept node is used.
    """

    name: str
    body: str
    component: str
    position: GivenArray = given()

    def __post_init__(self) -> None:
        where = f"channel {self.name!r}"
        object.__setattr__(self, "position", array_of_shape(f"{where}: position", self.position, (3,)))
        if self.component not in STRESS_COMPONENTS:
            raise ModelError(
                f"{where}: component: expected one of {', '.join(STRESS_COMPONENTS)}, got {self.component!r}"
            )

    @property
    def sensor(self) -> StressSensor:
        """The sensor that measures all stress components."""
        return StressSensor(self.name, self.body, position=self.position)

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the stress component over time."""
        found = self.sensor.measure(system, trajectory)
        return Measurement(self.name, found.t, {VALUE: found.columns[self.component]}, {VALUE: found.units["xx"]})

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return the stress component as a linear function of small motions."""
        found = self.sensor.linear(small)
        return scalar_columns({VALUE: found.columns[self.component]}, {VALUE: found.units[self.component]})

    def units(self, units: Units) -> str:
        """Return the unit of the stress."""
        return units.stress_symbol


def require_rate(where: str, rate: int) -> None:
    """Raise `ModelError` unless a rate is 0, 1 or 2."""
    if rate not in (0, 1, 2):
        raise ModelError(f"{where}: rate: expected 0, 1 or 2 ({', '.join(RATES)}), got {rate!r}")


def rate_unit(units: Units, is_angle: bool, rate: int) -> str:
    """Return the unit of a distance or angle, or of one of its rates."""
    per_time = ("", f"/{units.time_symbol}", f"/{units.time_symbol}²")[rate]
    return ("rad" if is_angle else units.length_symbol) + per_time
