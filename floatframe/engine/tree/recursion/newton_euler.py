"""Recursive Newton-Euler: generalised forces of a given motion of a tree (docs/recursive.md §2).

In the frame of each node, a the acceleration of its origin minus gravity (that of the ground is -g), no linear
velocity being needed:

    (1) forward   omega' = Rᵀ omega, alpha' = Rᵀ alpha, a' = Rᵀ (a + alpha × p + omega × (omega × p)) of the parent,
                  to which the joint adds its rates; markers of flexible bodies what they do in their body
    (2) body      f = m a + alpha × s + omega × (omega × s),  t = s × a + J alpha + omega × J omega; of a flexible one
                  the equations of kernels/body.py
    (3) backward  generalised forces: the wrench along the rates of the joint; the wrench goes on to the parent, and by
                  the markers to the modal forces of both bodies

Sources: Walker & Orin (1982); Featherstone (2008), chapter 5; for bodies in floating frames docs/theory.md §6.
"""

from floatframe.engine.kernels.body import body_forces
from floatframe.engine.kernels.compiler.compilation import loops, small
from floatframe.engine.kernels.marker import shape
from floatframe.engine.kernels.vector import (
    add,
    cross,
    dot,
    matrix,
    product,
    put,
    put_matrix,
    put_sum,
    scaled,
    sub,
    turned,
    turned_back,
    unit_matrix,
    vector,
)
from floatframe.engine.tree.kernels.elastic_turning import deformation_accelerations, turning_bias
from floatframe.engine.tree.recursion.nodes import ROTATION, SCREW, TRANSLATION

__all__ = ["add_modal_forces", "elastic_carrier", "marker_acceleration", "newton_euler", "relative_acceleration"]


# motion of a marker in its flexible body to second order: what a joint at it adds (docs/recursive.md §2) --------------
# With Psi(q) = Psi - K_P q, th_dot = Psi_r q_dot, T the left Jacobian at th, all in axes of the body:
#
#     rho_ddot = Psi_t q_ddot - (K_P q_dot)_t q_dot        nu = T th_dot
#     nu_dot   = T th_ddot + c,   th_ddot = Psi_r q_ddot - (K_P q_dot)_r q_dot,   c = (dT/dth [th_dot]) th_dot


@loops
def marker_acceleration(model, marker_work, m):
    """Return rho_ddot and nu_dot of marker m, whose motion in its body is written."""
    markers, zero = marker_work.markers, (0.0, 0.0, 0.0)
    if model.markers.psi0[m] < 0:
        return zero, zero
    rho_ddot, th_ddot = deformation_accelerations(model, marker_work, m, model.markers.body[m])
    c = turning_bias(vector(markers.angle[m]), vector(markers.angle_dot[m]))
    return rho_ddot, add(turned(markers.T_left[m], th_ddot), c)


@small
def relative_acceleration(omega, alpha, rho, rho_dot, rho_ddot):
    """Return the acceleration of a point of a body less that of the frame origin, body axes."""
    moved = add(cross(omega, cross(omega, rho)), scaled(2.0, cross(omega, rho_dot)))
    return add(add(cross(alpha, rho), moved), rho_ddot)


@loops
def add_modal_forces(model, marker_work, m, f, t, sign, out):
    """Add sign times the modal forces of a wrench on marker m, at its point, axes of its body, to out, (n,)."""
    o = model.markers.psi0[m]
    if o < 0:
        return
    n = out.shape[0]
    psi = marker_work.markers.psi[o : o + 6 * n]
    s = turned_back(marker_work.markers.T_left[m], t)
    for k in range(n):
        d, th = shape(psi, n, k)
        out[k] += sign * (dot(d, f) + dot(th, s))


# newton euler ---------------------------------------------------------------------------------------------------------


@loops
def elastic_carrier(model, marker_work, m, omega, alpha, a):
    """Return omega, alpha of marker m and the acceleration of its point, body axes, from those of its body."""
    markers = marker_work.markers
    rho_ddot, nu_dot = marker_acceleration(model, marker_work, m)
    nu = vector(markers.spin[m])
    moved = relative_acceleration(omega, alpha, vector(markers.rho[m]), vector(markers.rho_dot[m]), rho_ddot)
    return add(omega, nu), add(alpha, add(cross(omega, nu), nu_dot)), add(a, moved)


@loops
def elastic_body_in_joint(model, marker_work, m, omega, alpha, a):
    """Return omega, alpha, a of a flexible body from the motion of its marker m; all in body axes."""
    markers = marker_work.markers
    rho_ddot, nu_dot = marker_acceleration(model, marker_work, m)
    nu = vector(markers.spin[m])
    own = sub(omega, nu)
    turning = sub(alpha, add(cross(own, nu), nu_dot))
    moved = relative_acceleration(own, turning, vector(markers.rho[m]), vector(markers.rho_dot[m]), rho_ddot)
    return own, turning, sub(a, moved)


@small
def outer_axes(nodes, work, k):
    """Return the axes of the outer frame of the joint in those of the parent."""
    if nodes.own[k] >= 0:
        return product(work.R[k], work.R_own[k])
    return matrix(work.R[k])


@small
def joint_motion(nodes, work, k, omega, alpha, a):
    """Return omega, alpha, a including the motion of the joint of node k, outer frame of the joint."""
    kind, v0 = nodes.kind[k], nodes.v0[k]
    if kind == SCREW:
        turn, slide = nodes.turn[k], nodes.slide[k]
        rate, second = work.v[v0], work.a[v0]
        x, y = omega[1], -omega[0]  # omega × e
        w = turn * rate
        if slide != 0.0:
            c = 2 * slide * rate
            a = (a[0] + c * x, a[1] + c * y, a[2] + slide * second)
        alpha = (alpha[0] + w * x, alpha[1] + w * y, alpha[2] + turn * second)
        omega = (omega[0], omega[1], omega[2] + w)
    elif kind == ROTATION:
        rate, second = vector(work.v[v0:]), vector(work.a[v0:])
        if nodes.is_near[k]:
            E = outer_axes(nodes, work, k)
            rate = scaled(-1.0, turned_back(E, turned(work.A[k], rate)))
            second = scaled(-1.0, turned_back(E, turned(work.A[k], second)))
        alpha = add(add(alpha, cross(omega, rate)), second)
        omega = add(omega, rate)
    elif kind == TRANSLATION:
        slide = nodes.slide[k]
        rate, second = vector(work.v[v0:]), vector(work.a[v0:])
        a = add(a, scaled(slide, add(second, scaled(2.0, cross(omega, rate)))))
    return omega, alpha, a


@loops
def forward(nodes, work, model, marker_work):
    """Write motion and forces of all bodies (1), (2)."""
    for k in range(nodes.parent.shape[0]):
        above = nodes.parent[k]
        o, R, m_above, m_own = vector(work.p[k]), matrix(work.R[k]), nodes.above[k], nodes.own[k]
        if m_own >= 0:
            o = add(o, turned(R, vector(marker_work.markers.rho[m_own])))
            R = product(R, work.R_own[k])
        if above < 0:
            omega, alpha, a = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0), scaled(-1.0, vector(work.gravity))
            a = turned_back(R, a)
        else:
            omega, alpha, a = vector(work.omega[above]), vector(work.alpha[above]), vector(work.acc[above])
            if m_above >= 0:
                omega, alpha, a = elastic_carrier(model, marker_work, m_above, omega, alpha, a)
                o = sub(o, vector(work.rho[k]))
            a = turned_back(R, add(a, add(cross(alpha, o), cross(omega, cross(omega, o)))))
            omega, alpha = turned_back(R, omega), turned_back(R, alpha)
        omega, alpha, a = joint_motion(nodes, work, k, omega, alpha, a)
        if m_own >= 0:
            own = work.R_own[k]
            omega, alpha, a = turned(own, omega), turned(own, alpha), turned(own, a)
            omega, alpha, a = elastic_body_in_joint(model, marker_work, m_own, omega, alpha, a)
        put(work.omega[k], 0, omega)
        put(work.alpha[k], 0, alpha)
        put(work.acc[k], 0, a)
        f, t = (0.0, 0.0, 0.0), (0.0, 0.0, 0.0)
        if nodes.n_q[k] > 0:
            i, u0 = nodes.body[k], nodes.u0[k]
            put_matrix(marker_work.state.R[i], unit_matrix())
            put(marker_work.state.u, u0 + 3, omega)
            put(marker_work.state.u_dot, u0, add(a, vector(model.gravity)))
            put(marker_work.state.u_dot, u0 + 3, alpha)
            body_forces(model, marker_work, i)
            residual = marker_work.bodies.residual
            f, t = vector(residual[u0:]), vector(residual[u0 + 3 :])
        elif nodes.body[k] >= 0:
            s, J = vector(nodes.s[k]), nodes.J[k]
            turning = add(cross(alpha, s), cross(omega, cross(omega, s)))
            f = add(scaled(nodes.mass[k], a), turning)
            turning = add(turned(J, alpha), cross(omega, turned(J, omega)))
            t = add(cross(s, a), turning)
        put(work.f[k], 0, f)
        put(work.t[k], 0, t)


@loops
def backward(nodes, work, model, marker_work):
    """Transfer wrenches back to the base (3)."""
    residual = marker_work.bodies.residual
    for k in range(nodes.parent.shape[0] - 1, -1, -1):
        f, t = vector(work.f[k]), vector(work.t[k])
        n, above = nodes.n_q[k], nodes.parent[k]
        f_Q, t_Q = f, t
        if n > 0:
            h = residual[nodes.u0[k] + 6 : nodes.u0[k] + 6 + n]
            m = nodes.own[k]
            if m >= 0:
                t_Q = sub(t, cross(vector(marker_work.markers.rho[m]), f))
                add_modal_forces(model, marker_work, m, f, t_Q, -1.0, h)
                f_Q, t_Q = turned_back(work.R_own[k], f), turned_back(work.R_own[k], t_Q)
            for j in range(n):
                work.force[nodes.vq[k] + j] = h[j]
        put(work.reaction[k], 0, f_Q)
        put(work.reaction[k], 3, t_Q)
        kind, v0 = nodes.kind[k], nodes.v0[k]
        if kind == SCREW:
            work.force[v0] = nodes.slide[k] * f_Q[2] + nodes.turn[k] * t_Q[2]
        elif kind == ROTATION:
            if nodes.is_near[k]:
                t_Q = scaled(-1.0, turned_back(work.A[k], turned(outer_axes(nodes, work, k), t_Q)))
            put(work.force, v0, t_Q)
        elif kind == TRANSLATION:
            put(work.force, v0, scaled(nodes.slide[k], f_Q))
        if above >= 0:
            R = work.R[k]
            f = turned(R, f)
            t = add(turned(R, t), cross(vector(work.p[k]), f))
            put_sum(work.f[above], 0, f)
            put_sum(work.t[above], 0, t)
            m = nodes.above[k]
            if m >= 0:
                u0 = nodes.u0[above] + 6
                t = sub(t, cross(vector(work.rho[k]), f))
                add_modal_forces(model, marker_work, m, f, t, 1.0, residual[u0 : u0 + nodes.n_q[above]])


@loops
def newton_euler(nodes, work, model, marker_work):
    """Write the generalised forces of the motion in `work`, with reactions at all joints; nodes are already placed."""
    forward(nodes, work, model, marker_work)
    backward(nodes, work, model, marker_work)
