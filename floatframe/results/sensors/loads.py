"""Sensors of joint loads, of energies and momenta, and of modal coordinates."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from fe_models.foundation.records import checked_fields, frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.interface_loads import in_body
from floatframe.engine.compiling.markers import MarkerData, find_marker, joint_markers
from floatframe.engine.compiling.pair_forces import bushing_markers
from floatframe.engine.compiling.system import compiled_system
from floatframe.engine.initial_conditions.newton_equations import linearized
from floatframe.errors import ModelError
from floatframe.model.forces import Bushing
from floatframe.model.rotations import tilde
from floatframe.model.system import System
from floatframe.results.joint_coordinates import end_motion
from floatframe.results.recovery import require_same_modes
from floatframe.results.sensors.linear_columns import NO_SIZE
from floatframe.results.sensors.measurement import Measurement, load_columns, unit_words, vector_columns
from floatframe.results.sensors.stresses import flexible_body
from floatframe.results.small_motions.rows import LinearColumns
from floatframe.results.small_motions.small_motions import SmallMotions
from floatframe.results.trajectory import Energies, Trajectory

__all__ = ["EnergySensor", "ModeSensor", "MomentumSensor", "ReactionSensor"]

ENERGIES = (*Energies.__dataclass_fields__, "total", "balance")


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ReactionSensor:
    """Force and moment (force x, ..., moment size) that a joint or spring-damper exerts on its marker A.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    of
        Name of a joint or spring-damper.
    axes
        Axes of the components, "ground", or "marker" for those of marker A.
    """

    name: str
    of: str
    axes: Literal["ground", "marker"] = "ground"

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return force and moment over time, as components and magnitudes."""
        self.require_connection(list(trajectory.connection_names))
        reaction = trajectory.reaction(self.of)
        vectors = reaction.force, reaction.moment
        if self.axes == "marker":
            A = end_motion(system, trajectory, self.end_a(system), self.of).axes
            vectors = in_body(A, reaction.force), in_body(A, reaction.moment)
        return Measurement(self.name, trajectory.t, *load_columns(system.units, *vectors))

    def require_connection(self, choices: list[str]) -> None:
        """Raise `ModelError`, with the closest name, if the joint or spring does not exist."""
        if self.of not in choices:
            raise ModelError(f"sensor {self.name!r}: no joint or spring {quoted(self.of)}{nearest(self.of, choices)}")

    def end_a(self, system: System) -> MarkerData:
        """Return marker A of the joint or spring-damper."""
        joint = next((each for each in system.joints if each.name == self.of), None)
        if joint is not None:
            return joint_markers(system, joint, compiled_system(system).placed)[0]
        spring = next(each for each in system.forces if getattr(each, "name", "") == self.of)
        if isinstance(spring, Bushing):
            return bushing_markers(system, spring, compiled_system(system).placed)[0]
        return find_marker(system, f"force {self.of!r}: marker_a", spring.marker_a)  # type: ignore[union-attr]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class EnergySensor:
    """Energies of the whole system: kinetic, strain, gravity, springs, work, dissipated, total and balance.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    """

    name: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return all energies over time."""
        columns = {part: getattr(trajectory.energies, part) for part in ENERGIES}
        return Measurement(self.name, trajectory.t, columns, dict.fromkeys(columns, unit_words(system.units, "energy")))


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class MomentumSensor:
    """Linear momentum, and angular momentum about the ground origin, in ground axes.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    """

    name: str

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return linear and angular momentum over time."""
        linear = vector_columns(trajectory.linear_momentum, unit_words(system.units, "momentum"), prefix="linear ")
        angular = vector_columns(
            trajectory.angular_momentum, unit_words(system.units, "angular momentum"), prefix="angular "
        )
        return Measurement(self.name, trajectory.t, linear[0] | angular[0], linear[1] | angular[1])

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return momenta about a state of rest: Σ R m v and Σ R j + r × R m v, where M u = (m v, j, ...).

        Motions near by have no records of the kernels, which compute momenta.
        """
        found = self.measure(small.system, small.now)
        if small.is_turning:
            why = dict.fromkeys(found.columns, "the momentum about a steady rotation: linearise the system at rest")
            return LinearColumns({}, found.units, why)
        x = np.zeros((6, small.n_x))
        masses = linearized(small.compiled.model, small.work, 1.0, 0.0, 0.0).H
        for i, mass in enumerate(masses):
            r, R = small.work.state.r[i], small.work.state.R[i]
            linear, own = R @ mass[:3], R @ mass[3:6]
            x[:, small.unknowns(i)] = np.vstack([linear, own + tilde(r) @ linear])
        rows = small.by_motion(x).rate
        columns = {f"{kind} {axis}": rows[3 * k + j] for k, kind in enumerate(("linear", "angular"))
                   for j, axis in enumerate("xyz")}  # fmt: skip
        return LinearColumns(columns, found.units, {f"{kind} size": NO_SIZE for kind in ("linear", "angular")})


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ModeSensor:
    """A modal coordinate of a flexible body, and its rate.

    Parameters
    ----------
    name
        Name of the sensor, unique in the system.
    body
        Name of the flexible body.
    mode
        Number of the mode, from 1.
    """

    name: str
    body: str
    mode: int

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the coordinate and its rate over time."""
        body = flexible_body(system, self.name, self.body)
        require_same_modes(trajectory, self.body, body.reduced)
        self.require_mode(body.reduced.n_q)
        motion, unit = trajectory.body(self.body), unit_words(system.units, "modal")
        columns = {"q": motion.q[:, self.mode - 1], "q_dot": motion.q_dot[:, self.mode - 1]}
        return Measurement(self.name, trajectory.t, columns, {"q": unit, "q_dot": f"{unit}/{system.units.time_symbol}"})

    def require_mode(self, n_q: int) -> None:
        """Raise `ModelError` unless the body has this mode."""
        if not 1 <= self.mode <= n_q:
            raise ModelError(f"sensor {self.name!r}: mode: expected 1 to {n_q}, got {self.mode}")
