"""Rows of free coordinates along which forces act: PUSH, TWIST and TWIST_B, with the residual e · part + Q.

With e the axis, d = r_B - r_A, s the slip of B relative to A and n the absolute value of the force normal to e:

    PUSH   dx = e · (dr_B - dr_A) + (e × d) · dphi_A
           dv = e · (dv_B - dv_A) + (e × d) · domega_A - (e × omega_A) · (dr_B - dr_A) + (e × s) · dphi_A
    TWIST  dx = t · (dphi_A - dphi_B), t as in `angle_between`
           dv = e · (domega_B - domega_A) + (e × (omega_B - omega_A)) · dphi of the marker with the axis
"""

import math

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.joints.coordinate_force import coordinate_force
from floatframe.engine.kernels.joints.relative_motion import add_coordinate_gradient, loaded_axis, loaded_coordinate
from floatframe.engine.kernels.vector import cross, dot, put, put_sum, scaled, sub, vector
from floatframe.model.joints.rows.kinds import PUSH, TWIST_B

__all__ = ["loaded_derivatives", "loaded_value", "normal_part"]


@inner
def normal_part(w, e):
    """Return the absolute value of the force normal to the axis, and the force component along the axis."""
    F = vector(w)
    along = dot(e, F)
    return math.sqrt(max(dot(F, F) - along * along, 0.0)), along


@inner
def loaded_value(model, work, k, a, b, w):
    """Return the value of PUSH, TWIST or TWIST_B: e · part + Q."""
    rows, markers = model.rows, work.markers
    e = loaded_axis(rows, markers, k, a, b)
    x, v = loaded_coordinate(rows, markers, k, a, b)
    normal, _ = normal_part(w, e)
    Q, _, _, _ = coordinate_force(model, work, k, rows.kind[k] != PUSH, x, v, normal)
    return dot(e, vector(w[rows.part[k] :])) + Q


@inner
def loaded_derivatives(model, work, k, a, b, w, c_k, by, V):
    """Write the derivatives of PUSH, TWIST or TWIST_B."""
    rows, markers = model.rows, work.markers
    part, is_angle = rows.part[k], rows.kind[k] != PUSH
    e = loaded_axis(rows, markers, k, a, b)
    x, v = loaded_coordinate(rows, markers, k, a, b)
    normal, along = normal_part(w, e)
    _, Q_x, Q_v, Q_n = coordinate_force(model, work, k, is_angle, x, v, normal)
    put(V, part, e)
    turn = cross(e, vector(w[part:]))  # derivative by a rotation of the marker with the axis
    if Q_n != 0.0 and normal > 0.0:
        f, F = Q_n / normal, vector(w)
        put_sum(V, 0, scaled(f, sub(F, scaled(along, e))))
        turn = sub(turn, scaled(f * along, cross(e, F)))
    add_coordinate_gradient(rows, markers, k, a, b, by, c_k * Q_x, c_k * Q_v)
    if rows.kind[k] == TWIST_B:
        put_sum(by.b, 3, scaled(c_k, turn))
    else:
        put_sum(by.a, 3, scaled(c_k, turn))
