"""Tables of the system file for co-simulation: [fmu], [fmus.NAME] and [cosimulation]."""

from pathlib import Path

from pydantic import Field

from fe_models.foundation.toml_file import Table, choice
from floatframe.files.system_file.keys import Name, Number, Positive
from floatframe.simulation.foreign_units import SCHEMES, Coupling, ForeignUnit

__all__ = ["CosimulationSection", "FmuSection", "ForeignSection"]


class FmuSection(Table):
    """[fmu]: the inputs, outputs and parameters of the FMU that `floatframe fmu` writes."""

    inputs: list[Name] | None = Field(
        None, description="names of inputs, such as forces.NAME.amplitude, joints.NAME.angle, or a table [inputs.NAME]"
    )
    outputs: list[Name] | None = Field(None, description='names of sensors, or "joint.coordinate"')
    parameters: dict[str, Name] | None = Field(None, description="key paths of numbers in this file by name, text")


class ForeignSection(Table):
    """[fmus.NAME]: an FMU of another program that is coupled to the system."""

    file: Name = Field(description="the path of the FMU, relative to this file")
    inputs: dict[str, Name] = Field({}, description='sensors by input of the FMU, such as {phi = "hinge.angle"}')
    outputs: dict[str, Name] = Field(
        {}, description='inputs of the system by output of the FMU, such as {torque = "forces.motor.motor"}'
    )
    parameters: dict[str, Number] = Field({}, description="numbers by parameter of the FMU")

    def unit(self, name: str, folder: Path) -> ForeignUnit:
        """Return the unit; its path is relative to the folder."""
        return ForeignUnit(name, str(folder / self.file), self.inputs, self.outputs, self.parameters)


class CosimulationSection(Table):
    """[cosimulation]: how the system and its FMUs are stepped together."""

    step: Positive | None = Field(None, description="a number above 0, the macro-step, a multiple of run.h")
    scheme: choice("scheme", lambda: SCHEMES) = Field(  # type: ignore[valid-type]
        SCHEMES[0], description=f"one of {', '.join(SCHEMES)}"
    )
    tolerance: float = Field(1e-9, gt=0, lt=1, description="a number between 0 and 1, the tolerance of the iteration")
    max_iterations: int = Field(50, ge=2, description="a whole number, 2 or more, the most rounds of the iteration")

    def coupling(self) -> Coupling:
        """Return the coupling that the table describes."""
        return Coupling(self.step, self.scheme, self.tolerance, self.max_iterations)
