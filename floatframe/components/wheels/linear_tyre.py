"""The linear tyre, whose forces are proportional to slip."""

from dataclasses import dataclass, field

import numpy as np
from numba import njit

from fe_models.foundation.arrays import GivenArray, given
from fe_models.foundation.records import checked_fields, frozen_copies
from floatframe.components.wheels.contact import (
    COMMON,
    LOW_SPEED,
    RADIUS,
    SIGMA_X,
    SIGMA_Y,
    STIFFNESS,
    contact,
    grip_at,
    normal_force,
    put_wrenches,
    touching,
)
from floatframe.components.wheels.numbers import tyre_law, tyre_numbers
from floatframe.components.wheels.outputs import show, show_energy
from floatframe.components.wheels.roads.road import FlatRoad, Road
from floatframe.components.wheels.slip import direction, hold_tread, tread_slip
from floatframe.components.wheels.tyre_fields import (
    DEFAULT_LOW_SPEED,
    SETTLING_TIME,
    SimpleTyre,
    check_common,
    common_numbers,
)
from floatframe.errors import ModelError
from floatframe.model.bodies.markers import Marker
from floatframe.model.elements import ElementLaw, Placed

__all__ = ["LinearTyre", "linear_law", "linear_law_at_rest"]


# the law of the linear tyre: forces proportional to slip, limited by friction -----------------------------------------


C_X, C_Y, C_GAMMA, TRAIL, FRICTION, FLATTENING, RESISTANCE = range(COMMON, COMMON + 7)


@njit(error_model="numpy")
def linear_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write wrenches, rates and outputs of a linear tyre.

    (1) contact; normal force F_z from k d; V_sx = V_x - R_e Omega, R_e = R_0 - q d
    (2) slips kappa, tan alpha of the tread
    (3) F_x = C_x kappa and F_y = -C_y tan alpha - C_gamma sin gamma, both scaled so that |F| <= mu F_z; mu is
        multiplied by the friction factor of the road
    (4) M_z = t C_y tan alpha, scaled alike; M_y = -f_r R_0 F_z sgn Omega - (R_e - rho) F_x: the lever arm of F_x is
        R_e, so that F_x dissipates exactly F_x V_sx
    """
    x_W, y_W, n, _, point, d, rho, sine, cosine, V_x, V_y, Omega, rate, left = contact(x, data)  # (1)
    is_down = d.real > 0.0
    landed = touching(data, d)
    zero = 0.0 * d
    F_z = normal_force(data, d, landed, rate, cosine, data[STIFFNESS] * d)
    R_e = data[RADIUS] - data[FLATTENING] * d if is_down else data[RADIUS] + zero
    V_sx = V_x - R_e * Omega
    limit = data[FRICTION] * grip_at(x, data, point) * F_z
    sigma = data[SIGMA_X] + zero, data[SIGMA_Y] + zero  # (2)
    scale = limit / data[C_X], limit / data[C_Y]
    kappa, tangent = tread_slip(data, sigma, scale, z, z_dot, V_x, V_sx, V_y, landed)
    F_x, F_y, arm = zero, zero, zero  # (3)
    if is_down:
        F_x, F_y = data[C_X] * kappa, -data[C_Y] * tangent - data[C_GAMMA] * sine
        arm = data[TRAIL] * data[C_Y] * tangent
    square = F_x * F_x + F_y * F_y
    if square.real > (limit * limit).real:
        share = limit / np.sqrt(square)
        F_x, F_y, arm = share * F_x, share * F_y, share * arm
    turning = direction(data[RADIUS] * Omega, data[LOW_SPEED])  # (4)
    F = F_x, F_y, F_z
    M = zero, -data[RESISTANCE] * data[RADIUS] * F_z * turning - (R_e - rho) * F_x, arm
    power = put_wrenches(x, wrench, (x_W, y_W, n, point), F, M)
    energy, rising = zero, zero
    if is_down:
        energy, rising = 0.5 * data[STIFFNESS] * d * d, data[STIFFNESS] * d * rate
    k = 0
    if data[SIGMA_X] > 0.0:
        energy += 0.5 * data[C_X] / data[SIGMA_X] * z[0] * z[0]
        rising += data[C_X] / data[SIGMA_X] * z[0] * z_dot[0]
        k = 1
    if data[SIGMA_Y] > 0.0:
        energy += 0.5 * data[C_Y] / data[SIGMA_Y] * z[k] * z[k]
        rising += data[C_Y] / data[SIGMA_Y] * z[k] * z_dot[k]
    show(outputs, F, M, (kappa, tangent, sine), (d, rho), (V_x, V_sx, V_y), point)
    show_energy(outputs, energy, -power - rising, left, zero)


@njit(error_model="numpy")
def linear_law_at_rest(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the results for a standing wheel, whose tread is deformed by the displacement of the wheel."""
    linear_law(t, x, z, lam, data, wrench, z_dot, g, outputs)
    hold_tread(x, data, outputs[10], z, z_dot)


# linear tyre ----------------------------------------------------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class LinearTyre(SimpleTyre):
    """A tyre with forces proportional to slip, limited by friction, as in linear vehicle dynamics.

    Marker A lies on the road, with z up. Marker B is at the wheel centre, on the spinning body. All lengths, forces and
    speeds are in units of the system. Axes, slips and outputs: docs/wheels.md.
    """

    name: str
    marker_a: Marker  #: marker on the road: z up, x along the road
    marker_b: Marker  #: marker at the wheel centre, on the spinning body
    radius: float  #: unloaded radius R_0 [m]
    stiffness: float  #: vertical stiffness k [N/m]
    slip_stiffness: float  #: longitudinal slip stiffness C_x = dF_x/dkappa [N]
    cornering_stiffness: float  #: cornering stiffness C_y = -dF_y/dalpha [N/rad]
    damping: float = 0.0  #: vertical damping c [N s/m]
    camber_stiffness: float = 0.0  #: camber stiffness C_gamma = -dF_y/dsin(gamma) [N]
    trail: float = 0.0  #: pneumatic trail t, M_z = t C_y tan(alpha) [m]
    friction: float = 1.0  #: coefficient of friction mu, |(F_x, F_y)| <= mu F_z
    #: relaxation length along x [m]; 0: no relaxation, so that the wheel creeps at a standstill
    relaxation_x: float = 0.0
    relaxation_y: float = 0.0  #: relaxation length along y [m]
    rolling_resistance: float = 0.0  #: factor f_r of rolling resistance, M_y = -f_r R_0 F_z
    flattening: float = 1 / 3  #: factor q in the effective rolling radius R_0 - q d
    low_speed: float = DEFAULT_LOW_SPEED  #: speed below which the wheel is treated as nearly standing [m/s]
    settling_time: float = SETTLING_TIME  #: settling time tau of the damped tread at a standstill [s]
    landing_depth: float | None = None  #: deflection over which damping and tread forces build up [m]; None: radius/500
    #: spin axis, pointing left, in axes of marker B
    axis: GivenArray = given((0.0, 1.0, 0.0))
    road: Road = field(default_factory=FlatRoad)  #: road in axes of marker A

    def __post_init__(self) -> None:
        positive = ("slip_stiffness", "cornering_stiffness", "friction")
        check_common(self, positive, ("trail", "rolling_resistance", "flattening"), ("camber_stiffness",))

    def law(self, placed: Placed) -> ElementLaw:
        """Return the element law for the markers in the assembled position."""
        own = [self.slip_stiffness, self.cornering_stiffness, self.camber_stiffness, self.trail, self.friction]
        own += [self.flattening, self.rolling_resistance]
        data = tyre_numbers(f"element {self.name!r}", placed, common_numbers(self), self.axis, own, self.road)
        return tyre_law(linear_law, linear_law_at_rest, data, placed, (self.relaxation_x, self.relaxation_y))
