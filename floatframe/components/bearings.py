"""A bearing described by coefficients: radial with cross coupling, axial, tilting; the shaft spins freely.

d is the vector from marker a (housing) to marker b (shaft) and d' its rate, both in the axes of a. e is the axis of the
bearing and s that of the shaft; w is the angular velocity of b relative to a. The following loads act on the shaft at
marker b:

    across e:   F = -K (d_x, d_y) - D (d_x', d_y')           K, D (2, 2), such as those of an oil film or a seal
    along e:    F = -k_a d_z - d_a d_z'
    moment:     M = -k_t e x s - d_t s x (w x s)             e x s = (-s_y, s_x, 0)

None of these loads has a moment about the axis of the shaft. The axes are those of the housing, because a damper in
axes that rotate with the rotor would drive it. The skew-symmetric part of K has no energy; its power, which may drive
the shaft, is counted as loss.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numba import njit
from numba.extending import register_jitable

from fe_models.foundation.arrays import Array
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.checked_values import array_of_shape, number, unit_vector
from floatframe.model.elements import Element, ElementLaw, Placed
from floatframe.model.elements.pairs import axial_motion, direction_of, inner_product, vector_product
from floatframe.model.elements.unit_names import outputs_in

__all__ = ["Bearing"]

ELEMENTS = {"bearing": "floatframe.components.bearings:Bearing"}

OUTPUTS = {
    "x": "m", "y": "m", "axial": "m", "tilt x": "rad", "tilt y": "rad", "force x": "N", "force y": "N",
    "axial force": "N", "energy": "J", "power lost": "W",
}  # fmt: skip
LEAST_COSINE = 0.5  #: smallest cosine between both axes when assembled; a smaller one indicates a wrong marker axis


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class Bearing(Element):
    """A shaft at marker b in a bearing at marker a, described by coefficients in axes of a; the shaft spins freely.

    Outputs: the displacement of marker b from marker a across the axis (x, y) and along it; the tilt of the shaft about
    x and y; the forces on the shaft; energy and power lost. All are zero where the points and the axes coincide.

    Raises
    ------
    ModelError
        If a number is out of its range, all coefficients are zero, or both axes are far apart as assembled.
    """

    name: str
    marker_a: Marker
    marker_b: Marker
    stiffness: Array  #: radial stiffness K: [[k_xx, k_xy], [k_yx, k_yy]], its diagonal, or one number [N/m]
    damping: Array = 0.0  # type: ignore[assignment]  #: D, likewise [N s/m]
    axial_stiffness: float = 0.0  #: axial stiffness k_a [N/m]
    axial_damping: float = 0.0  #: axial damping d_a [N s/m]
    tilt_stiffness: float = 0.0  #: tilting stiffness k_t [N m/rad]
    tilt_damping: float = 0.0  #: tilting damping d_t [N m s/rad]
    axis: Array = (0.0, 0.0, 1.0)  # type: ignore[assignment]  #: e, in the axes of marker a, (3,)
    #: direction of x in the axes of marker a, (3,); None: the axis of a that follows the axis closest to `axis` in
    #: cyclic order: x after z
    x_axis: Array | None = None
    shaft_axis: Array | None = None  #: direction s of the shaft in axes of marker b, (3,); None: equal to `axis`

    def __post_init__(self) -> None:
        where = f"element {self.name!r}"
        for key in ("stiffness", "damping"):
            object.__setattr__(self, key, two_by_two(f"{where}: {key}", getattr(self, key)))
        for key in ("axial_stiffness", "axial_damping", "tilt_stiffness", "tilt_damping"):
            object.__setattr__(self, key, number(f"{where}: {key}", getattr(self, key), at_least=0.0))
        object.__setattr__(self, "axis", unit_vector(f"{where}: axis", self.axis))
        following = np.eye(3)[(int(np.argmax(np.abs(self.axis))) + 1) % 3]
        x_axis = following if self.x_axis is None else unit_vector(f"{where}: x_axis", self.x_axis)
        across = x_axis - (x_axis @ self.axis) * self.axis
        if np.linalg.norm(across) < 1e-6:
            raise ModelError(
                f"{where}: x_axis: expected a direction that is not parallel to the axis, got a parallel one"
            )
        object.__setattr__(self, "x_axis", across / np.linalg.norm(across))
        shaft = self.axis if self.shaft_axis is None else unit_vector(f"{where}: shaft_axis", self.shaft_axis)
        object.__setattr__(self, "shaft_axis", shaft)
        if not any(np.any(each) for each in self.coefficients):
            raise ModelError(f"{where}: expected stiffness or damping other than zero, got none")

    @property
    def coefficients(self) -> list[float]:
        """K and D row by row, followed by the axial and tilting coefficients."""
        return [*np.ravel(self.stiffness), *np.ravel(self.damping), self.axial_stiffness, self.axial_damping,
                self.tilt_stiffness, self.tilt_damping]  # fmt: skip

    @property
    def resists_tilt(self) -> bool:
        """Whether a tilt of the shaft gives a moment."""
        return self.tilt_stiffness > 0.0 or self.tilt_damping > 0.0

    def small_angles(self) -> Callable[[Array], Array] | None:
        """Return the relative difference between the tilt and its sine, on which the moment depends."""
        return self.tilt_beyond_sine if self.resists_tilt else None

    def tilt_beyond_sine(self, A: Array) -> Array:
        """Return 1 - sin(tilt)/tilt of the shaft, (n_t,), from the axes of both markers, (n_t, 2, 3, 3)."""
        e, s = A[:, 0] @ self.axis, A[:, 1] @ np.asarray(self.shaft_axis)
        sine = np.linalg.norm(np.cross(e, s), axis=1)
        tilt = np.arctan2(sine, np.sum(e * s, axis=1))
        return np.asarray((1.0 - sine / np.where(tilt > 0.0, tilt, 1.0)) * (tilt > 0.0))

    def law(self, placed: Placed) -> ElementLaw:
        """Return the law of the bearing."""
        assert self.x_axis is not None
        assert self.shaft_axis is not None
        cosine = float((placed.A[0] @ self.axis) @ (placed.A[1] @ self.shaft_axis))
        if cosine < LEAST_COSINE:
            raise ModelError(
                f"element {self.name!r}: expected an angle of at most "
                f"{np.degrees(np.arccos(LEAST_COSINE)):.3g}° between shaft and bearing at assembly, got "
                f"{np.degrees(np.arccos(max(cosine, -1.0))):.3g}°; give the components of axis in "
                "marker_a, and the components of shaft_axis in marker_b"
            )
        y_axis = np.cross(self.axis, self.x_axis)
        return ElementLaw(
            function=bearing_law,
            data=[*self.coefficients, *self.x_axis, *y_axis, *self.axis, *self.shaft_axis],
            **outputs_in(placed.units, OUTPUTS),
            tangent="complex",
            acts=("wrench", "wrench" if self.resists_tilt else "force"),
            is_opposite=True,
            energy="energy",
            power_lost="power lost",
        )


def two_by_two(where: str, values: Array) -> Array:
    """Return a (2, 2) matrix from the complete matrix, its diagonal, or one number for both diagonal entries."""
    if np.ndim(values) == 0:
        values = np.full(2, number(where, values))
    if np.ndim(values) == 1:
        values = np.diag(array_of_shape(where, values, (2,)))
    return array_of_shape(where, values, (2, 2))


AXIAL, TILT, DIRECTIONS = 8, 10, 12  #: indices in `data`


@njit
def bearing_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the radial and axial forces, the tilting moment, and the outputs."""
    e_x, e_y = direction_of(x, 0, data, DIRECTIONS), direction_of(x, 0, data, DIRECTIONS + 3)
    e, s = direction_of(x, 0, data, DIRECTIONS + 6), direction_of(x, 1, data, DIRECTIONS + 9)
    d_x, rate_x = axial_motion(x, 0, 1, e_x)
    d_y, rate_y = axial_motion(x, 0, 1, e_y)
    d_z, rate_z = axial_motion(x, 0, 1, e)
    F_x = -data[0] * d_x - data[1] * d_y - data[4] * rate_x - data[5] * rate_y
    F_y = -data[2] * d_x - data[3] * d_y - data[6] * rate_x - data[7] * rate_y
    F_z = -data[AXIAL] * d_z - data[AXIAL + 1] * rate_z
    tilt, w = vector_product(e, s), (x[1, 15] - x[0, 15], x[1, 16] - x[0, 16], x[1, 17] - x[0, 17])
    s_rate = vector_product(w, s)
    swing = vector_product(s, s_rate)
    F = combined(F_x, e_x, F_y, e_y, F_z, e)
    arm = vector_product((x[1, 0] - x[0, 0], x[1, 1] - x[0, 1], x[1, 2] - x[0, 2]), F)
    for k in range(3):
        M = -data[TILT] * tilt[k] - data[TILT + 1] * swing[k]
        wrench[1, k] = F[k]
        wrench[0, k] = -F[k]
        wrench[1, 3 + k] = M
        wrench[0, 3 + k] = -M - arm[k]
    outputs[0], outputs[1], outputs[2] = d_x, d_y, d_z
    outputs[3], outputs[4] = inner_product(tilt, e_x), inner_product(tilt, e_y)
    outputs[5], outputs[6], outputs[7] = F_x, F_y, F_z
    mean = 0.5 * (data[1] + data[2])
    turned = inner_product(tilt, tilt) / (1.0 + inner_product(e, s))  # 1 - e · s without cancellation
    outputs[8] = 0.5 * (data[0] * d_x * d_x + data[3] * d_y * d_y + data[AXIAL] * d_z * d_z) + mean * d_x * d_y
    outputs[8] += data[TILT] * turned
    spring_x, spring_y = data[0] * d_x + mean * d_y, mean * d_x + data[3] * d_y
    outputs[9] = -(F_x + spring_x) * rate_x - (F_y + spring_y) * rate_y + data[AXIAL + 1] * rate_z * rate_z
    outputs[9] += data[TILT + 1] * inner_product(s_rate, s_rate)


@register_jitable
def combined(a, e_a, b, e_b, c, e_c):
    """Return a e_a + b e_b + c e_c."""
    return (
        a * e_a[0] + b * e_b[0] + c * e_c[0],
        a * e_a[1] + b * e_b[1] + c * e_c[1],
        a * e_a[2] + b * e_b[2] + c * e_c[2],
    )
