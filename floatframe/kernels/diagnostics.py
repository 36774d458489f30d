"""Energies, momenta and constraint drift of the iterate; all on the deformed bodies."""

import math

from floatframe.joints.rows import (
    DISTANCE,
    DOT,
    LINE,
    LINE_TURN,
    POINT,
    PUSH,
    RIM_HEIGHT,
    ROLL,
    SCREW,
    SLIDE,
    TURN,
    TURN_B,
    TWIST,
    TWIST_B,
)
from floatframe.kernels.body import body_mass_product, modal_term
from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.connection import normal_force, row_rate, spring_tension
from floatframe.kernels.connections.coordinate_force import coordinate_force, coordinate_power, coordinate_strain
from floatframe.kernels.connections.coupler import coupler_power
from floatframe.kernels.connections.pair_force import pair_energy, pair_power
from floatframe.kernels.connections.relative_motion import loaded_axis, loaded_coordinate
from floatframe.kernels.connections.time_function import time_function
from floatframe.kernels.connections.user_force import user_force_power
from floatframe.kernels.marker import rotate, rotate_back
from floatframe.kernels.model import BUSHING, CONTACT, COUPLER, DAMPING, JOINT, N_DRIFTS, SPRING, STIFFNESS, USER_FORCE
from floatframe.kernels.rotation import cross

__all__ = ["diagnose", "power"]


@inner
def quadratic(model, work, i, which, x):
    """Return xᵀ M x, xᵀ K x or xᵀ D x of body i."""
    n = model.n_q[i]
    product = work.scratch[:n]
    for k in range(n):
        product[k] = 0.0
    modal_term(model, i, which, x, product)
    total = 0.0
    for k in range(n):
        total += x[k] * product[k]
    return total


@inner
def diagnose(model, work, out, drift):
    """Write energies and momenta into out[:10], and the drift of each joint into drift, (n_c, N_DRIFTS).

    T = 1/2 uᵀ M u; strain 1/2 qᵀ K q; gravity -g·(m r + R s). `evaluate` has been called for this iterate.
    """
    for k in range(10):
        out[k] = 0.0
    g = model.gravity
    for i in range(model.kind.shape[0]):
        n, u0, q0, R = model.n_q[i], model.u0[i], model.q0[i], work.R[i]
        m = model.mass[model.kind[i]]
        v = work.scratch[: 6 + n]
        momentum = work.scratch[6 + n : 2 * (6 + n)]
        v[0], v[1], v[2] = rotate_back(R, work.u[u0], work.u[u0 + 1], work.u[u0 + 2])
        for k in range(3, 6 + n):
            v[k] = work.u[u0 + k]
        body_mass_product(model, work, i, v, momentum)
        for k in range(6 + n):
            out[0] += 0.5 * v[k] * momentum[k]
        p0, p1, p2 = rotate(R, momentum[0], momentum[1], momentum[2])
        l0, l1, l2 = rotate(R, momentum[3], momentum[4], momentum[5])
        r0, r1, r2 = work.r[i, 0], work.r[i, 1], work.r[i, 2]
        x0, x1, x2 = cross(r0, r1, r2, p0, p1, p2)
        out[4] += p0
        out[5] += p1
        out[6] += p2
        out[7] += l0 + x0
        out[8] += l1 + x1
        out[9] += l2 + x2
        q = work.q[q0 : q0 + n]
        s0, s1, s2 = rotate(R, work.first[i, 0], work.first[i, 1], work.first[i, 2])
        out[2] -= g[0] * (m * r0 + s0) + g[1] * (m * r1 + s1) + g[2] * (m * r2 + s2)
        if n > 0:
            out[1] += 0.5 * quadratic(model, work, i, STIFFNESS, q)
    for c in range(model.c_size.shape[0]):
        for k in range(N_DRIFTS):
            drift[c, k] = 0.0
        if model.c_law[c] == SPRING:
            k, _, free, preload = model.springs[model.c_item[c]]
            _, length, _ = spring_tension(model, work, c)
            out[3] += 0.5 * k * (length - free) ** 2 + preload * length
        elif model.c_law[c] == BUSHING or model.c_law[c] == CONTACT:
            out[3] += pair_energy(model, work, c)
        if model.c_law[c] != JOINT:
            continue
        a, b = model.c_a[c], model.c_b[c]
        for k in range(model.c_w0[c], model.c_w0[c + 1]):
            kind = model.row_kind[k]
            if kind in (POINT, SLIDE, DISTANCE, SCREW, RIM_HEIGHT, LINE):
                drift[c, 0] += work.g[k] ** 2
                drift[c, 2] += row_rate(model, work, k, a, b) ** 2
            elif kind in (PUSH, TWIST, TWIST_B):
                x, _ = loaded_coordinate(model, work, k, a, b)
                out[3] += coordinate_strain(model, k, kind != PUSH, x)
            elif kind == ROLL:
                drift[c, 2] += work.g[k] ** 2
            elif kind in (DOT, TURN, TURN_B, LINE_TURN):
                drift[c, 1] += work.g[k] ** 2
                drift[c, 3] += row_rate(model, work, k, a, b) ** 2
        for k in range(N_DRIFTS):
            drift[c, k] = math.sqrt(drift[c, k])


@inner
def drive_power(model, work, c):
    """Return the power of the wrenches of a joint on its bodies if it prescribes a motion; else none."""
    w0, a, b = model.c_w0[c], model.c_a[c], model.c_b[c]
    is_driven = False
    for k in range(w0, model.c_w0[c + 1]):
        is_driven = is_driven or model.row_motion[k] >= 0
    total = 0.0
    if is_driven:
        for k in range(3):
            total += work.w[w0 + k] * (work.m_v[a, k] - work.m_v[b, k])
            if model.m_moment[a] >= 0:
                total += work.w[w0 + model.m_moment[a] + k] * work.m_omega[a, k]
            if model.m_moment[b] >= 0:
                total -= work.w[w0 + model.m_moment[b] + k] * work.m_omega[b, k]
    return total


@inner
def loaded_power(model, work, c):
    """Return the power that enters by forces along coordinates of joint c, that taken by them, and their total."""
    loads, dissipated, total = 0.0, 0.0, 0.0
    w0, a, b = model.c_w0[c], model.c_a[c], model.c_b[c]
    w = work.w[w0 : model.c_w0[c + 1]]
    for k in range(w0, model.c_w0[c + 1]):
        if model.row_kind[k] in (PUSH, TWIST, TWIST_B):
            is_angle = model.row_kind[k] != PUSH
            x, v = loaded_coordinate(model, work, k, a, b)
            e0, e1, e2 = loaded_axis(model, work, k, a, b)
            normal, _ = normal_force(w, e0, e1, e2)
            Q, _, _, _ = coordinate_force(model, work, k, is_angle, x, v, normal)
            given, taken = coordinate_power(model, work, k, is_angle, x, v, Q)
            loads += given
            dissipated += taken
            total += Q * v
    return loads, dissipated, total


@inner
def body_load_power(model, work, d):
    """Return the power of load case d on its body."""
    i, first = model.d_body[d], model.d_first[d]
    u0, R, f = model.u0[i], work.R[i], model.d_values
    factor, _, _ = time_function(model, model.d_factor[d], work.time[0])
    v0, v1, v2 = rotate_back(R, work.u[u0], work.u[u0 + 1], work.u[u0 + 2])
    total = f[first] * v0 + f[first + 1] * v1 + f[first + 2] * v2
    for k in range(3, 6 + model.n_q[i]):
        total += f[first + k] * work.u[u0 + k]
    return factor * total


@inner
def power(model, work):
    """Return the power of point forces and of drives, and that taken by dampers and modal damping (positive)."""
    loads, dissipated = 0.0, 0.0
    for k in range(model.l_marker.shape[0]):
        m = model.l_marker[k]
        for a in range(3):
            loads += work.m_wrench[m, a] * work.m_v[m, a] + work.m_wrench[m, 3 + a] * work.m_omega[m, a]
    for c in range(model.c_size.shape[0]):
        law = model.c_law[c]
        if law == JOINT:
            driven = drive_power(model, work, c)
            loads += driven
            if model.c_rates[c]:
                given, taken, total = loaded_power(model, work, c)
                loads += given - (total if driven != 0.0 else 0.0)
                dissipated += taken
        elif law == BUSHING or law == CONTACT:
            given, taken = pair_power(model, work, c)
            loads += given
            dissipated += taken
        elif law == COUPLER:
            loads += coupler_power(model, work, c)
        elif law == USER_FORCE:
            loads += user_force_power(model, work, c)
        elif law == SPRING:
            _, damping, _, _ = model.springs[model.c_item[c]]
            _, length, rate = spring_tension(model, work, c)
            dissipated += damping * rate * rate
            if model.spring_table[model.c_item[c]] >= 0:
                value, _, _ = time_function(
                    model, model.spring_table[model.c_item[c]], length - model.springs[model.c_item[c], 2]
                )
                loads -= value * rate
    for d in range(model.d_body.shape[0]):
        loads += body_load_power(model, work, d)
    for i in range(model.kind.shape[0]):
        n, u0 = model.n_q[i], model.u0[i]
        if n > 0:
            dissipated += quadratic(model, work, i, DAMPING, work.u[u0 + 6 : u0 + 6 + n])
    return loads, dissipated
