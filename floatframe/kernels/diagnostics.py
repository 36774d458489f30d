"""Energies, momenta and constraint drift of the iterate; all on the deformed bodies."""

import math

from floatframe.joints.rows.kinds import NOTHING, VELOCITY
from floatframe.kernels.body import body_mass_product, modal_term
from floatframe.kernels.compiler.compilation import inner
from floatframe.kernels.connections.connection import row_rates
from floatframe.kernels.connections.coupler import coupler_power
from floatframe.kernels.connections.pair_force import pair_energy, pair_power
from floatframe.kernels.connections.spring_damper import spring_tension
from floatframe.kernels.connections.user_force import user_force_power
from floatframe.kernels.joints.coordinate_force import coordinate_force, coordinate_power, coordinate_strain
from floatframe.kernels.joints.loaded_rows import normal_force
from floatframe.kernels.joints.relative_motion import loaded_axis, loaded_coordinate
from floatframe.kernels.memory import N_DRIFTS
from floatframe.kernels.model import BUSHING, CONTACT, COUPLER, DAMPING, JOINT, SPRING, STIFFNESS, USER_FORCE
from floatframe.kernels.scalars import cross, rotate, rotate_back
from floatframe.kernels.time_function import time_function

__all__ = ["diagnose", "power"]


@inner
def quadratic(model, work, i, which, x):
    """Return xᵀ M x, xᵀ K x or xᵀ D x of body i."""
    n = model.bodies.n_q[i]
    product = work.bodies.modal[:n]
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
    for i in range(model.bodies.kind.shape[0]):
        n, u0, q0, R = model.bodies.n_q[i], model.bodies.u0[i], model.bodies.q0[i], work.state.R[i]
        m = model.body_types.mass[model.bodies.kind[i]]
        v = work.bodies.velocity[: 6 + n]
        momentum = work.bodies.momentum[: 6 + n]
        v[0], v[1], v[2] = rotate_back(R, work.state.u[u0], work.state.u[u0 + 1], work.state.u[u0 + 2])
        for k in range(3, 6 + n):
            v[k] = work.state.u[u0 + k]
        body_mass_product(model, work, i, v, momentum)
        for k in range(6 + n):
            out[0] += 0.5 * v[k] * momentum[k]
        p0, p1, p2 = rotate(R, momentum[0], momentum[1], momentum[2])
        l0, l1, l2 = rotate(R, momentum[3], momentum[4], momentum[5])
        r0, r1, r2 = work.state.r[i, 0], work.state.r[i, 1], work.state.r[i, 2]
        x0, x1, x2 = cross(r0, r1, r2, p0, p1, p2)
        out[4] += p0
        out[5] += p1
        out[6] += p2
        out[7] += l0 + x0
        out[8] += l1 + x1
        out[9] += l2 + x2
        q = work.state.q[q0 : q0 + n]
        s0, s1, s2 = rotate(R, work.bodies.s[i, 0], work.bodies.s[i, 1], work.bodies.s[i, 2])
        out[2] -= g[0] * (m * r0 + s0) + g[1] * (m * r1 + s1) + g[2] * (m * r2 + s2)
        if n > 0:
            out[1] += 0.5 * quadratic(model, work, i, STIFFNESS, q)
    for c in range(model.connections.size.shape[0]):
        for k in range(N_DRIFTS):
            drift[c, k] = 0.0
        if model.connections.law[c] == SPRING:
            i, springs = model.connections.item[c], model.springs
            _, length, _ = spring_tension(model, work, c)
            out[3] += 0.5 * springs.stiffness[i] * (length - springs.free_length[i]) ** 2 + springs.preload[i] * length
        elif model.connections.law[c] == BUSHING or model.connections.law[c] == CONTACT:
            out[3] += pair_energy(model, work, c)
        if model.connections.law[c] != JOINT:
            continue
        a, b = model.connections.a[c], model.connections.b[c]
        for k in range(model.connections.w0[c], model.connections.w0[c + 1]):
            rows = model.rows
            if rows.is_loaded[k]:
                x, _ = loaded_coordinate(model, work, k, a, b)
                out[3] += coordinate_strain(model, k, rows.is_angle[k] != 0, x)
            elif rows.holds[k] == VELOCITY:
                drift[c, 2] += work.connections.g[k] ** 2
            elif rows.holds[k] != NOTHING:
                which = 0 if rows.is_length[k] else 1
                rate, _ = row_rates(model, work, k, a, b)
                drift[c, which] += work.connections.g[k] ** 2
                drift[c, 2 + which] += rate**2
        for k in range(N_DRIFTS):
            drift[c, k] = math.sqrt(drift[c, k])


@inner
def drive_power(model, work, c):
    """Return the power of the wrenches of a joint on its bodies if it prescribes a motion; else none."""
    w0, a, b = model.connections.w0[c], model.connections.a[c], model.connections.b[c]
    is_driven = False
    for k in range(w0, model.connections.w0[c + 1]):
        is_driven = is_driven or model.rows.motion[k] >= 0
    total = 0.0
    if is_driven:
        for k in range(3):
            total += work.state.w[w0 + k] * (work.markers.v[a, k] - work.markers.v[b, k])
            if model.markers.moment[a] >= 0:
                total += work.state.w[w0 + model.markers.moment[a] + k] * work.markers.omega[a, k]
            if model.markers.moment[b] >= 0:
                total -= work.state.w[w0 + model.markers.moment[b] + k] * work.markers.omega[b, k]
    return total


@inner
def loaded_power(model, work, c):
    """Return the power that enters by forces along coordinates of joint c, that taken by them, and their total."""
    loads, dissipated, total = 0.0, 0.0, 0.0
    w0, a, b = model.connections.w0[c], model.connections.a[c], model.connections.b[c]
    w = work.state.w[w0 : model.connections.w0[c + 1]]
    for k in range(w0, model.connections.w0[c + 1]):
        if model.rows.is_loaded[k]:
            is_angle = model.rows.is_angle[k] != 0
            x, v = loaded_coordinate(model, work, k, a, b)
            normal, _ = normal_force(w, loaded_axis(model, work, k, a, b))
            Q, _, _, _ = coordinate_force(model, work, k, is_angle, x, v, normal)
            given, taken = coordinate_power(model, work, k, is_angle, x, v, Q)
            loads += given
            dissipated += taken
            total += Q * v
    return loads, dissipated, total


@inner
def body_load_power(model, work, d):
    """Return the power of load case d on its body."""
    i, first = model.body_loads.body[d], model.body_loads.value0[d]
    u0, R, f = model.bodies.u0[i], work.state.R[i], model.body_loads.values
    factor, _, _ = time_function(model, model.body_loads.factor[d], work.state.time)
    v0, v1, v2 = rotate_back(R, work.state.u[u0], work.state.u[u0 + 1], work.state.u[u0 + 2])
    total = f[first] * v0 + f[first + 1] * v1 + f[first + 2] * v2
    for k in range(3, 6 + model.bodies.n_q[i]):
        total += f[first + k] * work.state.u[u0 + k]
    return factor * total


@inner
def power(model, work):
    """Return the power of point forces and of drives, and that taken by dampers and modal damping (positive)."""
    loads, dissipated = 0.0, 0.0
    for k in range(model.loads.marker.shape[0]):
        m = model.loads.marker[k]
        for a in range(3):
            loads += (
                work.markers.wrench[m, a] * work.markers.v[m, a]
                + work.markers.wrench[m, 3 + a] * work.markers.omega[m, a]
            )
    for c in range(model.connections.size.shape[0]):
        law = model.connections.law[c]
        if law == JOINT:
            driven = drive_power(model, work, c)
            loads += driven
            if model.connections.has_rates[c]:
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
            i, springs = model.connections.item[c], model.springs
            _, length, rate = spring_tension(model, work, c)
            dissipated += springs.damping[i] * rate * rate
            if springs.table[i] >= 0:
                value, _, _ = time_function(model, springs.table[i], length - springs.free_length[i])
                loads -= value * rate
    for d in range(model.body_loads.body.shape[0]):
        loads += body_load_power(model, work, d)
    for i in range(model.bodies.kind.shape[0]):
        n, u0 = model.bodies.n_q[i], model.bodies.u0[i]
        if n > 0:
            dissipated += quadratic(model, work, i, DAMPING, work.state.u[u0 + 6 : u0 + 6 + n])
    return loads, dissipated
