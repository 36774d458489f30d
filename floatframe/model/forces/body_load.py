"""A load case of a modal file (pressure, field, nodal forces) as a force on its body."""

from dataclasses import dataclass, field

from fe_models.foundation.copies import frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Named
from floatframe.model.checked_values import number
from floatframe.model.functions.time_functions import TimeFunction, constant

__all__ = ["BodyLoad"]


@frozen_copies
@dataclass(frozen=True, eq=False)
class BodyLoad:
    """A load case of a flexible body times an amplitude; it rotates with the body.

    Its resultant acts on the undeformed body, and its modal forces act on the modes. The first-order change of its
    torque due to the deformation is neglected.
    """

    name: str
    body: str | Named  #: a flexible body
    load_case: str  #: name of the load case in the modal file
    amplitude: TimeFunction | float = field(default=1.0)  #: factor: a number or a function of time

    def __post_init__(self) -> None:
        if isinstance(self.amplitude, int | float):
            value = number(f"force {self.name!r}: amplitude", self.amplitude)
            object.__setattr__(self, "amplitude", constant(value))
        if not isinstance(self.amplitude, TimeFunction):
            raise ModelError(
                f"force {self.name!r}: amplitude: expected a number or a function of functions.time_functions, got "
                f"{self.amplitude!r}"
            )
