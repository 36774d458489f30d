"""Units of other programs in a system: the FMU file, its inputs and outputs, and the coupling of steps."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

from fe_models.foundation.records import FrozenMapping, checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.checked_values import number

__all__ = ["Coupling", "ForeignUnit"]


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class ForeignUnit:
    """An FMU for co-simulation in a system: a controller, a tyre, hydraulics.

    Parameters
    ----------
    name
        Name of the unit, unique in the system.
    file
        Path of the FMU.
    inputs
        Sensors of the system, such as "tip.x", for the inputs of the unit.
    outputs
        Inputs of the system on which the outputs of the unit act.
    parameters
        Values of parameters of the unit.
    """

    name: str
    file: str
    inputs: Mapping[str, str] = field(default_factory=dict)
    outputs: Mapping[str, str] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for part in ("inputs", "outputs", "parameters"):
            object.__setattr__(self, part, FrozenMapping(dict(getattr(self, part))))
        if not self.inputs and not self.outputs:
            raise ModelError(f"unit {self.name!r}: expected inputs or outputs, got neither: it would have no effect")


@dataclass(frozen=True)
@checked_fields(ModelError)
class Coupling:
    """How a system and its foreign units take their steps together.

    explicit: all take a macro-step with constant inputs, those at its beginning. The error is of first order in the
    step. iterated: all repeat the macro-step from its initial states, with the means of the inputs at its beginning and
    end, until these converge. The error is of second order, and the coupling may be stiffer.

    Parameters
    ----------
    step
        Macro-step [s], a multiple of the step of the system; None: that step.
    scheme
        "explicit" or "iterated".
    tolerance
        Tolerance of the iteration, relative to the size of each signal.
    max_iterations
        Largest number of iterations in a macro-step.
    """

    step: float | None = None
    scheme: Literal["explicit", "iterated"] = "explicit"
    tolerance: float = 1e-9
    max_iterations: int = 50

    def __post_init__(self) -> None:
        if self.step is not None:
            number("Coupling: step", self.step, above=0.0)
        if not 0.0 < self.tolerance < 1.0:
            raise ModelError(f"Coupling: tolerance: expected 0 < tolerance < 1, got {self.tolerance}")
        if self.max_iterations < 2:
            raise ModelError(f"Coupling: max_iterations: expected at least 2, got {self.max_iterations}")
