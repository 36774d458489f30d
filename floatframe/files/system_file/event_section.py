"""Tables of the system file for events: [events.NAME]."""

from typing import Annotated

from pydantic import Field

from fe_models.foundation.toml_file import Table, choice
from floatframe.simulation.events import DIRECTIONS, Event

__all__ = ["EventSection"]


class EventSection(Table):
    """[events.NAME]: an action of a run when a measured value crosses a level, or at a given time."""

    watch: str = Field("", description='the name of a sensor, or "joint.coordinate"')
    at: float | None = Field(None, description="instead of watch, a number, the time of the event")
    column: str = Field("", description="a column of the sensor; default: its first")
    level: float = Field(0.0, description="a number, the value that is crossed")
    direction: choice("direction", lambda: tuple(DIRECTIONS)) = Field(  # type: ignore[valid-type]
        "both", description=f"one of {', '.join(DIRECTIONS)}"
    )
    stop: bool = Field(False, description="true: the run ends there")
    switch_on: list[str] = Field([], description="names of forces and couplers")
    switch_off: list[str] = Field([], description="names of forces and couplers")
    record: bool = Field(False, description="true: the results at this time are kept")
    tolerance: Annotated[float, Field(gt=0)] = Field(
        1e-9, description="a number above 0, the tolerance of the time, relative to the step"
    )

    def event(self, name: str) -> Event:
        """Return the event of that name."""
        return Event(name, **{key: getattr(self, key) for key in type(self).model_fields})
