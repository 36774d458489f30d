"""Loads on bodies: gravity, a force at a point, and a distributed load.

Evaluated in `floatframe.engine.kernels.evaluation`.
"""

from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker, Named
from floatframe.model.checked_values import array_of_shape, number
from floatframe.model.functions.time_functions import TimeFunction, constant

__all__ = ["BodyLoad", "Gravity", "PointForce"]


# Gravity: a uniform field ---------------------------------------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Gravity:
    """A uniform gravitational acceleration on every particle of the deformed bodies.

    Parameters
    ----------
    acceleration
        Ground axes, (3,) [m/s²], such as (0, 0, -9.81).
    """

    acceleration: GivenArray = given()

    def __post_init__(self) -> None:
        object.__setattr__(self, "acceleration", array_of_shape("gravity", self.acceleration, (3,)))


# a load case of a modal file (pressure, field, nodal forces) as a force on its body -----------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class BodyLoad:
    """A load case of a flexible body, multiplied by an amplitude; it rotates with the body.

    Its resultant acts on the undeformed body, and its modal forces act on the modes. The first-order change of its
    torque due to the deformation is neglected.

    Parameters
    ----------
    name
        Name of the force, unique in the system.
    body
        a flexible body.
    load_case
        Name of the load case in the modal file.
    amplitude
        Factor: a number or a function of time.
    """

    name: str
    body: str | Named
    load_case: str
    amplitude: TimeFunction | float = field(default=1.0)

    def __post_init__(self) -> None:
        if isinstance(self.amplitude, int | float):
            value = number(f"force {self.name!r}: amplitude", self.amplitude)
            object.__setattr__(self, "amplitude", constant(value))
        if not isinstance(self.amplitude, TimeFunction):
            raise ModelError(
                f"force {self.name!r}: amplitude: expected a number or a function of floatframe.functions, got "
                f"{self.amplitude!r}"
            )


# a force and torque at a marker, fixed in space or in the body --------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class PointForce:
    """A force and a torque on a marker.

    Parameters
    ----------
    name
        Name of the force, unique in the system.
    marker
        Marker at which the force acts.
    force
        Force, (3,) [N].
    torque
        Torque, (3,) [N m].
    is_follower
        True: components in the axes of the (deformed) marker; False: ground axes.
    amplitude
        Function of time that multiplies both; None: one.
    """

    name: str
    marker: Marker
    force: GivenArray = given(np.zeros(3))
    torque: GivenArray = given(np.zeros(3))
    is_follower: bool = False
    amplitude: TimeFunction | None = None

    def __post_init__(self) -> None:
        if not isinstance(self.amplitude, TimeFunction | None):
            raise ModelError(
                f"force {self.name!r}: amplitude: expected a function of floatframe.functions, got {self.amplitude!r}"
            )
        for name in ("force", "torque"):
            value = array_of_shape(f"force {self.name!r}: {name}", getattr(self, name), (3,))
            object.__setattr__(self, name, value)
