"""Markers over a step: positions, rotations, and the exact transfer of the work of marker loads to bodies.

cay(theta) = (1 - tilde/2)⁻¹ (1 + tilde/2) is the rotation by 2 atan(|theta|/2) about theta. With R_1 = R_0 cay(theta)
and theta_G = R_0 theta

    R_1 a_1 - R_0 a_0 = theta_G × (R_0 a_0 + R_1 a_1)/2 + R_m (a_1 - a_0),    R_m = R_0 (1 + tilde(theta)/2):

is the change of a vector that rotates with a body and also changes relative to it, exact for a step of any size.

So over a step, with the lever l = (R_0 sigma_0 + R_1 sigma_1)/2 from the centre of mass, and for a
direction E = R exp(Psi_r q) e = R eps of a marker,

    dx = d + theta_G × l + R_m Psi_sigma dq,        dE = theta_G × (E_0 + E_1)/2 + R_m (psi × (eps_0 + eps_1)/2)

Here sigma(q) and th(q) are at most of degree two in q (in a stiffened body the motion of interfaces has terms of second
order, theory.md §7). So their changes are Psi_sigma dq and Psi_r dq with the derivatives at the mean of q, and
psi = Gamma Psi_r dq is the Cayley vector of the elastic rotation. A force F, with the work F·dx, consists of the force
F, the torque l × F and the modal forces Psi_sigmaᵀ R_mᵀ F on the body. A load G on a direction, with the work G·dE,
consists of the torque E_mean × G and the modal forces (Gamma Psi_r)ᵀ (eps_mean × R_mᵀ G).
Gamma = T + (psi - T dth) dthᵀ/|dth|², T the left Jacobian at the mean of th = Psi_r q: the discrete derivative of
Gonzalez (1996), Journal of Nonlinear Science 6, 449-467, of the map th -> exp(th).
"""

import math

from floatframe.engine.kernels.body import column_sum
from floatframe.engine.kernels.compiler.compilation import inner, loops, small, view
from floatframe.engine.kernels.dense import matrix_at, rows_of
from floatframe.engine.kernels.marker import bent_shapes, shape, shape_sum
from floatframe.engine.kernels.rotation import exp_matrix, left_jacobian
from floatframe.engine.kernels.vector import (
    add,
    cross,
    dot,
    matrix,
    matrix_sum,
    product,
    put,
    put_matrix,
    put_sum,
    scaled,
    scaled_matrix,
    sub,
    turned,
    turned_back,
    unit_matrix,
    vector,
)

__all__ = ["add_direction", "add_force", "add_moment", "add_pair", "begin_markers", "begin_unit_load", "change",
           "distances", "end_unit_load", "ends", "marker_loads", "marker_step", "mean_direction", "put_end_of_forces",
           "put_start", "step_shapes", "turning"]  # fmt: skip

SMALL = 1e-14  # square of an elastic rotation in a step below which its Cayley vector is T dth to roundoff
NONE = (0.0, 0.0, 0.0)


@loops
def deformation(model, step, m, i, q, s):
    """Return the position of marker m relative to the centre of mass s, and its elastic rotation."""
    sigma = sub(vector(model.markers.position[m]), s)
    if model.markers.psi0[m] < 0:
        return sigma, NONE
    psi = matrix_at(step.shape, 0, 6, model.bodies.n_q[i])
    bent_shapes(model, m, q, 0.5, psi)
    d, th = shape_sum(psi, q)
    return add(sigma, d), th


@inner
def begin_markers(model, discrete, step):
    """Write the markers at the configuration at the start of the step."""
    for m in range(model.markers.body.shape[0]):
        i = model.markers.body[m]
        if i < 0:
            x, A = vector(model.markers.position[m]), matrix(model.markers.triad[m])
            put(step.x_0[m], 0, x)
            put(step.end.markers.r[m], 0, x)
            put(step.x_f[m], 0, x)
            put_matrix(step.A_0[m], A)
            put_matrix(step.end.markers.A[m], A)
            put_matrix(step.A_f[m], A)
            put_matrix(step.E_mean[m], A)
            put_matrix(step.Gamma[m], unit_matrix())
            put(step.dx[m], 0, NONE)
            put(step.dpsi[m], 0, NONE)
            put(step.lever[m], 0, NONE)
            continue
        n, q0, R = model.bodies.n_q[i], model.bodies.q0[i], matrix(step.R_0[i])
        sigma, th = deformation(model, step, m, i, step.q_0[q0 : q0 + n], vector(step.s_0[i]))
        arm, E = turned(R, sigma), matrix(model.markers.triad[m])
        if discrete.turns[m]:
            E = product(exp_matrix(th), E)
        put_start(step, m, i, arm, th, E)
        put(step.dpsi[m], 0, NONE)


@inner
def put_start(step, m, i, arm, th, E):
    """Write marker m of body i at the start of the step; arm: from the centre of mass, th: elastic rotation vector."""
    put(step.arm_0[m], 0, arm)
    put(step.th_0[m], 0, th)
    put_matrix(step.E_0[m], E)
    put(step.x_0[m], 0, add(vector(step.c_0[i]), arm))
    put_matrix(step.A_0[m], product(step.R_0[i], E))


@view
def step_shapes(model, discrete, step, m):
    """Return the shapes Psi_sigma and Psi_r of marker m at q_mean, (6, n)."""
    return rows_of(step.psi, 6, discrete.psi0[m], model.bodies.n_q[model.markers.body[m]])


@loops
def marker_step(model, discrete, step, m):
    """Write the motion of marker m over the step of its body."""
    i = model.markers.body[m]
    clear_loads(step, 0, m)
    if i < 0:
        return
    n, q0, R_m = model.bodies.n_q[i], model.bodies.q0[i], matrix(step.R_m[i])
    arm_0, th_0 = vector(step.arm_0[m]), vector(step.th_0[m])
    E_0 = matrix(step.E_0[m])
    arm_1, th_1, E_1 = arm_0, th_0, E_0
    if not step.is_closing:
        R_1 = matrix(step.R_1[i])
        sigma, th_1 = deformation(model, step, m, i, step.q_1[q0 : q0 + n], vector(step.s_1[i]))
        arm_1 = turned(R_1, sigma)
        if discrete.turns[m]:
            E_1 = product(exp_matrix(th_1), matrix(model.markers.triad[m]))
        put(step.end.markers.r[m], 0, add(add(vector(step.c_0[i]), vector(step.d[i])), arm_1))
        put_matrix(step.end.markers.A[m], product(R_1, E_1))
    if step.is_still:
        arm_1, th_1, E_1 = arm_0, th_0, E_0
    put_end_of_forces(step, m)
    lever = scaled(0.5, add(arm_0, arm_1))
    put(step.lever[m], 0, lever)
    dx = add(vector(step.d[i]), cross(vector(step.theta_G[i]), lever))
    put_matrix(step.E_mean[m], scaled_matrix(0.5, matrix_sum(E_0, E_1)))
    if n:
        psi, C, dq = step_shapes(model, discrete, step, m), rows_of(step.C_mean, 3, q0, n), step.dq[q0 : q0 + n]
        if model.markers.psi0[m] >= 0:
            bent_shapes(model, m, step.q_mean[q0 : q0 + n], 1.0, psi)
        else:
            psi[:, :] = 0.0
        for a in range(3):
            for k in range(n):
                psi[a, k] -= C[a, k]
        dx = add(dx, turned(R_m, column_sum(psi, dq)))
        if discrete.turns[m]:
            Gamma = mean_jacobian(th_0, th_1)
            put_matrix(step.Gamma[m], Gamma)
            put(step.dpsi[m], 0, turned(Gamma, column_sum(psi[3:], dq)))
    put(step.dx[m], 0, dx)


@inner
def put_end_of_forces(step, m):
    """Write the end of the force interval of marker m: the end of the step, or its start if forces act there."""
    if step.is_still:
        put(step.x_f[m], 0, vector(step.x_0[m]))
        put_matrix(step.A_f[m], matrix(step.A_0[m]))
        return
    put(step.x_f[m], 0, vector(step.end.markers.r[m]))
    put_matrix(step.A_f[m], matrix(step.end.markers.A[m]))


@inner
def mean_jacobian(th_0, th_1):
    """Return Gamma, the discrete derivative of the elastic rotation."""
    T = left_jacobian(scaled(0.5, add(th_0, th_1)))
    dth = sub(th_1, th_0)
    square = dot(dth, dth)
    if square < SMALL:
        return T
    rest = scaled(1.0 / square, sub(relative_cayley(th_0, th_1), turned(T, dth)))
    return add(T[0], scaled(rest[0], dth)), add(T[1], scaled(rest[1], dth)), add(T[2], scaled(rest[2], dth))


@inner
def relative_cayley(th_0, th_1):
    """Return the relative Cayley vector psi, for which exp(th_1) = cay(psi) exp(th_0)."""
    c0, b0 = half_turn(th_0)
    c1, b1 = half_turn(th_1)
    both = sub(sub(scaled(c0, b1), scaled(c1, b0)), cross(b1, b0))
    return scaled(2.0 / (c0 * c1 + dot(b0, b1)), both)


@inner
def half_turn(th):
    """Return the Euler parameters of a rotation vector, as scalar and vector."""
    x = 0.25 * dot(th, th)
    if x < 1e-4:
        return 1 - x / 2 + x * x / 24 - x**3 / 720, scaled(0.5 * (1 - x / 6 + x * x / 120 - x**3 / 5040), th)
    half = x**0.5
    return math.cos(half), scaled(0.5 * math.sin(half) / half, th)


@inner
def ends(step, m, e):
    """Return direction e of a marker at both ends of the force interval."""
    return turned(step.A_0[m], e), turned(step.A_f[m], e)


@inner
def mean_direction(step, m, e):
    """Return the mean of a marker's direction e over the step."""
    E_0, E_1 = ends(step, m, e)
    return scaled(0.5, add(E_0, E_1))


@inner
def distances(step, a, b):
    """Return the vector from A to B at both ends of the force interval."""
    return sub(vector(step.x_0[b]), vector(step.x_0[a])), sub(vector(step.x_f[b]), vector(step.x_f[a]))


@inner
def change(model, discrete, step, m, e, mean):
    """Return the change of a marker's direction e over the step; mean: its mean."""
    i = model.markers.body[m]
    if i < 0:
        return NONE
    result = cross(vector(step.theta_G[i]), mean)
    if discrete.turns[m]:
        own = cross(vector(step.dpsi[m]), turned(step.E_mean[m], e))
        result = add(result, turned(step.R_m[i], own))
    return result


@inner
def turning(model, step, m):
    """Return the rotation vector of a marker over the step."""
    i = model.markers.body[m]
    if i < 0:
        return NONE
    return add(vector(step.theta_G[i]), turned(step.R_m[i], vector(step.dpsi[m])))


@small
def clear_loads(step, which, m):
    """Set one set of loads on a marker to zero."""
    put(step.F[which, m], 0, NONE)
    put(step.T[which, m], 0, NONE)
    put(step.m[which, m], 0, NONE)


@inner
def begin_unit_load(step, a, b):
    """Begin to collect the loads on two markers in the second set, whose work is needed."""
    clear_loads(step, 1, a)
    clear_loads(step, 1, b)
    step.is_unit = 1


@inner
def end_unit_load(model, step, a, b):
    """Return the work over the step of the loads added since `begin_unit_load`."""
    step.is_unit = 0
    return work_of_loads(model, step, a) + work_of_loads(model, step, b)


@inner
def work_of_loads(model, step, m):
    """Return the work of a marker's second set of loads: F · dx + T · theta_G + m · psi."""
    i = model.markers.body[m]
    if i < 0:
        return 0.0
    of_turns = dot(step.T[1, m], step.theta_G[i]) + dot(step.m[1, m], step.dpsi[m])
    return dot(step.F[1, m], step.dx[m]) + of_turns


@inner
def add_force(step, m, F):
    """Add a force at a marker."""
    put_sum(step.F[step.is_unit, m], 0, F)


@inner
def add_pair(step, a, b, F):
    """Add a force on B and the opposite force on A."""
    add_force(step, b, F)
    add_force(step, a, scaled(-1.0, F))


@inner
def add_direction(model, discrete, step, m, e, G):
    """Add a load on direction e of a marker, with the work G · dE."""
    put_sum(step.T[step.is_unit, m], 0, cross(mean_direction(step, m, e), G))
    i = model.markers.body[m]
    if i >= 0 and discrete.turns[m]:
        put_sum(step.m[step.is_unit, m], 0, cross(turned(step.E_mean[m], e), turned_back(step.R_m[i], G)))


@inner
def add_moment(model, step, m, T):
    """Add a moment T on a marker, whose work is T times the rotation of the marker over the step."""
    put_sum(step.T[step.is_unit, m], 0, T)
    i = model.markers.body[m]
    if i >= 0:
        put_sum(step.m[step.is_unit, m], 0, turned_back(step.R_m[i], T))


@loops
def marker_loads(model, discrete, step, m):
    """Add the loads on a marker to the loads of its body."""
    i = model.markers.body[m]
    if i < 0:
        return
    n, u0, F = model.bodies.n_q[i], model.bodies.u0[i], vector(step.F[0, m])
    put_sum(step.load, u0, F)
    put_sum(step.load, u0 + 3, add(vector(step.T[0, m]), cross(vector(step.lever[m]), F)))
    if n == 0:
        return
    psi, F_B = step_shapes(model, discrete, step, m), turned_back(step.R_m[i], F)
    T = turned_back(step.Gamma[m], vector(step.m[0, m])) if discrete.turns[m] else NONE
    for k in range(n):
        d, th = shape(psi, k)
        step.load[u0 + 6 + k] += dot(d, F_B) + dot(th, T)
