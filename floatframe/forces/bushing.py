"""The bushing: six stiffnesses and dampers, coupled as wanted, between two markers."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.bodies.markers import Place
from floatframe.checked_values import array_of_shape
from floatframe.errors import ModelError
from floatframe.functions.time_functions import TimeFunction

__all__ = ["DEFORMATIONS", "Bushing"]

DEFORMATIONS = ("x", "y", "z", "rx", "ry", "rz")  #: in the order of the rows of the matrices


@frozen_copies
@dataclass(frozen=True, eq=False)
class Bushing:
    """Force and torque K xi + D xi_dot + preload + tables(xi) between two markers; derived from a potential.

    The deformation xi: distance of the points (3) and rotation vector (3) of marker B against A, in the axes half way
    between the two, so that A and B play the same part. Without damping the energy is kept, also far from small
    rotations; the rotation must stay below half a turn. The deformation is zero where the markers coincide.

    A body given in place of a marker is held where, and as, the other marker is placed: zero deformation as placed.
    """

    name: str
    marker_a: Place
    marker_b: Place
    stiffness: Array = field(default_factory=lambda: np.zeros((6, 6)))  #: K, symmetric, (6, 6), or its diagonal (6,)
    damping: Array = field(default_factory=lambda: np.zeros((6, 6)))  #: D, (6, 6), or its diagonal (6,)
    preload: Array = field(default_factory=lambda: np.zeros(6))  #: force and torque on A at zero deformation, (6,)
    #: functions of one deformation ("x", ..., "rz"), such as tables, whose values are added [N, N m]
    characteristics: Mapping[str, TimeFunction] = field(default_factory=dict)

    def __post_init__(self) -> None:
        where = f"force {self.name!r}"
        for name in ("stiffness", "damping"):
            object.__setattr__(self, name, six_by_six(f"{where}: {name}", getattr(self, name)))
        object.__setattr__(self, "preload", array_of_shape(f"{where}: preload", self.preload, (6,)))
        defect = np.abs(self.stiffness - self.stiffness.T).max()
        if defect > 1e-9 * np.abs(self.stiffness).max():
            raise ModelError(
                f"{where}: stiffness: expected a symmetric matrix, which has an energy, got one with a defect of "
                f"{defect:.3g}"
            )
        low = float(np.linalg.eigvalsh(0.5 * (self.damping + self.damping.T))[0])
        if low < -1e-9 * max(np.abs(self.damping).max(), 1e-300):
            raise ModelError(f"{where}: damping: expected no negative eigenvalue, got {low:.3g}; it would give energy")
        for name, function in self.characteristics.items():
            if name not in DEFORMATIONS:
                raise ModelError(
                    f"{where}: characteristics: no deformation {name!r}; choices: {', '.join(DEFORMATIONS)}"
                )
            if not isinstance(function, TimeFunction):
                raise ModelError(
                    f"{where}: characteristics: {name}: expected a function of functions.time_functions, such as "
                    f"table(x, force), got {function!r}"
                )
        if not (self.stiffness.any() or self.damping.any() or self.preload.any() or self.characteristics):
            raise ModelError(f"{where}: expected stiffness, damping or preload other than zero, got none")


def six_by_six(where: str, values: Array) -> Array:
    """Return a matrix, (6, 6), given whole or by its diagonal."""
    if np.shape(values) == (6,):
        values = np.diag(array_of_shape(where, values, (6,)))
    return array_of_shape(where, values, (6, 6))
