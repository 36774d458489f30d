"""Sensors of public elements: their outputs, states and multipliers."""

from dataclasses import dataclass

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from fe_models.foundation.words import nearest, quoted
from floatframe.engine.compiling.public_elements import PlacedLaw
from floatframe.engine.compiling.system import compiled_system
from floatframe.errors import ModelError
from floatframe.model.system import System
from floatframe.results.element_motion import element_motion
from floatframe.results.sensors.element_slopes import output_rows
from floatframe.results.sensors.measurement import Measurement
from floatframe.results.small_motions.rows import LinearColumns
from floatframe.results.small_motions.small_motions import SmallMotions
from floatframe.results.trajectory import Trajectory

__all__ = ["ElementSensor"]


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
