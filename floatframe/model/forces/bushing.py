"""The bushing: a stiffness and a damping matrix for six deformations between two markers.

Evaluated in `floatframe.engine.kernels.connections.bushing`.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from fe_models.foundation.arrays import Array, GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Place
from floatframe.model.checked_values import array_of_shape
from floatframe.model.functions.time_functions import NOT_OF_TIME, TimeFunction

__all__ = ["AXES", "DEFORMATIONS", "Bushing"]

DEFORMATIONS = ("x", "y", "z", "rx", "ry", "rz")  #: deformations in the order of rows in the matrices
#: fraction of the relative rotation that each choice of axes includes
AXES = {"a": 0.0, "b": 1.0, "half way": 0.5}


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Bushing:
    """Force and torque K xi + D xi_dot + preload + tables(xi) between two markers, derived from a potential.

    The deformation xi consists of the distance between the points (3) and the rotation vector (3) of marker B relative
    to A, in the axes of one of them. For a bearing, use the axes of the part that does not spin: a damper in axes that
    rotate with a rotor drives it. Without damping, energy is conserved, also for large rotations. The deformation is
    zero where the markers coincide. A rotation about one axis is counted beyond half a turn and through full turns. If
    B also tilts, the rotation vector has little meaning near a full turn.

    With axes half way between A and B, the law is symmetric in both markers, as for a beam or a rubber sleeve between
    two bodies with similar rotation. The rotation must then stay below half a turn. Between the ground and a spinning
    body, these axes rotate at half the speed.

    A body given instead of a marker is attached at the position of the other marker, with zero deformation as
    assembled.

    Parameters
    ----------
    name
        Name of the force, unique in the system.
    marker_a, marker_b
        The two markers; a body, or its name, is attached where the other marker is.
    stiffness
        Stiffness K, symmetric, (6, 6) [N/m, N, N m], or its diagonal (6,).
    damping
        Damping D, (6, 6) [N s/m, N s, N m s], or its diagonal (6,).
    preload
        Force and torque on A at zero deformation, (6,) [N, N m].
    characteristics
        Functions of one deformation ("x", ..., "rz"), such as tables, whose values are added [N, N m].
    axes
        Axes in which it acts: those of marker "a" or marker "b", or "half way" between them.
    """

    name: str
    marker_a: Place
    marker_b: Place
    stiffness: GivenArray = given(np.zeros((6, 6)))
    damping: GivenArray = given(np.zeros((6, 6)))
    preload: GivenArray = given(np.zeros(6))
    characteristics: Mapping[str, TimeFunction] = field(default_factory=dict, metadata=NOT_OF_TIME)
    axes: Literal["a", "b", "half way"] = "a"

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
            raise ModelError(
                f"{where}: damping: expected no negative eigenvalue, got {low:.3g}; the bushing would generate energy"
            )
        for name, function in self.characteristics.items():
            if name not in DEFORMATIONS:
                raise ModelError(
                    f"{where}: characteristics: no deformation {name!r}; choices: {', '.join(DEFORMATIONS)}"
                )
            if not isinstance(function, TimeFunction):
                raise ModelError(
                    f"{where}: characteristics: {name}: expected a function of floatframe.functions, such as "
                    f"table(x, force), got {function!r}"
                )
        if not (self.stiffness.any() or self.damping.any() or self.preload.any() or self.characteristics):
            raise ModelError(f"{where}: expected stiffness, damping or preload other than zero, got none")

    @property
    def has_angles(self) -> bool:
        """Whether rotations have an effect on the bushing."""
        of_rotations = [self.stiffness[3:], self.damping[3:], self.damping[:, 3:], self.preload[3:]]
        return any(part.any() for part in of_rotations) or any(key.startswith("r") for key in self.characteristics)

    @property
    def counts_turns(self) -> bool:
        """Whether rotations beyond half a turn have an effect and are counted."""
        return self.has_angles and self.axes != "half way"


def six_by_six(where: str, values: Array) -> Array:
    """Return a (6, 6) matrix from a complete matrix or from its diagonal."""
    if np.shape(values) == (6,):
        values = np.diag(array_of_shape(where, values, (6,)))
    if np.shape(values) != (6, 6):
        raise ModelError(f"{where}: expected six numbers, or six rows of six numbers, got shape {np.shape(values)}")
    return array_of_shape(where, values, (6, 6))
