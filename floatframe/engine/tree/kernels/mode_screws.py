"""Screws of the modes at a marker, their rates, and their derivatives by the modes.

In axes of the body about its origin the screw of mode k is S = (Psi_t + rho × b, b), b = T' Psi_r; its rates relative
to the body follow from those of rho, of the elastic angle and of Psi(q) = Psi - K_P q. A variation S theta in a frame
with the spatial velocity V and its rate V' has xi = S theta and, with these rates S' and S'' of the screw,

    xi_dot  = S theta_dot + (S' + V × S) theta
    xi_ddot = S theta_ddot + 2 (S' + V × S) theta_dot + (S'' + 2 V × S' + V' × S + V × (V × S)) theta
"""

from floatframe.engine.kernels.compiler.compilation import inner, small
from floatframe.engine.kernels.dense import matrix_at
from floatframe.engine.kernels.marker import bending_of, bent_by, bent_rate, shape, shapes_of
from floatframe.engine.kernels.marker_acceleration import deformation_accelerations
from floatframe.engine.kernels.rotation import left_jacobian_derivative
from floatframe.engine.kernels.vector import add, cross, dot, scaled, sub, turned, turned_back, vector
from floatframe.engine.tree.kernels.elastic_turning import second_turning
from floatframe.engine.tree.kernels.spatial import pair_sum, scaled_pair, spatial_cross, world_screw

__all__ = ["add_second_order", "mode_rate", "mode_screw", "mode_screws", "second_rates", "variation_rates"]


@small
def mode_screw(model, work, m, i, k):
    """Return the screw of mode k at marker m about the body origin: (Psi_t + rho × b, b), b = T' Psi_r."""
    d, th = shape(shapes_of(model, work.markers.psi, m), k)
    b = turned(work.markers.T_left[m], th)
    return add(d, cross(vector(work.markers.rho[m]), b)), b


@inner
def mode_rate(model, work, m, i, k):
    """Return the screw of mode k at marker m, its rate relative to the body, and (dT'/dt) Psi_r.

    `work.markers.bend_dot` must have been written for the marker.
    """
    markers, n = work.markers, model.bodies.n_q[i]
    T, rho, rho_1 = markers.T_left[m], vector(markers.rho[m]), vector(markers.rho_dot[m])
    s, b = mode_screw(model, work, m, i, k)
    _, th = shape(shapes_of(model, markers.psi, m), k)
    slope = left_jacobian_derivative(vector(markers.angle[m]), th, 1.0)
    s_1, b_1 = (0.0, 0.0, 0.0), turned(slope, vector(markers.angle_dot[m]))
    if model.markers.bend0[m] >= 0:  # the rate of Psi(q)
        d_1, th_1 = shape(matrix_at(markers.bend_dot, 0, 6, n), k)
        s_1, b_1 = sub(s_1, d_1), sub(b_1, turned(T, th_1))
    return (s, b), (add(s_1, add(cross(rho_1, b), cross(rho, b_1))), b_1), slope


@inner
def second_rates(model, work, m, i):
    """Return the second rates of position and rotation vector of marker m in body i; write K_P q_dot and K_P q_ddot.

    `mode_screws` reads them.
    """
    if model.markers.bend0[m] >= 0:
        n, u0 = model.bodies.n_q[i], model.bodies.u0[i] + 6
        bent_rate(model, work, m, i, matrix_at(work.markers.bend_dot, 0, 6, n))
        bent_by(model, m, work.state.u_dot[u0 : u0 + n], matrix_at(work.markers.bend_ddot, 0, 6, n))
    return deformation_accelerations(model, work, m, i)


@inner
def mode_screws(model, work, m, i, k, held):
    """Return the screw of mode k at marker m and its two rates relative to body i, ground axes.

    held: axes R and origin p of the body, its motion V, V', and the `second_rates` of the marker.
    """
    R, p, _, _, rho_2, angle_2 = held
    markers, n = work.markers, model.bodies.n_q[i]
    rho, rho_1 = vector(markers.rho[m]), vector(markers.rho_dot[m])
    angle, angle_1 = vector(markers.angle[m]), vector(markers.angle_dot[m])
    (s, b), (s_1, b_1), slope = mode_rate(model, work, m, i, k)
    _, th = shape(shapes_of(model, markers.psi, m), k)
    b_2 = second_turning(angle, angle_1, vector(markers.spin[m]), th, b, turned(slope, angle_1))
    s_2, b_2 = (0.0, 0.0, 0.0), add(b_2, turned(slope, angle_2))
    if model.markers.bend0[m] >= 0:
        _, th_1 = shape(matrix_at(markers.bend_dot, 0, 6, n), k)
        d_2, th_2 = shape(matrix_at(markers.bend_ddot, 0, 6, n), k)
        by_bending = turned(left_jacobian_derivative(angle, th_1, 1.0), angle_1)
        s_2, b_2 = sub(s_2, d_2), sub(b_2, add(scaled(2.0, by_bending), turned(markers.T_left[m], th_2)))
    s_2 = add(s_2, add(cross(rho_2, b), add(scaled(2.0, cross(rho_1, b_1)), cross(rho, b_2))))
    return world_screw(R, p, (s, b)), world_screw(R, p, (s_1, b_1)), world_screw(R, p, (s_2, b_2))


@inner
def variation_rates(S_0, S_1, S_2, V, V_dot):
    """Return xi_dot, xi_ddot of a variation with S theta = S_0; S_1, S_2: its rates in a moving frame."""
    turned_once = spatial_cross(V, S_0)
    own = pair_sum(scaled_pair(2.0, spatial_cross(V, S_1)), spatial_cross(V_dot, S_0))
    return pair_sum(S_1, turned_once), pair_sum(S_2, pair_sum(own, spatial_cross(V, turned_once)))


@inner
def add_second_order(model, work, m, k, R, p, factor, F, row):
    """Add the derivative by all modes of mode k's screw at marker m, relative to the body, times F.

    R, p: axes and origin of the body.

    With b = T' Psi_r,k, its derivative slope, and f, m' the force and its moment about the marker, body axes:
    Psi_t,l · (b × f) + Psi_r,l · (slopeᵀ m') - K_t,kl · f - K_r,kl · (T'ᵀ m').
    """
    f, T = turned_back(R, F), work.markers.T_left[m]
    moment = sub(turned_back(R, sub(vector(F[3:]), cross(p, vector(F)))), cross(vector(work.markers.rho[m]), f))
    psi = shapes_of(model, work.markers.psi, m)
    n = psi.shape[1]
    _, th_k = shape(psi, k)
    slope = left_jacobian_derivative(vector(work.markers.angle[m]), th_k, 1.0)
    by_place, by_turn, of_turn = cross(turned(T, th_k), f), turned_back(slope, moment), turned_back(T, moment)
    for l in range(n):  # noqa: E741
        d, th = shape(psi, l)
        total = dot(d, by_place) + dot(th, by_turn)
        if model.markers.bend0[m] >= 0:
            d, th = shape(matrix_at(bending_of(model, m)[l], 0, 6, n), k)
            total -= dot(d, f) + dot(th, of_turn)
        row[l] += factor * total
