"""The bushing: six stiffnesses and dampers, coupled as wanted, between two markers."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fe_models.foundation.arrays import Array
from fe_models.foundation.copies import frozen_copies
from floatframe.bodies.markers import Place
from floatframe.checked_values import array_of_shape
from floatframe.errors import ModelError
from floatframe.functions.time_functions import NOT_OF_TIME, TimeFunction

__all__ = ["AXES", "DEFORMATIONS", "Bushing"]

DEFORMATIONS = ("x", "y", "z", "rx", "ry", "rz")  #: in the order of the rows of the matrices
AXES = {"a": 0.0, "b": 1.0, "half way": 0.5}  #: by name, the share of the rotation of B against A that they make


@frozen_copies
@dataclass(frozen=True, eq=False)
class Bushing:
    """Force and torque K xi + D xi_dot + preload + tables(xi) between two markers; derived from a potential.

    The deformation xi: distance of the points (3) and rotation vector (3) of marker B against A, in the axes of one of
    them. Those of the part that does not spin are right for a bearing: a damper in axes that turn with a rotor drives
    it. Without damping the energy is kept, also far from small rotations. The deformation is zero where the markers
    coincide. A rotation about one axis is counted beyond half a turn and goes on through full turns; where B also
    tilts, the rotation vector means little near a full turn.

    Half way between the axes of A and B both play the same part, as in a beam or a sleeve of rubber between two bodies
    that turn alike. There the rotation must stay below half a turn, and between the ground and a body that spins the
    axes turn at half of its speed.

    A body given in place of a marker is held where, and as, the other marker is placed: zero deformation as placed.
    """

    name: str
    marker_a: Place
    marker_b: Place
    stiffness: Array = field(default_factory=lambda: np.zeros((6, 6)))  #: K, symmetric, (6, 6), or its diagonal (6,)
    damping: Array = field(default_factory=lambda: np.zeros((6, 6)))  #: D, (6, 6), or its diagonal (6,)
    preload: Array = field(default_factory=lambda: np.zeros(6))  #: force and torque on A at zero deformation, (6,)
    #: functions of one deformation ("x", ..., "rz"), such as tables, whose values are added [N, N m]
    characteristics: Mapping[str, TimeFunction] = field(default_factory=dict, metadata=NOT_OF_TIME)
    axes: str = "a"  #: in which it acts: those of marker "a", of marker "b", or "half way" between them

    def __post_init__(self) -> None:
        where = f"force {self.name!r}"
        if self.axes not in AXES:
            raise ModelError(f"{where}: axes: expected one of {', '.join(AXES)}, got {self.axes!r}")
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

    @property
    def counts_turns(self) -> bool:
        """Whether rotations beyond half a turn make a difference to it, and are counted."""
        of_rotations = [self.stiffness[3:], self.damping[3:], self.damping[:, 3:], self.preload[3:]]
        is_turned = any(part.any() for part in of_rotations) or any(key.startswith("r") for key in self.characteristics)
        return is_turned and self.axes != "half way"


def six_by_six(where: str, values: Array) -> Array:
    """Return a matrix, (6, 6), given whole or by its diagonal."""
    if np.shape(values) == (6,):
        values = np.diag(array_of_shape(where, values, (6,)))
    return array_of_shape(where, values, (6, 6))
