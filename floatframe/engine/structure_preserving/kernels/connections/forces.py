"""Loads of bushings and user forces in a structure-preserving step."""

from floatframe.engine.kernels.compiler.compilation import inner
from floatframe.engine.kernels.connections.bushing import continued, law, rotation_vector
from floatframe.engine.kernels.connections.coordinate import ends_and_row, indices_of
from floatframe.engine.kernels.connections.user_force import input_parts, user_outputs
from floatframe.engine.kernels.rotation import exp_matrix
from floatframe.engine.kernels.time_function import time_function
from floatframe.engine.kernels.vector import (
    add,
    axial,
    cross,
    matrix,
    matrix_sum,
    product,
    put,
    scaled,
    scaled_matrix,
    solved,
    sub,
    tilde,
    transposed,
    turned,
    turned_back,
    unit,
    vector,
)
from floatframe.engine.structure_preserving.kernels.coordinates import (
    add_impulsive_force,
    coordinate_change,
    coordinate_ends,
    coordinate_rate,
    counted,
    ends_of_step,
)
from floatframe.engine.structure_preserving.kernels.markers import (
    add_direction,
    add_pair,
    change,
    distances,
    mean_jacobian,
    relative_cayley,
)
from floatframe.engine.structure_preserving.kernels.rows import mean_distance

__all__ = ["bushing_load", "user_force_load", "user_state_residual"]


# bushings -------------------------------------------------------------------------------------------------------------
# The potential of six deformations acts by its exact discrete derivative; see kernels/connections/bushing.py of the
# engine.
#
# With R = A_Aᵀ A_B = exp(theta), s = A_Aᵀ d and Q = exp(-share theta) the deformations are xi = (e, theta), e = Q s;
# the share is 0 in axes of A, 1 in axes of B, 1/2 half way. The product rule with mean values gives the changes of
# products of axes and positions. With the Cayley vectors psi and chi of the two rotations,
#
# R_1 - R_0 = tilde(psi) R_mean,   psi = Gamma dtheta,     Q_1 - Q_0 = tilde(chi) Q_mean,   chi = -share Gamma' dtheta
# de = Q_mean ds + chi × (Q_mean s_mean)
#
# where Gamma and Gamma' are Gonzalez' discrete derivatives of exp (kernels/markers.py). f and m are the force and the
# moment of the mean deformations, so that f·de + m·dtheta is the change of a potential of degree two. They act by
#
#     f on s:  Q_meanᵀ f,      tau = Gamma⁻ᵀ (m - share Gamma'ᵀ ((Q_mean s_mean) × f)),
#     on the products a_i · b_j of the axes:  1/2 tilde(tau) P,  P = (1 + tilde(psi)/2) R_0 = R_mean⁻ᵀ,
#
# because <tilde(tau) P, tilde(psi) R_mean> = 2 tau·psi. These loads depend only on products of directions and add no
# angular momentum. Damping uses the changes over the step divided by h as rates, so that it removes energy for any h.
# Tables are evaluated at the mean deformations.


@inner
def axes_change(model, discrete, step, m, mean):
    """Return the change of a marker's axes over the step; mean: mean of the axes over the step."""
    rows = transposed(mean)
    x = change(model, discrete, step, m, unit(0), rows[0])
    y = change(model, discrete, step, m, unit(1), rows[1])
    z = change(model, discrete, step, m, unit(2), rows[2])
    return transposed((x, y, z))


@inner
def mean_axes(step, m):
    """Return the mean of a marker's axes."""
    return scaled_matrix(0.5, matrix_sum(matrix(step.A_0[m]), matrix(step.A_f[m])))


@inner
def bushing_load(model, discrete, step, c):
    """Add the loads of bushing c; return the work supplied by its tables and dissipated by its damping."""
    a, b, i = model.connections.a[c], model.connections.b[c], model.connections.item[c]
    A, B, d = mean_axes(step, a), mean_axes(step, b), mean_distance(step, a, b)
    d_0, d_1 = distances(step, a, b)
    s_0, s_1 = turned_back(step.A_0[a], d_0), turned_back(step.A_f[a], d_1)
    share, angle = model.bushings.share[i], model.bushings.angle[i]
    R_0 = product(transposed(step.A_0[a]), matrix(step.A_0[b]))
    th_0, th_1 = rotation_vector(step.A_0[a], step.A_0[b]), rotation_vector(step.A_f[a], step.A_f[b])
    if angle >= 0:
        expected = vector(step.angle[angle:])
        th_0, th_1 = continued(th_0, expected), continued(th_1, expected)
    part_0, part_1 = scaled(-share, th_0), scaled(-share, th_1)
    Gamma, part = mean_jacobian(th_0, th_1), mean_jacobian(part_0, part_1)
    P = matrix_sum(R_0, product(tilde(scaled(0.5, relative_cayley(th_0, th_1))), R_0))
    Q_0, Q_1 = exp_matrix(part_0), exp_matrix(part_1)
    Q = scaled_matrix(0.5, matrix_sum(Q_0, Q_1))
    arm = turned(Q, scaled(0.5, add(s_0, s_1)))
    # change of the deformations due to the motion over the step
    dA, dB = axes_change(model, discrete, step, a, A), axes_change(model, discrete, step, b, B)
    turning = matrix_sum(product(transposed(dA), B), product(transposed(A), dB))
    dtheta = solved(Gamma, scaled(0.5, axial(product(turning, transposed(P)))))
    ds = add(turned_back(dA, d), turned_back(A, sub(vector(step.dx[b]), vector(step.dx[a]))))
    put(step.dxi, 0, add(turned(Q, ds), cross(scaled(-share, turned(part, dtheta)), arm)))
    put(step.dxi, 3, dtheta)
    put(step.xi, 0, scaled(0.5, add(turned(Q_0, s_0), turned(Q_1, s_1))))
    put(step.xi, 3, scaled(0.5, add(th_0, th_1)))
    given, taken = 0.0, 0.0
    for r in range(6):
        damping = law(model.bushings.damping[i, r], step.dxi) / step.h
        taken += damping * step.dxi[r]
        step.xi_force[r] = law(model.bushings.stiffness[i, r], step.xi) + model.bushings.preload[i, r] + damping
        table = model.bushings.table[i, r]
        if table >= 0:
            value, _, _ = time_function(model.functions, table, step.xi[r])
            step.xi_force[r] += value
            given -= value * step.dxi[r]
    f = vector(step.xi_force)
    m = sub(vector(step.xi_force[3:]), scaled(share, turned_back(part, cross(arm, f))))
    tau = solved(transposed(Gamma), m)
    G, g = product(tilde(scaled(-0.5, tau)), P), scaled(-1.0, turned_back(Q, f))
    on_A, on_B = transposed(product(B, transposed(G))), transposed(product(A, G))
    for k in range(3):
        add_direction(model, discrete, step, a, unit(k), add(on_A[k], scaled(g[k], d)))
        add_direction(model, discrete, step, b, unit(k), on_B[k])
    add_pair(step, a, b, turned(A, g))
    return given, taken


# user forces over a step: Q = f(t, x, v, z) along coordinates, z_1 - z_0 = h g(t, x, v, z) ----------------------------
# Forces are evaluated at the middle of the step, with the mean coordinates and the mean rates v, or at one
# configuration of a variational step. Their work Q dx counts as supplied. States follow the midpoint rule in all
# schemes.


@inner
def put_states(model, step, c, z, part):
    """Write the states of user force c at the fraction `part` of the step into z."""
    i = model.connections.item[c]
    change0 = step.load.shape[0] + step.f.shape[0] + model.elements.state0[i]
    for s in range(model.elements.n_states[i]):
        k = model.states.row[model.elements.state0[i] + s]
        z[s] = step.known[k] + part * step.z[change0 + s]


@inner
def user_force_load(model, work, discrete, step, c):
    """Add the loads of user force c, and return the supplied work."""
    i, first, last = indices_of(model, c)
    work.users.inputs[0] = step.t_force
    x, v, z = input_parts(work.users.inputs, last - first)
    for p in range(first, last):
        a, b, k = ends_and_row(model, p)
        change = coordinate_change(model, discrete, step, k, a, b)
        begin, end = coordinate_ends(model, step, k, a, b, change)
        x[p - first] = counted(model, k, end, step.known[k]) - 0.5 * (end - begin)
        v[p - first] = coordinate_rate(model, discrete, step, k, a, b)
    put_states(model, step, c, z, 0.0 if step.is_still else 0.5)
    user_outputs(model, work, c)
    given = 0.0
    for p in range(first, last):
        if model.coordinates.force[p] >= 0:
            Q = work.users.outputs[model.coordinates.core[p] - model.elements.core[i]]
            a, b, k = ends_and_row(model, p)
            add_impulsive_force(model, discrete, step, k, a, b, Q)
            given += Q * v[p - first] * step.h
    return given


@inner
def user_state_residual(model, work, discrete, step, c):
    """Write the residuals dz - h g of the states of user force c, with g in the middle of the step."""
    i, first, last = indices_of(model, c)
    x, v, z = input_parts(work.users.inputs, last - first)
    work.users.inputs[0] = 0.5 * (step.t_0 + step.end.state.time)
    for p in range(first, last):
        a, b, k = ends_and_row(model, p)
        begin, end = ends_of_step(model, step, k, a, b)
        x[p - first] = 0.5 * (begin + end)
        rate = (end - begin) / step.h
        if model.rows.is_angle[k] and not step.is_still:
            rate = coordinate_rate(model, discrete, step, k, a, b)
        v[p - first] = rate
    put_states(model, step, c, z, 0.5)
    user_outputs(model, work, c)
    change0 = step.load.shape[0] + step.f.shape[0] + model.elements.state0[i]
    for s in range(model.elements.n_states[i]):
        rate = work.users.outputs[model.elements.n_forces[i] + s]
        step.residual[change0 + s] = step.z[change0 + s] - step.h * rate
