"""Tables of the system file for co-simulation: [fmu], what the system is to other programs."""

from pydantic import Field

from fe_models.foundation.toml_file import Table
from floatframe.system_file.keys import Name

__all__ = ["FmuSection"]


class FmuSection(Table):
    """[fmu]: inputs, outputs and parameters of the FMU that `floatframe fmu` writes."""

    inputs: list[Name] | None = Field(
        None, description="names of inputs, such as forces.NAME.amplitude, joints.NAME.angle, or a table [inputs.NAME]"
    )
    outputs: list[Name] | None = Field(None, description='names of sensors, or "joint.coordinate"')
    parameters: dict[str, Name] | None = Field(None, description="key paths of numbers in this file by name, text")
