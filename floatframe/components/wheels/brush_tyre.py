"""The brush tyre, with bristles, parabolic pressure and friction."""

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

__all__ = ["BrushTyre", "brush_law", "brush_law_at_rest"]


# brush law ------------------------------------------------------------------------------------------------------------
# The brush tyre model: bristles stick until the parabolic pressure times the friction coefficient is exceeded.


SLIP_STIFFNESS, HALF_LENGTH, LOAD, FRICTION, FLATTENING, RESISTANCE = range(COMMON, COMMON + 6)


@njit(error_model="numpy")
def brush_law(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write wrenches, rates and outputs of a brush tyre.

    The contact length is 2a, a = a_0 sqrt(F_z/F_0), with the pressure q(s) = 3 F_z/(4a) (1 - s²/a²). Bristles of
    stiffness c_p, equal along and across, enter undeformed. They are bent by slip at the rate of the theoretical slip

        sigma_x = -V_sx/|V_r|, sigma_y = V_sy/|V_r|,   V_r = R_e Omega,

    as the tread does with V_r as transport speed. With C = 2 c_p a² = C_0 F_z/F_0, the whole contact slides beyond
    sigma_s = 3 mu F_z/C. With r = |sigma|/sigma_s:

    (1) |F| = mu F_z (3 r - 3 r² + r³) for r < 1, mu F_z beyond, along (sigma_x, -sigma_y)
    (2) pneumatic trail t = (a/3) (1 - r)³/(1 - r + r²/3), zero beyond; M_z = -t F_y
    (3) M_y as for the linear tyre
    """
    x_W, y_W, n, _, point, d, rho, sine, cosine, V_x, V_y, Omega, rate, left = contact(x, data)
    is_down = d.real > 0.0
    landed = touching(data, d)
    zero = 0.0 * d
    F_z = normal_force(data, d, landed, rate, cosine, data[STIFFNESS] * d)
    R_e = data[RADIUS] - data[FLATTENING] * d if is_down else data[RADIUS] + zero
    V_r = R_e * Omega
    V_sx = V_x - V_r
    mu = data[FRICTION] * grip_at(x, data, point)
    limit = mu * F_z
    sliding = 3.0 * mu * data[LOAD] / data[SLIP_STIFFNESS]  # sigma_s, the same at all loads
    length = data[SIGMA_X] + zero, data[SIGMA_Y] + zero
    sigma_x, sigma_y = tread_slip(data, length, (sliding + zero, sliding + zero), z, z_dot, V_r, V_sx, V_y, landed)
    F_x, F_y, M_z = zero, zero, zero
    if is_down:
        a = data[HALF_LENGTH] * np.sqrt(F_z / data[LOAD] + 1e-12)
        r = np.sqrt(sigma_x * sigma_x + sigma_y * sigma_y + 1e-24) / sliding
        if r.real < 1.0:  # (1)
            over = limit * (3.0 - 3.0 * r + r * r) / sliding
            trail = a / 3.0 * (1.0 - r) * (1.0 - r) * (1.0 - r) / (1.0 - r + r * r / 3.0)  # (2)
        else:
            over = limit / (r * sliding)
            trail = zero
        F_x, F_y = over * sigma_x, -over * sigma_y
        M_z = -trail * F_y
    turning = direction(V_r, data[LOW_SPEED])  # (3)
    F = F_x, F_y, F_z
    M = zero, -data[RESISTANCE] * data[RADIUS] * F_z * turning - (R_e - rho) * F_x, M_z * turning
    power = put_wrenches(x, wrench, (x_W, y_W, n, point), F, M)
    energy, rising = zero, zero
    if is_down:
        energy, rising = 0.5 * data[STIFFNESS] * d * d, data[STIFFNESS] * d * rate
    show(outputs, F, M, (sigma_x, sigma_y, sine), (d, rho), (V_x, V_sx, V_y), point)
    show_energy(outputs, energy, -power - rising, left, zero)


@njit(error_model="numpy")
def brush_law_at_rest(t, x, z, lam, data, wrench, z_dot, g, outputs):
    """Write the results for a standing wheel, whose tread is deformed by the displacement of the wheel."""
    brush_law(t, x, z, lam, data, wrench, z_dot, g, outputs)
    hold_tread(x, data, outputs[10], z, z_dot)


# brush tyre -----------------------------------------------------------------------------------------------------------


@frozen_copies
@dataclass(frozen=True, eq=False)
@checked_fields(ModelError)
class BrushTyre(SimpleTyre):
    """A brush tyre, defined by slip stiffness, contact length and friction; it includes combined slip.

    The contact length is proportional to the square root of the load. The slip stiffness therefore increases with the
    load, and sliding begins at the same slip. The outputs kappa and alpha are theoretical slips, relative to the
    rolling speed.
    """

    name: str
    marker_a: Marker  #: marker on the road: z up, x along the road
    marker_b: Marker  #: marker at the wheel centre, on the spinning body
    radius: float  #: unloaded radius R_0 [m]
    stiffness: float  #: vertical stiffness k [N/m]
    nominal_load: float  #: load F_0 to which the parameters below refer [N]
    slip_stiffness: float  #: slip stiffness C_0 = 2 c_p a_0² for small slip, both along and across [N]
    contact_length: float  #: contact length 2 a_0 [m]
    friction: float = 1.0  #: coefficient of friction mu
    damping: float = 0.0  #: vertical damping c [N s/m]
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
        positive = ("nominal_load", "slip_stiffness", "contact_length", "friction")
        check_common(self, positive, ("rolling_resistance", "flattening"))

    def law(self, placed: Placed) -> ElementLaw:
        """Return the element law for the markers in the assembled position."""
        own = [self.slip_stiffness, 0.5 * self.contact_length, self.nominal_load, self.friction]
        own += [self.flattening, self.rolling_resistance]
        data = tyre_numbers(f"element {self.name!r}", placed, common_numbers(self), self.axis, own, self.road)
        return tyre_law(brush_law, brush_law_at_rest, data, placed, (self.relaxation_x, self.relaxation_y))
