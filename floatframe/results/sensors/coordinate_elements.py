"""Sensors of couplers and user forces: their coordinates, rates, forces and states."""

from dataclasses import dataclass

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.model.forces import UserForce
from floatframe.model.joints.rows import kind_of
from floatframe.model.system import System
from floatframe.results.coordinate_elements import coupler_motion, user_force_motion
from floatframe.results.sensors.linear_columns import scalar_columns
from floatframe.results.sensors.measurement import Measurement, unit_words
from floatframe.results.small_motions.rows import LinearColumns, Rows
from floatframe.results.small_motions.small_motions import SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = ["ControlSensor", "CouplerSensor"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class CouplerSensor:
    """A coupler: value, rate and force of each of its terms, numbered from 1."""

    name: str
    of: str  #: name of the coupler

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the columns "value 1", "rate 1", "force 1", "value 2", ..."""
        names = self.coupler_names(system)
        found = coupler_motion(system, trajectory, self.of)
        columns: dict[str, Array] = {}
        units: dict[str, str] = {}
        for k, is_angle in enumerate(angles_of(system, names.index(self.of))):
            own = (f"value {k + 1}", f"rate {k + 1}", f"force {k + 1}")
            columns |= dict(zip(own, (found.value[:, k], found.rate[:, k], found.force[:, k]), strict=True))
            units |= dict(zip(own, coordinate_units(system, is_angle), strict=True))
        return Measurement(self.name, trajectory.t, columns, units)

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return all columns, which are unknowns like the wrenches."""
        model = small.compiled.model
        k = self.coupler_names(small.system).index(self.of)
        columns: dict[str, Rows] = {}
        for p in range(int(model.elements.coordinate0[k]), int(model.elements.coordinate0[k + 1])):
            n, row = p - int(model.elements.coordinate0[k]) + 1, int(model.coordinates.row[p])
            force = small.by_wrench([int(model.elements.core[k])], float(model.coordinates.factor[p]))
            columns |= {f"value {n}": small.by_wrench([row]), f"rate {n}": small.by_wrench([row + 1])}
            columns[f"force {n}"] = force
        return scalar_columns(columns, dict(self.measure(small.system, small.now).units))

    def coupler_names(self, system: System) -> list[str]:
        """Return the names of the couplers; `ModelError` with the nearest one if that of the sensor does not exist."""
        names = [coupler.name for coupler in system.couplers]
        if self.of not in names:
            raise ModelError(f"sensor {self.name!r}: no coupler {quoted(self.of)}{nearest(self.of, names)}")
        return names


@frozen_copies
@dataclass(frozen=True, eq=False)
class ControlSensor:
    """A user force: its coordinates, their rates, the forces along them, and its states, all by name."""

    name: str
    of: str  #: name of the user force

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return the columns "phi", "phi_dot", "phi force", ..., and states by name (without unit)."""
        forces, k = self.user_forces(system)
        found = user_force_motion(system, trajectory, self.of)
        columns: dict[str, Array] = {}
        units: dict[str, str] = {}
        for name, is_angle in zip(forces[k].coordinates, angles_of(system, len(system.couplers) + k), strict=True):
            value, rate, force = coordinate_units(system, is_angle)
            columns |= {name: found.value[name], f"{name}_dot": found.rate[name]}
            units |= {name: value, f"{name}_dot": rate}
            if name in found.force:
                columns[f"{name} force"], units[f"{name} force"] = found.force[name], force
        columns |= found.states
        units |= dict.fromkeys(found.states, "-")
        return Measurement(self.name, trajectory.t, columns, units)

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return all columns except states, which are not linear here (see `linearize`); they are unknowns."""
        model = small.compiled.model
        forces, u = self.user_forces(small.system)
        k, acting = len(small.system.couplers) + u, list(forces[u].forces)
        columns: dict[str, Rows] = {}
        for p, name in enumerate(forces[u].coordinates, start=int(model.elements.coordinate0[k])):
            row = int(model.coordinates.row[p])
            columns |= {name: small.by_wrench([row]), f"{name}_dot": small.by_wrench([row + 1])}
            if name in acting:
                columns[f"{name} force"] = small.by_wrench([int(model.elements.core[k]) + acting.index(name)])
        return scalar_columns(columns, dict(self.measure(small.system, small.now).units))

    def user_forces(self, system: System) -> tuple[list[UserForce], int]:
        """Return the user forces and the index of the sensor's one; `ModelError` with the nearest name otherwise."""
        forces = [force for force in system.forces if isinstance(force, UserForce)]
        names = [force.name for force in forces]
        if self.of not in names:
            raise ModelError(f"sensor {self.name!r}: no user force {quoted(self.of)}{nearest(self.of, names)}")
        return forces, names.index(self.of)


def angles_of(system: System, k: int) -> list[bool]:
    """Return whether each coordinate of coupler or user force number k is an angle."""
    model = compiled_system(system).model
    rows = model.coordinates.row[model.elements.coordinate0[k] : model.elements.coordinate0[k + 1]]
    return [kind_of(code).is_angle for code in model.rows.kind[rows]]


def coordinate_units(system: System, is_angle: bool) -> tuple[str, str, str]:
    """Return the units of value, rate and force of a coordinate."""
    words = ("angle", "angular speed", "moment") if is_angle else ("length", "speed", "force")
    value, rate, force = (unit_words(system.units, word) for word in words)
    return value, rate, force
