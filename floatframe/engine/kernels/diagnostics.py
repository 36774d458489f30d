"""Energies, momenta and constraint drift of the iterate, all for the deformed bodies."""

import math

from floatframe.engine.kernels.body import body_mass_product, modal_term
from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.connection import row_rates
from floatframe.engine.kernels.connections.coupler import coupler_power
from floatframe.engine.kernels.connections.element_law import law_power
from floatframe.engine.kernels.connections.pair_force import is_pair, pair_power
from floatframe.engine.kernels.connections.user_force import user_force_power
from floatframe.engine.kernels.joints.coordinate_force import coordinate_force, coordinate_power, coordinate_strain
from floatframe.engine.kernels.joints.loaded_rows import normal_part
from floatframe.engine.kernels.joints.relative_motion import loaded_axis, loaded_coordinate
from floatframe.engine.kernels.memory import (
    ANGULAR_MOMENTUM,
    GRAVITATION,
    KINETIC,
    MOMENTUM,
    N_DRIFTS,
    OF_ANGLE_RATES,
    OF_ANGLES,
    OF_DISTANCE_RATES,
    OF_DISTANCES,
    SPRINGS,
    STRAIN,
)
from floatframe.engine.kernels.model import COUPLER, DAMPING, ELEMENT, JOINT, STIFFNESS, USER_FORCE
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.kernels.vector import add, cross, dot, put, put_sum, scaled, sub, turned, turned_back, vector
from floatframe.model.joints.rows.kinds import NOTHING, VELOCITY

__all__ = ["diagnose", "power", "quadratic"]


@inner
def quadratic(model, work, i, which, x):
    """Return the quadratic form xᵀ M x, xᵀ K x or xᵀ D x of body i."""
    n = model.bodies.n_q[i]
    product = work.bodies.modal[:n]
    product[:] = 0.0
    modal_term(model.body_types, model.bodies.kind[i], n, which, 1.0, x, product)
    total = 0.0
    for k in range(n):
        total += x[k] * product[k]
    return total


@inner
def diagnose(model, work, out, drift):
    """Write energies and momenta into out[:10], and the drift of each joint into drift, (n_c, N_DRIFTS).

    Kinetic energy 1/2 uᵀ M u, strain energy 1/2 qᵀ K q, gravity -g·(m r + R s). `evaluate` must have been called for
    this iterate.
    """
    for k in range(10):
        out[k] = 0.0
    for i in range(model.bodies.kind.shape[0]):
        n, u0, q0, R = model.bodies.n_q[i], model.bodies.u0[i], model.bodies.q0[i], work.state.R[i]
        m, r, s = model.body_types.mass[model.bodies.kind[i]], vector(work.state.r[i]), turned(R, work.bodies.s[i])
        v, momentum = work.bodies.velocity[: 6 + n], work.bodies.momentum[: 6 + n]
        put(v, 0, turned_back(R, work.state.u[u0:]))
        for k in range(3, 6 + n):
            v[k] = work.state.u[u0 + k]
        body_mass_product(model, work, i, v, momentum)
        for k in range(6 + n):
            out[KINETIC] += 0.5 * v[k] * momentum[k]
        p = turned(R, momentum)
        put_sum(out, MOMENTUM, p)
        put_sum(out, ANGULAR_MOMENTUM, add(turned(R, momentum[3:]), cross(r, p)))
        out[GRAVITATION] -= dot(model.gravity, add(scaled(m, r), s))
        if n > 0:
            out[STRAIN] += 0.5 * quadratic(model, work, i, STIFFNESS, work.state.q[q0 : q0 + n])
    for c in range(model.connections.size.shape[0]):
        for k in range(N_DRIFTS):
            drift[c, k] = 0.0
        if is_pair(model.connections.law[c]):
            energy, _, _ = pair_power(model, work, c)
            out[SPRINGS] += energy
        elif model.connections.law[c] == ELEMENT:
            energy, _, _ = law_power(model, work, c)
            out[SPRINGS] += energy
        if model.connections.law[c] != JOINT:
            continue
        a, b = model.connections.a[c], model.connections.b[c]
        for k in range(model.connections.w0[c], model.connections.w0[c + 1]):
            rows = model.rows
            if rows.is_loaded[k]:
                x, _ = loaded_coordinate(rows, work.markers, k, a, b)
                out[SPRINGS] += coordinate_strain(model, k, rows.is_angle[k] != 0, x)
            elif rows.holds[k] == VELOCITY:
                drift[c, OF_DISTANCE_RATES] += work.connections.g[k] ** 2
            elif rows.holds[k] != NOTHING:
                of_places, of_rates = (
                    (OF_DISTANCES, OF_DISTANCE_RATES) if rows.is_length[k] else (OF_ANGLES, OF_ANGLE_RATES)
                )
                rate, _ = row_rates(model, work, k, a, b)
                drift[c, of_places] += work.connections.g[k] ** 2
                drift[c, of_rates] += rate**2
        for k in range(N_DRIFTS):
            drift[c, k] = math.sqrt(drift[c, k])


@inner
def drive_power(model, work, c):
    """Return the power that a joint supplies to its bodies if it prescribes a motion; otherwise zero."""
    w0, a, b = model.connections.w0[c], model.connections.a[c], model.connections.b[c]
    is_driven = False
    for k in range(w0, model.connections.w0[c + 1]):
        is_driven = is_driven or model.rows.motion[k] >= 0
    if not is_driven:
        return 0.0
    w, v, omega, moment_a, moment_b = (
        work.state.w[w0:],
        work.markers.v,
        work.markers.omega,
        model.markers.moment[a],
        model.markers.moment[b],
    )
    total = dot(w, sub(v[a], v[b]))
    if moment_a >= 0:
        total += dot(w[moment_a:], omega[a])
    if moment_b >= 0:
        total -= dot(w[moment_b:], omega[b])
    return total


@inner
def loaded_power(model, work, c):
    """Return supplied power, dissipated power and total power of the forces along coordinates of joint c."""
    rows, markers = model.rows, work.markers
    loads, dissipated, total = 0.0, 0.0, 0.0
    w0, a, b = model.connections.w0[c], model.connections.a[c], model.connections.b[c]
    w = work.state.w[w0 : model.connections.w0[c + 1]]
    for k in range(w0, model.connections.w0[c + 1]):
        if rows.is_loaded[k]:
            is_angle = rows.is_angle[k] != 0
            x, v = loaded_coordinate(rows, markers, k, a, b)
            normal, _ = normal_part(w, loaded_axis(rows, markers, k, a, b))
            Q, _, _, _ = coordinate_force(model, work, k, is_angle, x, v, normal)
            given, taken = coordinate_power(model, work, k, is_angle, x, v, Q)
            loads += given
            dissipated += taken
            total += Q * v
    return loads, dissipated, total


@inner
def body_load_power(model, work, d):
    """Return the power that load case d supplies to its body."""
    i, first = model.body_loads.body[d], model.body_loads.value0[d]
    u0, R, f = model.bodies.u0[i], work.state.R[i], model.body_loads.values
    factor, _, _ = time_function(model.functions, model.body_loads.factor[d], work.state.time)
    total = dot(f[first:], turned_back(R, work.state.u[u0:]))
    for k in range(3, 6 + model.bodies.n_q[i]):
        total += f[first + k] * work.state.u[u0 + k]
    return factor * total


@inner
def power(model, work):
    """Return the power supplied by point forces and drives, and the power dissipated by dampers and modes."""
    loads, dissipated = 0.0, 0.0
    for k in range(model.loads.marker.shape[0]):
        m = model.loads.marker[k]
        wrench = work.markers.wrench[m]
        loads += dot(wrench, work.markers.v[m]) + dot(wrench[3:], work.markers.omega[m])
    for c in range(model.connections.size.shape[0]):
        law = model.connections.law[c]
        if law == JOINT:
            driven = drive_power(model, work, c)
            loads += driven
            if model.connections.has_rates[c]:
                given, taken, total = loaded_power(model, work, c)
                loads += given - (total if driven != 0.0 else 0.0)
                dissipated += taken
        elif is_pair(law):
            _, given, taken = pair_power(model, work, c)
            loads += given
            dissipated += taken
        elif law == COUPLER:
            loads += coupler_power(model, work, c)
        elif law == USER_FORCE:
            loads += user_force_power(model, work, c)
        elif law == ELEMENT:
            _, given, taken = law_power(model, work, c)
            loads += given
            dissipated += taken
    for d in range(model.body_loads.body.shape[0]):
        loads += body_load_power(model, work, d)
    for i in range(model.bodies.kind.shape[0]):
        n, u0 = model.bodies.n_q[i], model.bodies.u0[i]
        if n > 0:
            dissipated += quadratic(model, work, i, DAMPING, work.state.u[u0 + 6 : u0 + 6 + n])
    return loads, dissipated
