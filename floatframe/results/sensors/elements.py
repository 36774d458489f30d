"""Sensors of public elements: their outputs, states and multipliers."""

from dataclasses import dataclass

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.callbacks import raise_errors_of
from floatframe.engine.compiling.callbacks.law_slopes import difference_slopes
from floatframe.engine.compiling.public_elements import PlacedLaw
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.model.forces import UserForce
from floatframe.model.joints.rows import kind_of
from floatframe.model.system import System
from floatframe.results.coordinate_elements import coupler_motion, user_force_motion
from floatframe.results.element_motion import element_motion
from floatframe.results.sensors.linear_columns import scalar_columns
from floatframe.results.sensors.measurement import Measurement, unit_words
from floatframe.results.small_motions.rows import LinearColumns, Rows, joined
from floatframe.results.small_motions.small_motions import SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = ["ControlSensor", "CouplerSensor", "ElementSensor", "output_rows"]


# outputs of an element as functions of small motions, from derivatives of its law -------------------------------------


def output_rows(placed: PlacedLaw, small: SmallMotions) -> Rows:
    """Return the outputs of an element as functions of small motions, one row each."""
    model, work = small.compiled.model, small.work
    c, n = placed.connection, len(placed.markers)
    first = int(model.connections.a[c])
    markers = work.markers
    motion = []
    for m in range(first, first + n):
        motion += [markers.r[m], markers.A[m].ravel(), markers.v[m], markers.omega[m]]
        if placed.law.accelerations:
            motion.append(markers.acceleration[model.markers.accelerated[m]])
    unknown = [*placed.states, *placed.multipliers]
    inputs = np.concatenate([[float(work.state.time)], *motion, work.state.w[unknown]])
    slopes = difference_slopes(placed.value.address, placed.head, placed.law.data, inputs, placed.sizes)
    slopes = slopes[placed.n_out :]
    raise_errors_of([placed.value])
    parts = []
    for marker in placed.markers:
        place = small.place(marker, placed.element.name)
        parts += [place.moved, place.turned, small.velocity(place.moved), small.velocity(place.turned)]
        if placed.law.accelerations:
            parts += [small.acceleration(place.moved), small.acceleration(place.turned)]
    if unknown:
        parts.append(small.by_wrench(unknown))
    return joined(parts).turned(slopes)


# sensors of couplers and user forces: their coordinates, rates, forces and states -------------------------------------


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


# elements -------------------------------------------------------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
class ElementSensor:
    """Outputs, states and multipliers of a public element, by name, or one of them.

    If an output and a state have the same name, the state is measured.
    """

    name: str
    of: str  #: name of the element
    output: str | None = None  #: name of an output, state or multiplier; default: all

    def measure(self, system: System, trajectory: Trajectory) -> Measurement:
        """Return a column for each output, state and multiplier, or the requested one."""
        units = self.units_of(self.placed(system))
        found = element_motion(system, trajectory, self.of)
        columns: dict[str, Array] = {**found.outputs, **found.states, **found.multipliers}
        return Measurement(self.name, trajectory.t, {name: columns[name] for name in units}, units)

    def linear(self, small: SmallMotions) -> LinearColumns:
        """Return all columns: outputs from derivatives of the law; states and multipliers are unknowns."""
        placed = self.placed(small.system)
        units = self.units_of(placed)
        law = placed.law
        names = dict(zip((*law.states, *law.multipliers), (*placed.states, *placed.multipliers), strict=True))
        columns = {name: small.by_wrench([names[name]]) for name in units if name in names}
        if any(name in law.outputs for name in units):
            rows = output_rows(placed, small)
            columns |= {name: rows[law.outputs.index(name)] for name in units if name in law.outputs}
        return LinearColumns({name: columns[name] for name in units}, units, {})

    def placed(self, system: System) -> PlacedLaw:
        """Return the element; `ModelError` with the nearest name if it does not exist."""
        laws = compiled_system(system).laws
        names = [each.element.name for each in laws]
        if self.of not in names:
            raise ModelError(f"sensor {self.name!r}: no element {quoted(self.of)}{nearest(self.of, names)}")
        return laws[names.index(self.of)]

    def units_of(self, placed: PlacedLaw) -> dict[str, str]:
        """Return the units of its columns, by name; `ModelError` with the nearest name if there is no such column."""
        law = placed.law
        units = dict(zip(law.outputs, law.output_units, strict=True))
        units |= dict(zip(law.states, law.state_units, strict=True))
        units |= dict(zip(law.multipliers, law.multiplier_units, strict=True))
        units = {name: unit or "-" for name, unit in units.items()}
        if self.output is None:
            return units
        if self.output not in units:
            raise ModelError(
                f"sensor {self.name!r}: element {self.of!r} has no output {quoted(self.output)}"
                f"{nearest(self.output, list(units))}"
            )
        return {self.output: units[self.output]}
