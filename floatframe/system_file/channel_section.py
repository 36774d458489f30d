"""Tables of the system file for the linearised system: [inputs.NAME] (forces) and [outputs.NAME] (what is observed)."""

import numpy as np
from pydantic import Field, model_validator

from fe_models.foundation.components import STRESS_COMPONENTS
from fe_models.foundation.toml_file import Table, Vector3, choice
from floatframe.analyses.linear.channels import AnyOutput
from floatframe.results.sensors.channels import QUANTITIES, RATES, Channel, CoordinateChannel, StressChannel
from floatframe.system_file.place_key import MeasuredPlace, marker_at

__all__ = ["InputSection", "OutputSection"]

WAYS = {  # keys that go together: the first one tells which way it is
    "joint": ("joint", "coordinate"),
    "component": ("component", "body", "position"),
    "body": ("body", "marker", "direction", "quantity", "relative_to", "relative_marker"),
}


class InputSection(Table):
    """[inputs.NAME]: a force or torque at a place, or along a joint coordinate."""

    body: str | None = Field(None, description='the name of a body, or "ground"')
    marker: MeasuredPlace | None = Field(None, description="an interface, or a position [x, y, z] in the body")
    direction: Vector3 | None = Field(None, description="the direction in ground axes, [x, y, z]; default: x")
    quantity: choice("quantity", lambda: QUANTITIES) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(QUANTITIES)}"
    )
    relative_to: str | None = Field(None, description="the name of the body against which it is taken")
    relative_marker: MeasuredPlace | None = Field(None, description="an interface of, or a position in that body")
    joint: str | None = Field(None, description="the name of a joint")
    coordinate: str | None = Field(None, description="a coordinate of the joint")

    def way(self) -> str:
        """Return which of `WAYS` the keys belong to; ValueError if they do not go together."""
        way = next((key for key in WAYS if getattr(self, key, None) is not None), None)
        if way is None:
            raise ValueError("expected body (with marker and direction), or joint and coordinate")
        for key in type(self).model_fields:
            if key != "measure" and getattr(self, key) is not None and key not in WAYS[way]:
                raise ValueError(f"the keys {way} and {key} do not go together; with {way}: {', '.join(WAYS[way][1:])}")
        return way

    @model_validator(mode="after")
    def _fits(self) -> "InputSection":
        if self.way() == "joint" and self.coordinate is None:
            raise ValueError("coordinate: missing; expected a coordinate of the joint")
        return self

    def channel(self, name: str, rate: int = 0) -> Channel | CoordinateChannel:
        """Return the channel of the table."""
        if self.way() == "joint":
            return CoordinateChannel(name, str(self.joint), str(self.coordinate), rate)
        seen_from = None if self.relative_to is None else marker_at(self.relative_to, self.relative_marker)
        direction = np.array(self.direction or (1.0, 0.0, 0.0))
        return Channel(
            name, marker_at(str(self.body), self.marker), direction, self.quantity or QUANTITIES[0], seen_from, rate
        )


class OutputSection(InputSection):
    """[outputs.NAME]: a motion of a place or joint coordinate, or a stress."""

    measure: choice("measure", lambda: RATES) = Field(  # type: ignore[valid-type]
        "displacement", description=f"one of {', '.join(RATES)}"
    )
    component: choice("stress component", lambda: STRESS_COMPONENTS) | None = Field(  # type: ignore[valid-type]
        None, description=f"one of {', '.join(STRESS_COMPONENTS)}: the output is a stress"
    )
    position: Vector3 | None = Field(None, description="a position in the body, [x, y, z]: the nearest node is taken")

    @model_validator(mode="after")
    def _fits_stress(self) -> "OutputSection":
        if self.way() == "component" and (self.body is None or self.position is None):
            raise ValueError("a stress needs body and position: where it is")
        return self

    def output(self, name: str) -> AnyOutput:
        """Return the channel of the table as an output."""
        if self.way() == "component":
            return StressChannel(name, str(self.body), str(self.component), np.array(self.position))
        return self.channel(name, RATES.index(self.measure))
