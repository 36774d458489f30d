"""Sensors of what joints carry and do, of energies and momenta, and of modal coordinates."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.compiling.markers import find_marker, joint_markers
from floatframe.compiling.pair_forces import bushing_markers
from floatframe.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.forces import Bushing
from floatframe.results.joint_coordinates import end_motion, joint_coordinate
from floatframe.results.recovery import require_same_modes
from floatframe.results.sensors.measurement import Measurement, unit_words, vector_columns
from floatframe.results.sensors.stresses import flexible_body
from floatframe.results.trajectory import Energies, Trajectory
from floatframe.system import System

__all__ = ["AXES", "CoordinateSensor", "EnergySensor", "ModeSensor", "MomentumSensor", "ReactionSensor"]

AXES = ("ground", "marker")
ENERGIES = (*Energies.__dataclass_fields__, "total", "balance")


@frozen_copies
@dataclass(frozen=True, eq=False)
class ReactionSensor:
    """Force and moment that a joint or spring-damper exerts on its marker A, in ground axes or its own."""

    name: str
    of: str  #: a joint or spring-damper
    axes: str = "ground"  #: or "marker"

    def __post_init__(self) -> None:
        if self.axes not in AXES:
            raise ModelError(f"sensor {self.name!r}: axes: expected one of {', '.join(AXES)}, got {self.axes!r}")

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return force and moment over time: components and sizes."""
        choices = list(trajectory.connection_names)
        if self.of not in choices:
            raise ModelError(f"sensor {self.name!r}: no joint or spring {quoted(self.of)}{nearest(self.of, choices)}")
        reaction = trajectory.reaction(self.of)
        vectors = {"force ": reaction.force, "moment ": reaction.moment}
        if self.axes == "marker":
            joint = next((each for each in system.joints if each.name == self.of), None)
            if joint is not None:
                end = joint_markers(system, joint, compiled_system(system).placed)[0]
            else:
                spring = next(each for each in system.forces if getattr(each, "name", "") == self.of)
                if isinstance(spring, Bushing):
                    end = bushing_markers(system, spring, compiled_system(system).placed)[0]
                else:
                    end = find_marker(system, f"force {self.of!r}: marker_a", spring.marker_a)  # type: ignore[union-attr]
            A = end_motion(system, trajectory, end).axes
            vectors = {key: np.einsum("tba,tb->ta", A, values) for key, values in vectors.items()}
        columns: dict[str, Array] = {}
        units: dict[str, str] = {}
        for key, values in vectors.items():
            more, unit = vector_columns(values, unit_words(system.units, key.strip()), prefix=key)
            columns |= more
            units |= unit
        return Measurement(self.name, trajectory.t, columns, units)


@frozen_copies
@dataclass(frozen=True, eq=False)
class CoordinateSensor:
    """A coordinate of a joint: value, rate, and the force along it."""

    name: str
    joint: str
    coordinate: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return value, rate and force over time."""
        found = joint_coordinate(system, trajectory, self.joint, self.coordinate)
        value, force = ("angle", "moment") if found.is_angle else ("length", "force")
        rate = "angular speed" if found.is_angle else "speed"
        units = {"value": value, "rate": rate, "force": force}
        return Measurement(
            self.name,
            trajectory.t,
            {"value": found.value, "rate": found.rate, "force": found.force},
            {key: unit_words(system.units, what) for key, what in units.items()},
        )


@frozen_copies
@dataclass(frozen=True, eq=False)
class EnergySensor:
    """Energies of the whole system: kinetic, strain, gravity, springs, work, dissipated, total and balance."""

    name: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return all energies over time."""
        columns = {part: getattr(trajectory.energies, part) for part in ENERGIES}
        return Measurement(self.name, trajectory.t, columns, dict.fromkeys(columns, unit_words(system.units, "energy")))


@frozen_copies
@dataclass(frozen=True, eq=False)
class MomentumSensor:
    """Linear momentum, and angular momentum about the ground origin, in ground axes."""

    name: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return both over time."""
        linear = vector_columns(trajectory.linear_momentum, unit_words(system.units, "momentum"), prefix="linear ")
        angular = vector_columns(
            trajectory.angular_momentum, unit_words(system.units, "angular momentum"), prefix="angular "
        )
        return Measurement(self.name, trajectory.t, linear[0] | angular[0], linear[1] | angular[1])


@frozen_copies
@dataclass(frozen=True, eq=False)
class ModeSensor:
    """A modal coordinate of a flexible body and its strain energy."""

    name: str
    body: str
    mode: int  #: from 1

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the coordinate and its rate over time."""
        body = flexible_body(system, self.name, self.body)
        require_same_modes(trajectory, self.body, body.reduced)
        if not 1 <= self.mode <= body.reduced.n_q:
            raise ModelError(f"sensor {self.name!r}: mode: expected 1 to {body.reduced.n_q}, got {self.mode}")
        motion, unit = trajectory.body(self.body), unit_words(system.units, "modal")
        columns = {"q": motion.q[:, self.mode - 1], "q_dot": motion.q_dot[:, self.mode - 1]}
        return Measurement(self.name, trajectory.t, columns, {"q": unit, "q_dot": f"{unit}/{system.units.time_symbol}"})
