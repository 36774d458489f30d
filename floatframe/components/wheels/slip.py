"""Slip of a rolling tyre, with relaxation and at a standstill.

The tread is modelled as a string. The ground moves it with the slip velocity V_s, and rolling relaxes it over the
relaxation length sigma, at the transport speed V = |V_x|:

    u_dot = -V_sx - (V/sigma_x + L) u        kappa'     = (u + tau u_dot) / sigma_x      steady: kappa = -V_sx/V
    v_dot =  V_sy - (V/sigma_y + L) v        tan alpha' = (v + tau v_dot) / sigma_y      steady: tan alpha = V_sy/V

At a standstill V = 0, and the tread is a spring, which holds without creep. Near a standstill two terms are added,
which vanish towards the low speed: a settling time tau, which is the damping of this spring, and a loss L, without
which the tread of a tyre that slides at V = 0 would stretch without limit. L begins at the slip at which the tyre
slides, s = 1, and limits s to 2: L = w(s - 1) s_dot / 2 with s = |(u/(sigma_x kappa_s), v/(sigma_y alpha_s))|, and
s_dot is the same expression with the slip velocity.
"""

import numpy as np
from numba.extending import register_jitable

from floatframe.components.wheels.contact import LOW_SPEED, RADIUS, SETTLING, SIGMA_X, SIGMA_Y, moved
from floatframe.model.elements.smooth import absolute, square

__all__ = ["direction", "hold_tread", "tread_slip"]

LEAST_SLIP = 1e-4  #: smallest slip at which a tyre slides, which keeps the power loss of a lightly loaded tyre finite
AIR = 20.0  #: factor in the rate (V + AIR V_low)/sigma at which a lifted tread relaxes


@register_jitable(error_model="numpy")
def direction(V, low):
    """Return the direction of a speed: -1 or 1 beyond the low speed, q (3 - q²)/2 with q = V/low within it."""
    q = V / low
    if q.real >= 1.0:
        return 1.0 + 0.0 * q
    if q.real <= -1.0:
        return -1.0 + 0.0 * q
    return 0.5 * q * (3.0 - q * q)


@register_jitable(error_model="numpy")
def tread_slip(data, sigma, scale, z, z_dot, transport, V_sx, V_sy, landed):
    """Return kappa' and tan alpha' of the tread; write the rates of its states.

    Parameters
    ----------
    data
        Parameters of the tyre: low speed, settling time, and whether it has relaxation lengths.
    sigma
        Relaxation lengths along x and y at the present load [m].
    scale
        Slips kappa_s and alpha_s at which the tyre slides.
    z, z_dot
        States u and v of the directions that relax [m], and their rates.
    transport
        Transport speed V, with its sign [m/s].
    V_sx, V_sy
        Slip velocity relative to the road [m/s].
    landed
        Landing factor, from 0 in the air to 1 on the road.

    Returns
    -------
    kappa, tan_alpha
    """
    V_low, tau = data[LOW_SPEED], data[SETTLING]
    V = absolute(transport)
    if V.real >= V_low:
        fade = 0.0 * V
        rolling = V
    else:
        q = V / V_low
        fade = (1.0 - q * q) * (1.0 - q * q)
        rolling = 0.5 * (V * q + V_low)  # for directions without relaxation: V, smooth at zero
    has_x, has_y = data[SIGMA_X] > 0.0, data[SIGMA_Y] > 0.0
    kappa, tan_alpha = -V_sx / rolling, V_sy / rolling
    k = 0
    u = z[0] if has_x else 0.0 * V
    if has_x:
        k = 1
    v = z[k] if has_y else 0.0 * V
    loss = 0.0 * V
    if fade.real > 0.0:
        p_x = (
            1.0 / (sigma[0] * (scale[0] if scale[0].real > LEAST_SLIP else LEAST_SLIP + 0.0 * V)) if has_x else 0.0 * V
        )
        p_y = (
            1.0 / (sigma[1] * (scale[1] if scale[1].real > LEAST_SLIP else LEAST_SLIP + 0.0 * V)) if has_y else 0.0 * V
        )
        s_2 = square(p_x * u) + square(p_y * v)
        if s_2.real > 1.0:
            s = np.sqrt(s_2)
            w = s - 1.0 if s.real < 2.0 else 1.0 + 0.0 * s
            w = w * w * (3.0 - 2.0 * w)
            s_dot = np.sqrt(square(p_x * V_sx) + square(p_y * V_sy) + 1e-18)
            loss = 0.5 * fade * w * s_dot
    air = (1.0 - landed) * AIR * V_low
    if has_x:
        rate = -landed * V_sx - (V / sigma[0] + loss) * u
        kappa = (u + tau * fade * rate) / sigma[0]
        z_dot[0] = rate - air / sigma[0] * u
    if has_y:
        rate = landed * V_sy - (V / sigma[1] + loss) * v
        tan_alpha = (v + tau * fade * rate) / sigma[1]
        z_dot[k] = rate - air / sigma[1] * v
    return kappa, tan_alpha


@register_jitable(error_model="numpy")
def hold_tread(x, data, rho, z, z_dot):
    """Write rates that vanish when the tread is deformed by the displacement of a standing wheel since assembly.

    Without rolling, u_dot = -V_sx and v_dot = V_sy, so that u = -(s_x - R_e phi), and v = s_y + rho times the tilt
    angle, with R_e for a flattening of 1/3. Statics uses this.
    """
    s_x, s_y, turn, lean = moved(x, data)
    R_e = (2.0 * data[RADIUS] + rho) / 3.0
    k = 0
    if data[SIGMA_X] > 0.0:
        z_dot[0] = -(s_x - R_e * turn) - z[0]
        k = 1
    if data[SIGMA_Y] > 0.0:
        z_dot[k] = s_y + rho * lean - z[k]
